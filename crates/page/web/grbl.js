// @ts-check
// What a board with Grbl says, and boards that are Grbl as far as they are: what one leaves out is missing, and no fault.

import {heatersOf, outputsOf} from "state";

/** @typedef {import("state").State} State */
/** @typedef {import("state").Setting} Setting */

/** Letters of the axes, in the order of reports. */
const LETTERS = [..."XYZABCUVW"];
const INCH = 25.4;

/** Whether a line is what a board says when it has started. @param {string} line */
export function isBanner(line) {
  return /^Grbl(HAL)? \d/i.test(line);
}

/**
 * A status report taken apart; `null` for any other line.
 * @param {string} line
 */
export function reportOf(line) {
  const inside = line.match(/^<([A-Z][A-Za-z]*(?::\d+)?)((?:\|[^|>]*)*)>$/);
  if (!inside) return null;
  const fields = inside[2].split("|").slice(1);
  return {name: inside[1], fields, by: new Map(fields.map((field) => /** @type {[string, string]} */ (field.split(/:(.*)/s))))};
}

/** @typedef {NonNullable<ReturnType<typeof reportOf>>} Report */

/** @param {string | undefined} list */
const numbers = (list) => (list ?? "").split(",").filter(Boolean).map(Number);

/** The bits of the letters that stand in a text. @param {string} text @param {string[]} letters */
const bits = (text, letters) => letters.reduce((all, letter, bit) => all | (text.includes(letter) ? 1 << bit : 0), 0);

/** The place of contact that a probe reports, machine coordinates, mm; `null` for other lines. @param {string} line @param {number} mm in a unit of the reports */
export function contactOf(line, mm) {
  const places = line.match(/^\[PRB:([^:]*):1\]$/);
  return places && numbers(places[1]).map((place) => place * mm);
}

/** What is known of the board: its reports tell only what has changed. */
export class Known {
  name = "";
  alarm = "";
  message = "";
  #isFresh = false;
  /** Why the place is not known; empty if it is. */
  doubt = "";
  /** @type {number[]} */
  position = [];
  /** @type {number[]} */
  offset = [];
  overrides = [100, 100, 100];
  feed = 0;
  speed = 0;
  spindle = 0;
  coolant = 0;
  limits = 0;
  switches = 0;
  /** @type {State["heaters"]} */
  heaters = [];
  /** @type {boolean[]} */
  outputs = [];
  /** Free blocks and bytes, and the most that were ever free. @type {{blocks: number, bytes: number} | null} */
  free = null;
  most = {blocks: 0, bytes: 0};
  /** @type {Map<number, string>} */
  settings = new Map();
  /** Whether it is Grbl of another make, with settings of its own. */
  isForeign = false;
  version = "";

  /** @param {number} number */
  setting(number) {
    return Number(this.settings.get(number) ?? 0);
  }

  /** mm in a unit of the reports. */
  get unit() {
    return this.setting(13) ? INCH : 1;
  }

  get axes() {
    return LETTERS.slice(0, Math.max(this.position.length, 1));
  }

  /** Whether nothing moves. */
  get rests() {
    return /^(Idle|Alarm|Check|Sleep|Tool|Hold:0|Door:[01])$/.test(this.name);
  }

  /** Takes a message, which comes with a state. @param {string} words */
  say(words) {
    this.message = words;
    this.#isFresh = true;
  }

  /** @param {Report} report */
  take({name, fields, by}) {
    const [state, code] = name.split(":");
    const before = this.name.split(":")[0];
    this.name = state === "Alarm" ? state : name;
    if (state === "Alarm" && code) this.alarm = `ALARM:${code}`;
    if (state !== "Alarm") this.alarm = "";
    // What came since the report before belongs to the new state.
    if (state !== before && before && !this.#isFresh) this.message = "";
    this.#isFresh = false;
    const places = (/** @type {string | undefined} */ list) => numbers(list).map((value) => value * this.unit);
    if (by.has("WCO")) this.offset = places(by.get("WCO"));
    if (by.has("MPos")) this.position = places(by.get("MPos"));
    else if (by.has("WPos")) this.position = places(by.get("WPos")).map((place, axis) => place + (this.offset[axis] ?? 0));
    while (this.offset.length < this.position.length) this.offset.push(0);
    const [feed, speed] = numbers(by.get("FS") ?? by.get("F"));
    this.feed = (feed ?? 0) * this.unit;
    this.speed = speed ?? this.speed;
    this.#accessories(by);
    const pins = by.get("Pn") ?? "";
    this.limits = bits(pins, this.axes);
    this.switches = bits(pins, ["P", "D", "H", "S", "R"]);
    this.heaters = heatersOf(fields);
    this.outputs = outputsOf(fields);
    const [blocks, bytes] = numbers(by.get("Bf"));
    this.free = bytes === undefined ? null : {blocks, bytes};
    if (this.free) this.most = {blocks: Math.max(blocks, this.most.blocks), bytes: Math.max(bytes, this.most.bytes)};
  }

  /** Spindle and coolant stand beside the overrides, or are off. @param {Map<string, string>} by */
  #accessories(by) {
    if (by.has("Ov")) this.overrides = numbers(by.get("Ov"));
    const on = by.get("A");
    if (on !== undefined || by.has("Ov")) {
      this.spindle = on?.includes("S") ? 1 : on?.includes("C") ? 2 : 0;
      this.coolant = bits(on ?? "", ["F", "M"]);
    }
    if (this.speed > 0 && this.spindle === 0) this.spindle = 1;
  }

  /** Takes the answer to `$I`. @param {string[]} lines */
  build(lines) {
    this.isForeign = lines.some((line) => /^\[(NEWOPT|FIRMWARE):|FluidNC|grblHAL/i.test(line));
    const version = lines.map((line) => line.match(/^\[VER:([^:\]]*)/)?.[1]).find(Boolean);
    // Grbl's ends with its day: 1.1h.20190830.
    this.version = version?.replace(/\.\d{8}$/, "") ?? this.version;
    const [, blocks, bytes] = (lines.map((line) => line.match(/^\[OPT:([^\]]*)/)?.[1]).find(Boolean) ?? "").split(",").map(Number);
    if (blocks > 0 && bytes > 0) this.most = {blocks, bytes};
  }

  /** Takes the answer to `$$`. @param {string[]} lines */
  list(lines) {
    const pairs = lines.map((line) => line.match(/^\$(\d+)=([^ ]*)/)).filter((found) => found !== null);
    if (pairs.length) this.settings = new Map(pairs.map(([, number, value]) => [Number(number), value]));
  }

  /** Takes the answers to `$#` and `$G`: the zero of work before a report tells it. @param {string[]} offsets @param {string[]} modes */
  zero(offsets, modes) {
    const system = modes.join(" ").match(/\bG5[4-9](?:\.[1-3])?\b/)?.[0] ?? "G54";
    const of = (/** @type {string} */ name) => numbers(offsets.map((line) => line.match(/^\[([^:]*):([^\]]*)/)).find((found) => found?.[1] === name)?.[2]);
    const [work, shift, tool] = [of(system), of("G92"), of("TLO")];
    // The length of a tool is a number, or one for each axis.
    const length = (/** @type {number} */ axis) => (tool.length === 1 ? (axis === 2 ? tool[0] : 0) : tool[axis] ?? 0);
    if (work.length) this.offset = work.map((place, axis) => (place + (shift[axis] ?? 0) + length(axis)) * this.unit);
  }

  /** Settings as the checker takes them: those of another make mean other things here. */
  get listing() {
    const isGrbls = (/** @type {number} */ number) => number <= 32 || (number >= 100 && number < 140);
    return [...this.settings].filter(([number]) => !this.isForeign || isGrbls(number)).map(([number, value]) => `$${number}=${value}\n`).join("");
  }

  /** Whether its times are Grbl's. */
  get isGrbl() {
    return this.isForeign || this.most.blocks <= 16;
  }

  /** @param {boolean} quiet @param {number} seconds @returns {State} */
  state(quiet, seconds) {
    const {name, alarm, message, doubt, overrides, limits, switches, feed, spindle, coolant, position, offset, heaters, outputs} = this;
    const full = this.setting(30) || 1000;
    return {
      name, alarm, message, doubt, quiet, heaters, outputs, overrides, limits, switches, seconds, feed, spindle, coolant, position, offset,
      power: Math.min(this.speed / full, 1), lines: 0, running: 0, moves: 0, done: 0, queued: NaN,
    };
  }
}

/** How long lines dwell, ms. @param {string[]} lines */
export function dwells(lines) {
  const of = (/** @type {string} */ line) => Number(line.match(/G0*4(?![.\d])[^;(]*?P\s*([\d.]+)/i)?.[1] ?? 0);
  return 1000 * lines.reduce((sum, line) => sum + of(line), 0);
}
