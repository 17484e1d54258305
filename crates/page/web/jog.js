// @ts-check
// Jogging: a step at a time, or for as long as a key or a button is held.

import {by, make} from "dom";

/** The byte that ends a jog. */
const CANCEL = 0x85;
/** What a step of a jog is called, and which way it goes. */
const PAD = [
  ["", "Y+", "", "Z+", "A+"],
  ["X-", "stop", "X+", "", ""],
  ["", "Y-", "", "Z-", "A-"],
];
/** Steps, by the unit; the first one is chosen. @type {Record<string, string[]>} */
const STEPS = {mm: ["10", "0.01", "0.1", "1", "50"], in: ["0.1", "0.001", "0.01", "1", "2"]};
const NAMES = {"X-": "←", "X+": "→", "Y+": "↑", "Y-": "↓"};
/** @type {Record<string, string>} */
const KEYS = {ArrowLeft: "X-", ArrowRight: "X+", ArrowUp: "Y+", ArrowDown: "Y-", PageUp: "Z+", PageDown: "Z-"};

/**
 * @typedef {object} Hands
 * @property {(line: string) => void} say
 * @property {(byte: number) => void} press
 * @property {() => {position: number[], travel: {low: number[], high: number[]}, softLimits: boolean}} machine
 */

export class Jog {
  #step = /** @type {HTMLSelectElement} */ (by("jog-step"));
  #own = /** @type {HTMLInputElement} */ (by("jog-mm"));
  #feed = /** @type {HTMLInputElement} */ (by("jog-feed"));
  #keys = /** @type {HTMLInputElement} */ (by("jog-keys"));
  #held = "";
  /** @type {import("state").Unit | null} */
  #unit = null;

  /** @param {Hands} hands */
  constructor(hands) {
    this.hands = hands;
    this.#step.addEventListener("change", () => (by("jog-own").hidden = this.#step.value !== "own"));
    document.addEventListener("keydown", (event) => this.#key(event, true));
    document.addEventListener("keyup", (event) => this.#key(event, false));
    window.addEventListener("blur", () => this.release());
  }

  /** Takes another unit for steps and feed. @param {import("state").Unit} unit */
  measure(unit) {
    if (this.#unit === unit) return;
    const feed = (Number(this.#feed.value) || 1000) * (this.#unit?.mm ?? 1);
    this.#feed.value = String(Math.round(feed / unit.mm));
    this.#unit = unit;
    const [chosen, ...others] = STEPS[unit.name];
    const options = [["hold", "while held"], ...[chosen, ...others].sort((a, b) => Number(a) - Number(b)).map((step) => [step, `${step} ${unit.name}`]), ["own", "own …"]];
    this.#step.replaceChildren(...options.map(([value, text]) => make("option", {value, text, selected: value === chosen})));
    by("jog-own").hidden = true;
    for (const [id, name] of [["jog-unit", unit.name], ["jog-feed-unit", `${unit.name}/min`]]) by(id).textContent = name;
  }

  /** @param {string[]} axes */
  build(axes) {
    const buttons = PAD.flat().map((way) => {
      if (way === "stop") return make("button", {text: "■", "aria-label": "Stop the jog", onclick: () => this.hands.press(CANCEL)});
      if (!way || !axes.includes(way[0])) return make("span");
      const name = `${way[0]} ${way[1] === "+" ? "plus" : "minus"}`;
      const mark = /** @type {Record<string, string>} */ (NAMES)[way];
      const button = make("button", {class: "drive", text: mark ? `${mark} ${way[0]}` : way.replace("-", "−"), "aria-label": `Jog ${name}`});
      button.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        if (event.isTrusted) button.setPointerCapture(event.pointerId);
        this.press(way);
      });
      for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(end, () => this.release());
      button.addEventListener("keydown", (event) => {
        if ((event.key === "Enter" || event.key === " ") && !event.repeat) this.press(way);
      });
      button.addEventListener("keyup", () => this.release());
      return button;
    });
    by("pad").replaceChildren(...buttons);
  }

  /** @param {string} way */
  press(way) {
    const axis = "XYZA".indexOf(way[0]);
    const sign = way[1] === "+" ? 1 : -1;
    const mm = this.#unit?.mm ?? 1;
    const feed = Math.max(Math.round((Number(this.#feed.value) || 100) * mm), 1);
    if (this.#step.value !== "hold") {
      const step = Number(this.#step.value === "own" ? this.#own.value : this.#step.value);
      const length = axis < 3 ? step * mm : step;
      if (step > 0) this.hands.say(`$J=G91G21${way[0]}${Number((sign * length).toFixed(5))}F${feed}`);
      return;
    }
    this.#held = way;
    const {position, travel, softLimits} = this.hands.machine();
    const [low, high] = [travel.low[axis], travel.high[axis]];
    const room = sign > 0 ? high - position[axis] : position[axis] - low;
    const way_ = softLimits ? Math.max(room - 0.01, 0) : Math.max(high - low, 100);
    if (way_ > 0.001) this.hands.say(`$J=G91G21${way[0]}${(sign * way_).toFixed(3)}F${feed}`);
  }

  release() {
    if (!this.#held) return;
    this.#held = "";
    this.hands.press(CANCEL);
  }

  /**
   * @param {KeyboardEvent} event
   * @param {boolean} down
   */
  #key(event, down) {
    const way = KEYS[event.key];
    const target = /** @type {HTMLElement} */ (event.target);
    const isTyping = target.matches?.("input:not([type=checkbox]), select, textarea, [role=application], [role=tab], .program, .log, .scroll");
    if (!way || !this.#keys.checked || isTyping) return;
    event.preventDefault();
    if (!down) this.release();
    else if (!event.repeat) this.press(way);
  }
}
