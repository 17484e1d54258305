// @ts-check
// Buttons of a person's own, each with lines of its own. The browser keeps them.

import {by, make} from "dom";

/** @typedef {{name: string, lines: string[]}} Macro */

/** Under which name the browser keeps them. */
const KEPT = "macros";

/** @returns {Macro[]} */
function kept() {
  try {
    const all = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    return Array.isArray(all) ? all.filter((one) => typeof one?.name === "string" && Array.isArray(one.lines)) : [];
  } catch {
    return [];
  }
}

export class Macros {
  #all = kept();

  /** @param {(macro: Macro) => void} run */
  constructor(run) {
    this.run = run;
    by("macro-new").addEventListener("submit", (event) => {
      event.preventDefault();
      const [name, lines] = [/** @type {HTMLInputElement} */ (by("macro-name")), /** @type {HTMLTextAreaElement} */ (by("macro-lines"))];
      const macro = {name: name.value.trim(), lines: lines.value.split("\n").map((line) => line.trim()).filter(Boolean)};
      if (!macro.name || !macro.lines.length) return;
      this.#keep([...this.#all.filter((one) => one.name !== macro.name), macro]);
      name.value = lines.value = "";
    });
    this.#show();
  }

  /** @param {Macro[]} all */
  #keep(all) {
    this.#all = all;
    try {
      localStorage.setItem(KEPT, JSON.stringify(all));
    } catch {
      // A page without storage forgets them.
    }
    this.#show();
  }

  #show() {
    by("macro-buttons").replaceChildren(...this.#all.map((macro) => make("button", {class: "drive", text: macro.name, title: macro.lines.join("\n"), onclick: () => this.run(macro)})));
    by("macro-removals").replaceChildren(...this.#all.map((macro) => make("button", {text: `Remove ${macro.name}`, onclick: () => this.#keep(this.#all.filter((one) => one !== macro))})));
  }
}
