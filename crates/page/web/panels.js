// @ts-check
// Position, overrides, settings, switches, console: what the machine says, and what can be pressed.

import {by, make, say} from "dom";

/** @typedef {import("state").State} State */
/** @typedef {import("state").Hello} Hello */
/** @typedef {import("state").Settings} Settings */

/** Realtime bytes of the overrides: their names, and what each button sends. */
const OVERRIDES = [
  {name: "Feed", index: 0, buttons: [["−10", 0x92], ["−1", 0x94], ["100", 0x90], ["+1", 0x93], ["+10", 0x91]]},
  {name: "Rapid", index: 1, buttons: [["25", 0x97], ["50", 0x96], ["100", 0x95]]},
  {name: "Spindle", index: 2, buttons: [["−10", 0x9b], ["−1", 0x9d], ["100", 0x99], ["+1", 0x9c], ["+10", 0x9a]]},
];

export class Position {
  /** @type {{work: HTMLElement, machine: HTMLElement}[]} */
  #rows = [];

  /**
   * @param {string[]} axes
   * @param {(axis: string) => void} zero
   */
  build(axes, zero) {
    this.#rows = [];
    const rows = axes.map((axis) => {
      const [work, machine] = [make("td", {"data-axis": axis}), make("td")];
      this.#rows.push({work, machine});
      const button = make("button", {class: "drive", text: `${axis}0`, "aria-label": `${axis}0: make this ${axis} zero`, onclick: () => zero(axis)});
      return make("tr", {}, [make("th", {scope: "row", text: axis}), work, machine, make("td", {}, [button])]);
    });
    by("axes").querySelector("tbody")?.replaceChildren(...rows);
  }

  /**
   * @param {State} state
   * @param {boolean} laser
   * @param {number} fullPower
   * @param {import("state").Unit} unit
   */
  show(state, laser, fullPower, unit) {
    this.#rows.forEach((row, axis) => {
      const length = axis < 3 ? unit : {mm: 1, digits: 3};
      say(row.machine, fixed(state.position[axis], length));
      say(row.work, fixed(state.position[axis] - state.offset[axis], length));
    });
    showHeaters(state);
    say(by("feed"), (state.feed / unit.mm).toFixed(unit.mm === 1 ? 0 : 1));
    say(by("feed-unit"), `${unit.name}/min`);
    say(by("queued"), Number.isNaN(state.queued) ? "–" : state.queued.toFixed(1));
    say(by("power-name"), laser ? "Laser" : "Spindle");
    const on = state.spindle > 0;
    const power = laser ? `${(state.power * 100).toFixed(0)} %` : `${(state.power * fullPower).toFixed(0)} rpm`;
    say(by("power"), on ? power + (state.spindle === 2 && !laser ? " ccw" : "") : "off");
  }
}

/** Shows the temperatures: a figure for each heater. @param {State} state */
function showHeaters({heaters}) {
  const place = by("heaters");
  if (place.childElementCount !== heaters.length) {
    place.replaceChildren(...heaters.map(({name}) => make("div", {}, [make("dt", {text: name}), make("dd", {"data-heater": name})])));
  }
  heaters.forEach(({now, target}, index) => {
    const figure = /** @type {HTMLElement} */ (place.children[index].lastChild);
    say(figure, `${now.toFixed(1)} °C${target > 0 ? ` of ${target.toFixed(0)}` : ""}`);
  });
}

/** @param {number} value mm @param {{mm: number, digits: number}} unit */
function fixed(value, {mm, digits}) {
  return (value / mm).toFixed(digits).replace(/^-(0\.0*)$/, "$1");
}

/** @param {(byte: number) => void} press */
export function buildOverrides(press) {
  const rows = OVERRIDES.map(({name, buttons}) => {
    const all = buttons.map(([label, byte]) =>
      make("button", {text: String(label), "aria-label": `${name} override ${label} %`, onclick: () => press(Number(byte))}));
    return make("div", {class: "override", role: "group", "aria-label": `${name} override`}, [
      make("span", {text: name}), make("b", {id: `override-${name.toLowerCase()}`, text: "100 %"}), ...all]);
  });
  const stop = make("button", {text: "Spindle stop", title: "In a hold: the spindle stands, and turns again", onclick: () => press(0x9e)});
  const coolant = [["Flood", 0xa0], ["Mist", 0xa1]].map(([label, byte]) =>
    make("button", {id: `coolant-${label}`, text: String(label), "aria-pressed": "false", onclick: () => press(Number(byte))}));
  by("overrides").replaceChildren(...rows, make("div", {class: "row", role: "group", "aria-label": "Accessories"}, [stop, ...coolant]));
}

/** @param {HTMLElement} button @param {boolean} isOn */
function showPressed(button, isOn) {
  const now = String(isOn);
  if (button.getAttribute("aria-pressed") !== now) button.setAttribute("aria-pressed", now);
}

/** @param {State} state */
export function showOverrides(state) {
  for (const {name, index} of OVERRIDES) say(by(`override-${name.toLowerCase()}`), `${state.overrides[index]} %`);
  ["Flood", "Mist"].forEach((name, bit) => showPressed(by(`coolant-${name}`), Boolean(state.coolant & (1 << bit))));
}

/** Shows the outputs that the machine reports; each button switches one (M64, M65). @param {State} state @param {(line: string) => void} send */
export function showOutputs({outputs}, send) {
  const place = by("outputs");
  if (place.childElementCount !== outputs.length) {
    place.replaceChildren(...outputs.map((_, number) => {
      const button = make("button", {class: "drive", text: `Output ${number}`, title: `M64 P${number}: on; M65 P${number}: off`, "aria-pressed": "false"});
      button.addEventListener("click", () => send(`${button.getAttribute("aria-pressed") === "true" ? "M65" : "M64"}P${number}`));
      return button;
    }));
  }
  outputs.forEach((isOn, number) => showPressed(/** @type {HTMLElement} */ (place.children[number]), isOn));
}

const SIMULATED = "The simulated machine's switches. Limit switches, probe and door stay as they are put; buttons spring back.";

/** Switches of the simulated machine, or inputs of a board. */
export class Switches {
  /** @type {{button: HTMLElement, pressed: (state: State) => boolean}[]} */
  #all = [];

  /**
   * @param {Hello} hello
   * @param {(key: number) => void} press
   */
  build(hello, press) {
    const motors = hello.axes.map((axis) => `Limit ${axis}`).concat(hello.second ? [`Limit ${hello.second}2`] : []);
    const limits = motors.map((name, motor) => ({name, key: motor < hello.axes.length ? 16 + motor : 5, pressed: (/** @type {State} */ state) => Boolean(state.limits & (1 << motor))}));
    const bit = (/** @type {number} */ n) => (/** @type {State} */ state) => Boolean(state.switches & (1 << n));
    const others = [
      {name: "Probe", key: 4, pressed: bit(0)}, {name: "Door", key: 0, pressed: bit(1)}, {name: "Hold button", key: 1, pressed: bit(2)},
      {name: "Start button", key: 2, pressed: bit(3)}, {name: "Reset button", key: 3, pressed: bit(4)},
    ];
    this.#all = [...limits, ...others].map(({name, key, pressed}) => ({
      button: make("button", {text: name, "aria-pressed": "false", disabled: hello.board === true, onclick: () => press(key)}), pressed,
    }));
    say(by("switches-text"), hello.board ? "The inputs of the board, as it reports them." : SIMULATED);
    by("switches").replaceChildren(...this.#all.map(({button}) => button));
  }

  /** @param {State} state */
  show(state) {
    for (const {button, pressed} of this.#all) showPressed(button, pressed(state));
  }
}

/** The settings with their names and limits. */
export class SettingsPanel {
  /** @param {(line: string) => void} send */
  constructor(send) {
    this.send = send;
    by("settings-filter").addEventListener("input", () => this.#filter());
  }

  /** @param {Settings} settings */
  load(settings) {
    const body = by("settings").querySelector("tbody");
    if (!body) return;
    for (const row of [...body.rows]) if (!settings.byNumber.has(Number(row.dataset.number))) row.remove();
    const rows = [...settings.byNumber.values()].map((one) => {
      const before = document.getElementById(`setting-${one.number}`);
      if (before instanceof HTMLInputElement) {
        if (document.activeElement !== before) before.value = one.value;
        return null;
      }
      const input = make("input", {id: `setting-${one.number}`, value: one.value, inputmode: "decimal", class: "drive", "aria-label": `$${one.number} ${one.name}`});
      input.addEventListener("change", () => this.send(`$${one.number}=${/** @type {HTMLInputElement} */ (input).value}`));
      return make("tr", {"data-number": one.number}, [
        make("td", {}, [make("b", {text: `$${one.number} ${one.name}`}), make("br"), make("small", {text: one.description})]),
        make("td", {}, [input]), make("td", {}, [make("small", {text: [one.unit, one.range].filter(Boolean).join(", ")})])]);
    });
    body.append(...rows.filter((row) => row !== null));
  }

  /** Shows the values in force again. @param {Settings} settings */
  restore(settings) {
    for (const one of settings.byNumber.values()) {
      const input = document.getElementById(`setting-${one.number}`);
      if (input instanceof HTMLInputElement) input.value = one.value;
    }
  }

  #filter() {
    const wanted = /** @type {HTMLInputElement} */ (by("settings-filter")).value.toLowerCase();
    for (const row of by("settings").querySelectorAll("tbody tr")) {
      /** @type {HTMLElement} */ (row).hidden = !row.textContent?.toLowerCase().includes(wanted);
    }
  }
}

const KEPT = 500;

/** What was said. */
export class Console {
  #place = by("log");

  /** @param {(line: string) => boolean} send answers whether it could */
  constructor(send) {
    by("say").addEventListener("submit", (event) => {
      event.preventDefault();
      const line = /** @type {HTMLInputElement} */ (by("line"));
      if (line.value && send(line.value)) line.value = "";
    });
  }

  /**
   * @param {string} text
   * @param {"sent" | "heard" | "bad" | "note"} kind
   */
  add(text, kind) {
    const follows = this.#place.scrollHeight - this.#place.scrollTop - this.#place.clientHeight < 30;
    this.#place.append(make("div", {class: kind, text: kind === "sent" ? `> ${text}` : text}));
    while (this.#place.childElementCount > KEPT) this.#place.firstChild?.remove();
    if (follows) this.#place.scrollTop = this.#place.scrollHeight;
  }
}
