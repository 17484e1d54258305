// @ts-check
// Corner and hole: the probe touches the sides, and zero of work is set there, at the end and all at once.

import {by, lead, make, say} from "dom";
import {contactOf} from "grbl";
import {mmIn, place, told} from "units";

/** A line that is made when its turn comes; `null` ends the way. `shown`: as it is shown before; `words`: what it does. @typedef {{make: () => string | null, shown: string, words: string}} Move */
/**
 * @typedef {object} How
 * @property {"outside" | "inside" | "hole"} kind
 * @property {number[]} into for X and Y, 1 or -1: the way from the outside of the corner to its inside
 * @property {number} tip its diameter, mm
 * @property {number} over thickness of a plate on the work, mm
 * @property {number} beside thickness of a plate at its sides, mm
 * @property {number} aside how far the tool goes aside, mm
 * @property {number} depth how far below the top the sides are touched, mm
 * @property {number} feed mm/min
 * @property {number[]} from where it begins, machine coordinates, mm
 */
/** Where the probe has touched, machine coordinates; `null` where it has not. @typedef {(number[] | null)[]} Touched */

/** How far above the top the tool goes, mm. */
const OFF = 3;
const AXES = "XY";

const fixed = (/** @type {number} */ mm) => String(Number(mm.toFixed(4)) + 0);
/** @param {string} text @param {string} words @returns {Move} */
const line = (text, words) => ({make: () => text, shown: text, words});
/** @param {string} text @param {() => number} mm @param {string} what the length is called @param {string} words @returns {Move} */
const later = (text, mm, what, words) => ({make: () => `${text}${fixed(mm())}`, shown: `${text}[${what}]`, words});

/** The wall that was touched on the way `sign`, at the tip's rim. @param {How} how @param {Touched} touched @param {number} number @param {number} axis @param {number} sign */
function wall({tip, beside}, touched, number, axis, sign) {
  return (touched[number]?.[axis] ?? NaN) + sign * (tip / 2 + beside);
}

/**
 * From above: the top, then each side from outside, then zero over the corner.
 * @param {How} how @param {Touched} touched @param {(why: string) => void} stop
 * @returns {Move[]}
 */
function outside(how, touched, stop) {
  const {into, over, aside, depth, feed, from} = how;
  const top = () => touched[0]?.[2] ?? NaN;
  const up = later("G53G0Z", () => top() + OFF, `top + ${OFF}`, "up");
  const edge = (/** @type {number} */ axis) => wall(how, touched, 2 + 2 * axis, axis, into[axis]);
  const side = (/** @type {number} */ axis) => {
    const to = (/** @type {number} */ mm, /** @type {string} */ words) => line(`G53G0${AXES[axis]}${fixed(mm)}`, words);
    const out = from[axis] - into[axis] * aside;
    const touch = `G38.2${AXES[axis]}${fixed(into[axis] * aside)}F${fixed(feed)}`;
    const isClear = () => touched[1 + 2 * axis] === null;
    const orUp = () => {
      if (isClear()) return touch;
      stop(`beside the work the tool met something on its way down: go farther aside than ${told(aside)}`);
      return up.make();
    };
    const back = to(out, "back");
    return [
      to(out, "aside, beyond the work"), line(`G38.3Z${fixed(-OFF - depth)}F${fixed(feed)}`, "down beside it; up again, and no more, if it touches"),
      {make: orUp, shown: touch, words: "to the side, until it touches"}, {...back, make: () => (isClear() ? back.make() : null)}, up, to(from[axis], "over the work"),
    ];
  };
  const corner = {make: () => `G53G0X${fixed(edge(0))}Y${fixed(edge(1))}`, shown: "G53G0X[side]Y[side]", words: "over the corner"};
  return [
    line(`G38.2Z${fixed(-aside)}F${fixed(feed)}`, "down to the top, until it touches"), up, ...side(0), ...side(1), corner,
    line(`G10L20P0X0Y0Z${fixed(over + OFF)}`, "zero"),
  ];
}

/** From inside, at the depth at which it stands: two walls. @param {How} how @param {Touched} touched @returns {Move[]} */
function inside(how, touched) {
  const {into, aside, feed, from} = how;
  const touch = (/** @type {number} */ axis) => [
    line(`G38.2${AXES[axis]}${fixed(-into[axis] * aside)}F${fixed(feed)}`, "to the wall, until it touches"), line(`G53G0${AXES[axis]}${fixed(from[axis])}`, "back")];
  const zero = () => `G10L20P0${[0, 1].map((axis) => `${AXES[axis]}${fixed(from[axis] - wall(how, touched, axis, axis, -into[axis]))}`).join("")}`;
  return [...touch(0), ...touch(1), {make: zero, shown: "G10L20P0X[from the wall]Y[from the wall]", words: "zero"}];
}

/** From inside a hole: two walls in X, then two in Y through the middle. @param {How} how @param {Touched} touched @returns {Move[]} */
function hole({aside, feed, from}, touched) {
  const both = (/** @type {number} */ axis) => {
    const letter = AXES[axis];
    const touch = (/** @type {number} */ sign) => line(`G38.2${letter}${fixed(sign * aside)}F${fixed(feed)}`, "to the wall, until it touches");
    const middle = () => ((touched[2 * axis]?.[axis] ?? NaN) + (touched[2 * axis + 1]?.[axis] ?? NaN)) / 2;
    return [touch(-1), line(`G53G0${letter}${fixed(from[axis])}`, "back"), touch(1), later(`G53G0${letter}`, middle, "middle", "to the middle")];
  };
  return [...both(0), ...both(1), line("G10L20P0X0Y0", "zero")];
}

const WAYS = {outside, inside, hole};

/** The whole way. @param {How} how @param {Touched} touched filled while it is gone @param {(why: string) => void} stop */
export function way(how, touched, stop) {
  return [line("G91", "distances count from where it is"), ...WAYS[how.kind](how, touched, stop)];
}

/** What was found, in words. @param {How} how @param {Touched} touched */
function found(how, touched) {
  const at = (/** @type {number[]} */ places) => places.map((mm, axis) => `${"XYZ"[axis]} ${place(mm)}`).join(", ");
  if (how.kind === "hole") {
    const [low, high] = [2, 3].map((number) => touched[number]?.[1] ?? NaN);
    const middle = [0, 1].map((axis) => ((touched[2 * axis]?.[axis] ?? NaN) + (touched[2 * axis + 1]?.[axis] ?? NaN)) / 2);
    return `Zero is in the middle of the hole, which is ${told(high - low + how.tip)} wide: machine ${at(middle)}.`;
  }
  const numbers = how.kind === "outside" ? [2, 4] : [0, 1];
  const sign = how.kind === "outside" ? 1 : -1;
  const sides = numbers.map((number, axis) => wall(how, touched, number, axis, sign * how.into[axis]));
  const top = how.kind === "outside" ? [(touched[0]?.[2] ?? NaN) - how.over] : [];
  return `Zero is at the corner: machine ${at([...sides, ...top])}.`;
}

/** Why it ended, by the alarm. @type {Record<string, string>} */
const ALARMS = {
  "ALARM:4": "the probe was closed before it moved. Is its clip on the tool, does the tool touch already?",
  "ALARM:5": "the probe touched nothing. Put the tool nearer, or let it go farther",
};

/**
 * @typedef {object} Machine
 * @property {() => {position: number[], spindle: boolean, unit: import("state").Unit}} now `unit`: of its reports
 * @property {() => boolean} isFree
 * @property {(steps: import("perform").Step[], ended: (isWhole: boolean) => void) => void} go
 */

export class Corner {
  #dialog = /** @type {HTMLDialogElement} */ (by("corner"));
  /** @type {Touched | null} */
  #touched = null;
  #why = "";

  /** @param {Machine} machine */
  constructor(machine) {
    this.machine = machine;
    by("corner-open").addEventListener("click", () => this.#open(""));
    for (const one of this.#dialog.querySelectorAll("input, select")) one.addEventListener("input", () => this.#plan());
    by("corner-probe").addEventListener("click", () => this.#probe());
  }

  /** @param {string} words */
  #open(words) {
    say(by("corner-found"), words);
    lead(this.#dialog, by("corner-open"));
    this.#plan();
  }

  /** @returns {How} */
  #how() {
    const chosen = (/** @type {string} */ id) => /** @type {HTMLSelectElement} */ (by(id)).value;
    const [tip, over, beside, aside, depth, feed] = ["tip", "over", "beside", "aside", "depth", "feed"].map((id) => mmIn(`corner-${id}`));
    const kind = /** @type {How["kind"]} */ (chosen("corner-kind"));
    return {kind, into: chosen("corner-which").split(" ").map(Number), tip, over, beside, aside, depth, feed, from: this.machine.now().position};
  }

  /** What is wrong with what was filled in; empty if nothing is. @param {How} how */
  #wrong({kind, tip, over, beside, aside, depth, feed}) {
    if (!(tip >= 0)) return "The tip has a diameter.";
    if (!(aside > 0 && feed > 0)) return "The tool goes some way, at some feed.";
    if (kind === "outside" && !(aside > tip / 2 + OFF)) return `The tool goes farther aside than ${told(tip / 2 + OFF)}.`;
    if (kind !== "hole" && !(beside >= 0)) return "A plate at the sides has a thickness, or 0.";
    if (kind === "outside" && !(depth > 0 && over >= 0)) return "The sides are touched below the top; a plate on the work has a thickness, or 0.";
    return "";
  }

  /** @param {How} how */
  #begin({kind, tip, beside, aside}) {
    if (kind === "hole") return `Put the tool into the hole, below its rim, less than ${told(aside)} from its walls.`;
    if (kind === "inside") return `Put the tool into the pocket, below its rim, less than ${told(aside)} from both walls.`;
    return `Put the tool over the work, in X and in Y less than ${told(aside - tip / 2 - beside)} from the corner, and less than ${told(aside)} above it.`;
  }

  #plan() {
    const how = this.#how();
    for (const [id, is] of /** @type {[string, boolean][]} */ ([["which", how.kind !== "hole"], ["over", how.kind === "outside"], ["beside", how.kind !== "hole"], ["depth", how.kind === "outside"]])) by(`corner-${id}-label`).hidden = !is;
    const wrong = this.#wrong(how);
    say(by("corner-facts"), wrong || `${this.#begin(how)} These lines go out, one after the other; zero changes with the last one:`);
    by("corner-lines").replaceChildren(...(wrong ? [] : way(how, [], () => {})).map(({shown, words}) => make("li", {}, [`${shown} `, make("small", {text: words})])));
    this.follow();
  }

  #probe() {
    const how = this.#how();
    if (this.#wrong(how)) return;
    /** @type {Touched} */
    const touched = [];
    [this.#touched, this.#why] = [touched, "see the console"];
    this.#dialog.close();
    const stop = [...(this.machine.now().spindle ? ["M5"] : [])];
    const steps = way(how, touched, (why) => (this.#why = why)).map(({make}) => make);
    this.machine.go([...stop, ...steps], (isWhole) => {
      this.#touched = null;
      this.#open(isWhole ? found(how, touched) : `Nothing is set, zero is where it was: ${this.#why}.`);
    });
  }

  /** The machine may have become free. */
  follow() {
    if (this.#dialog.open) /** @type {HTMLButtonElement} */ (by("corner-probe")).disabled = !this.machine.isFree() || by("corner-lines").childElementCount === 0;
  }

  /** Hears a line of the machine's. @param {string} line */
  hear(line) {
    if (!this.#touched) return;
    if (line.startsWith("ALARM:")) this.#why = ALARMS[line] ?? line;
    if (line.startsWith("[PRB:")) this.#touched.push(contactOf(line, this.machine.now().unit.mm));
  }
}
