// @ts-check
// Jogging: a step at a time, or for as long as a key or a button is held.

import {by, hasDialog, make} from "dom";
import {listenForGamepads} from "gamepad";
import {mmIn} from "units";

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
 * @property {() => {position: number[], travel: {low: number[], high: number[]}, softLimits: boolean, jogs: boolean}} machine
 */

export class Jog {
  #step = /** @type {HTMLSelectElement} */ (by("jog-step"));
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
    listenForGamepads({
      // A jog that is cancelled ends before another one begins: the machine would drop both.
      begin: (ways) => {
        const isFree = !this.hands.machine().jogs;
        if (isFree) this.begin(ways);
        return isFree;
      },
      end: () => this.release(),
    });
  }

  /** Takes another unit for steps. @param {import("state").Unit} unit */
  measure(unit) {
    if (this.#unit === unit) return;
    this.#unit = unit;
    const [chosen, ...others] = STEPS[unit.name];
    const options = [["hold", "while held"], ...[chosen, ...others].sort((a, b) => Number(a) - Number(b)).map((step) => [step, `${step} ${unit.name}`]), ["own", "own …"]];
    this.#step.replaceChildren(...options.map(([value, text]) => make("option", {value, text, selected: value === chosen})));
    by("jog-own").hidden = true;
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
    if (this.#step.value === "hold") return this.begin([way]);
    const mm = this.#unit?.mm ?? 1;
    // A rotary axis turns by as many degrees as the field has.
    const own = mmIn("jog-mm") / (axis < 3 ? 1 : mm);
    const length = this.#step.value === "own" ? own : Number(this.#step.value) * (axis < 3 ? mm : 1);
    if (length > 0) this.hands.say(`$J=G91G21${way[0]}${Number((sign * length).toFixed(5))}F${this.#feed}`);
  }

  /** mm/min */
  get #feed() {
    return Math.max(Math.round(mmIn("jog-feed")) || 100, 1);
  }

  /** Jogs until `release`. @param {string[]} ways as far along each axis */
  begin(ways) {
    const {position, travel, softLimits} = this.hands.machine();
    this.#held = ways.join(" ");
    const rooms = ways.map((way) => {
      const axis = "XYZA".indexOf(way[0]);
      const [low, high] = [travel.low[axis], travel.high[axis]];
      const room = way[1] === "+" ? high - position[axis] : position[axis] - low;
      return softLimits ? Math.max(room - 0.01, 0) : Math.max(high - low, 100);
    });
    const far = Math.min(...rooms);
    if (far > 0.001) this.hands.say(`$J=G91G21${ways.map((way) => `${way.replace("+", "")}${far.toFixed(3)}`).join("")}F${this.#feed}`);
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
    if (!way || !this.#keys.checked || isTyping || hasDialog()) return;
    event.preventDefault();
    if (!down) this.release();
    else if (!event.repeat) this.press(way);
  }
}
