// @ts-check
// The slider along the time of a job: where the tool will be, and at which line. Within a line it has the line's mean speed.

import {Course} from "course";
import {by, duration, say} from "dom";
import {JUMP} from "scene";

/** @typedef {import("scene").Path} Path */

/**
 * The course of a job: a stretch for each time that a line moves the machine, and one for each rest.
 * @param {Path} path
 * @param {[number, number][]} times lines in the order of time, with their seconds; line 0 at rest
 */
export function courseOf(path, times) {
  const lengths = new Float32Array(path.count);
  let index = 1;
  const stretches = times.flatMap(([line, seconds]) => {
    let way = 0;
    // Moves that were joined have the line of the last of them; a program comes to a line more than once.
    for (let before = 0; line > 0 && index < path.count; index++) {
      const [from, to] = [path.at(path.first + index - 1), path.at(path.first + index)];
      if (!from || !to || to.line > line || (before === line && to.line !== line)) break;
      before = to.line;
      lengths[index] = to.kind === JUMP ? 0 : Math.hypot(to.x - from.x, to.y - from.y, to.z - from.z);
      way += lengths[index];
    }
    return [seconds, way, way / seconds];
  });
  return new Course(Float32Array.from(stretches), lengths);
}

export class Scrub {
  #slider = /** @type {HTMLInputElement} */ (by("scrub"));
  /** @type {Course | null} */
  #course = null;
  /** @type {Path | null} */
  #path = null;
  /** The time that is looked at, s; `null`: the machine is. @type {number | null} */
  at = null;

  /** @param {() => void} changed */
  constructor(changed) {
    this.changed = changed;
    this.#slider.addEventListener("input", () => this.#look(Number(this.#slider.value) * (this.#course?.seconds ?? 0)));
    by("scrub-end").addEventListener("click", () => this.#look(null));
  }

  /** Takes a job that is timed; `null`: there is none. @param {Path | null} path @param {[number, number][]} [times] */
  load(path, times = []) {
    this.#path = path;
    this.#course = path && courseOf(path, times);
    this.#slider.value = "0";
    this.#look(null);
  }

  /** Shows the slider, or looks at the machine alone. @param {boolean} isThere */
  show(isThere) {
    by("scrub-row").hidden = !isThere || !this.#course?.seconds;
    if (!isThere && this.at !== null) this.#look(null);
  }

  /** @param {number | null} seconds */
  #look(seconds) {
    this.at = seconds;
    /** @type {HTMLButtonElement} */ (by("scrub-end")).disabled = seconds === null;
    const place = this.place();
    const all = duration(this.#course?.seconds ?? 0);
    const words = place ? `${duration(seconds ?? 0)} of ${all}, line ${place.line}` : all;
    say(by("scrub-now"), words);
    this.#slider.setAttribute("aria-valuetext", words);
    this.changed();
  }

  /** Where the tool is then, in coordinates of the path: the moves that have begun, the place, the line. */
  place() {
    if (this.at === null || !this.#course || !this.#path) return null;
    const {move, share} = this.#course.at(this.at);
    const isOver = this.at >= this.#course.seconds;
    const [from, to] = [move - 1, move].map((index) => this.#path?.at(this.#path.first + Math.max(index, 0)));
    if (!from || !to) return null;
    const part = isOver ? 1 : share;
    return {done: isOver ? this.#path.count : move, line: to.line, position: [from.x + (to.x - from.x) * part, from.y + (to.y - from.y) * part, from.z + (to.z - from.z) * part]};
  }
}
