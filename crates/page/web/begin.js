// @ts-check
// Start from a line: the way there is made by the code of `leadscrew resume`, and shown before anything moves.

import {by, lead, make, say} from "dom";
import {allIn, mmIn} from "units";

/** @typedef {import("machines").Resume} Resume */
/** @typedef {import("scene").Path} Path */

/** Moves that a board has planned ahead, and a few more. */
const AHEAD = 64;
/** How near to its line a tool stands, mm. */
const NEAR = 0.1;

/**
 * The line of the job at which a tool stands; of several the first: what it does twice is no harm.
 * @param {Path} path
 * @param {number[]} place in coordinates of the path
 * @param {number} reached the line that was reached, if the board ran all that it has taken
 */
export function lineAt(path, place, reached) {
  let best = {line: reached, distance: NEAR};
  let from = null;
  for (let index = path.first; index < path.first + path.count; index++) {
    const to = path.at(index);
    if (!to) continue;
    if (from && to.line <= reached && to.line > reached - AHEAD) {
      const distance = distanceTo([from.x, from.y, from.z], [to.x, to.y, to.z], place);
      if (distance < best.distance - 1e-6) best = {line: to.line, distance};
    }
    from = to;
  }
  return best.line;
}

/** @param {number[]} a @param {number[]} b @param {number[]} place */
function distanceTo(a, b, place) {
  const way = b.map((value, axis) => value - a[axis]);
  const length = way.reduce((sum, value) => sum + value * value, 0);
  const along = length === 0 ? 0 : way.reduce((sum, value, axis) => sum + value * (place[axis] - a[axis]), 0) / length;
  const share = Math.min(Math.max(along, 0), 1);
  return Math.hypot(...way.map((value, axis) => a[axis] + share * value - place[axis]));
}

/**
 * @typedef {object} Machine
 * @property {() => {lines: number, line: number}} job how long it is, and where it stands
 * @property {(resume: Resume) => void} ask
 * @property {(line: number, preamble: string[]) => void} go
 */

export class Beginning {
  #dialog = /** @type {HTMLDialogElement} */ (by("begin"));
  /** @type {Resume | null} */
  #asked = null;
  /** @type {string[] | null} */
  #preamble = null;
  #timer = 0;

  /** @param {Machine} machine */
  constructor(machine) {
    this.machine = machine;
    by("from").addEventListener("click", () => {
      const {lines, line} = machine.job();
      const input = this.#input("begin-line");
      input.max = String(lines);
      input.value = String(line);
      lead(this.#dialog, by("from"));
      this.#ask();
    });
    for (const id of ["begin-line", "begin-clearance", "begin-spin", "begin-start"]) {
      by(id).addEventListener("input", () => {
        this.#show(null, "…");
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.#ask(), 200);
      });
    }
    by("begin-run").addEventListener("click", () => {
      const [asked, preamble] = [this.#asked, this.#preamble];
      this.#dialog.close();
      if (asked && preamble) machine.go(asked.line, preamble);
    });
  }

  /** @param {string} id */
  #input(id) {
    return /** @type {HTMLInputElement} */ (by(id));
  }

  #ask() {
    const line = Math.trunc(Number(this.#input("begin-line").value));
    const {lines} = this.machine.job();
    if (!(line >= 1 && line <= lines)) return this.#show(null, `The job has ${lines} lines.`);
    const start = allIn("begin-start");
    if (start.length && (start.length !== 3 || start.some(Number.isNaN))) return this.#show(null, "Where the job began are three numbers: X, Y and Z.");
    const clearance = mmIn("begin-clearance");
    this.#asked = {line, clearance: Number.isNaN(clearance) ? null : clearance, spin_up: Number(this.#input("begin-spin").value) || 0, start: start.length ? start : null};
    this.machine.ask(this.#asked);
  }

  /** Takes what was found. @param {{resume: Resume, preamble?: string[], refused?: string}} found */
  take({resume, preamble, refused}) {
    const asked = this.#asked;
    // It is the answer to an earlier question.
    if (!asked || resume.line !== asked.line || resume.clearance !== asked.clearance || resume.spin_up !== asked.spin_up || String(resume.start ?? "") !== String(asked.start ?? "")) return;
    if (preamble) this.#show(preamble, `Before line ${asked.line} of the job these lines go out:`);
    else this.#show(null, `It cannot be begun there: ${refused}.`);
  }

  /** @param {string[] | null} preamble @param {string} words */
  #show(preamble, words) {
    this.#preamble = preamble;
    say(by("begin-facts"), words);
    by("begin-lines").replaceChildren(...(preamble ?? []).map((text) => make("li", {text})));
    this.#input("begin-run").disabled = preamble === null;
  }
}
