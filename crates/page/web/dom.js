// @ts-check
// Elements by name, and made.

/**
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
export function by(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`no element ${id}`);
  return /** @type {T} */ (found);
}

/**
 * Makes an element.
 * @param {string} tag
 * @param {Record<string, string | number | boolean | ((event: any) => void)>} [marks] attributes, `text`, and `on...` functions
 * @param {(Node | string)[]} [inside]
 */
export function make(tag, marks = {}, inside = []) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(marks)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (name === "text") element.textContent = String(value);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else element.setAttribute(name, String(value));
  }
  element.append(...inside);
  return element;
}

/**
 * Sets a text where it has changed: the browser lays the page out again otherwise.
 * @param {HTMLElement} element
 * @param {string} text
 */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Whether a dialogue has the page. */
export function hasDialog() {
  return document.querySelector("dialog[open]") !== null;
}

/** The button that led to the last dialogue: the focus comes back to it, as long as nothing else has got it. @type {HTMLButtonElement | null} */
let owed = null;
document.addEventListener("focusin", ({target}) => {
  if (target !== owed && !hasDialog()) owed = null;
});

/** Opens a dialogue that a button leads to. @param {HTMLDialogElement} dialog @param {HTMLElement} opener */
export function lead(dialog, opener) {
  dialog.showModal();
  dialog.onclose = () => {
    owed = /** @type {HTMLButtonElement} */ (opener);
    giveFocusBack();
  };
}

/** Gives the focus back to the button that led to the last dialogue, once it can be pressed. */
export function giveFocusBack() {
  if (!owed || owed.disabled || hasDialog()) return;
  // The browser takes the focus away from what is gone with its next frame only.
  if (document.activeElement?.matches("body, :disabled, dialog:not([open]) *") ?? true) owed.focus();
}

/** Saves a text as a file. @param {string} name @param {string} text */
export function download(name, text) {
  make("a", {href: URL.createObjectURL(new Blob([text], {type: "text/plain"})), download: name}).click();
}

/** @param {number} seconds */
export function duration(seconds) {
  const whole = Math.round(seconds);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  if (h) return `${h} h ${two(m)} min`;
  if (m) return `${m} min ${two(s)} s`;
  return seconds < 10 ? `${seconds.toFixed(1)} s` : `${s} s`;
}

/** Makes tabs of the elements of a tab list. @param {HTMLElement} list */
export function tabs(list) {
  const all = /** @type {HTMLElement[]} */ ([...list.querySelectorAll('[role="tab"]')]);
  const choose = (/** @type {HTMLElement} */ chosen) => {
    for (const tab of all) {
      tab.setAttribute("aria-selected", String(tab === chosen));
      tab.tabIndex = tab === chosen ? 0 : -1;
      by(tab.getAttribute("aria-controls") ?? "").hidden = tab !== chosen;
    }
  };
  all.forEach((tab, index) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (!step) return;
      const next = all[(index + step + all.length) % all.length];
      choose(next);
      next.focus();
      event.preventDefault();
    });
  });
}
