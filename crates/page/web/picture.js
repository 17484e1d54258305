// @ts-check
// The picture of the machine and of the job, its legend and its buttons.

import {by, make} from "dom";
import {mark, markOfMap, marksOf} from "legend";
import {View} from "view";

/** @typedef {"top" | "3d" | "front"} Side */

/**
 * @typedef {object} Now
 * @property {import("state").State | null} state
 * @property {number[]} zero of the job, machine coordinates
 * @property {ReturnType<import("scrub").Scrub["place"]>} looked where the tool is at the time that is looked at
 * @property {import("heights").HeightMap | null} map
 * @property {boolean} hasRun whether the job has been run since it was opened: what it has not done yet is pale
 */

/**
 * @typedef {object} Shown
 * @property {import("job").Job} job
 * @property {import("scene").Path} trace
 * @property {import("state").Settings} settings
 * @property {() => Now} now
 * @property {() => void} clear the machine's trace
 */

export class Picture {
  view = new View(by("view"), () => this.#mark());
  #showsTravels = true;
  /** What it shows. */
  #last = "";

  /** @param {Shown} shown */
  constructor(shown) {
    this.shown = shown;
    /** @type {Record<string, () => void>} */
    const clicks = {
      "view-top": () => this.#look("top"), "view-3d": () => this.#look("3d"), "view-front": () => this.#look("front"),
      "view-fit": () => this.view.fit(), "view-machine": () => this.view.fitMachine(),
      "view-clear": () => {
        shown.trace.clear();
        shown.clear();
        this.show();
      },
      "view-travels": () => {
        this.#showsTravels = !this.#showsTravels;
        by("view-travels").setAttribute("aria-pressed", String(this.#showsTravels));
        this.show();
      },
    };
    for (const [id, act] of Object.entries(clicks)) by(id).addEventListener("click", act);
  }

  /** Draws where something has changed. */
  show() {
    const {job, trace, settings} = this.shown;
    const {state, zero, looked, map, hasRun} = this.shown.now();
    if (!state) return;
    const {done, position, offset, power, spindle, moves} = state;
    const now = JSON.stringify([looked, settings.unit, done, position, offset, zero, spindle && power, moves, trace.edition, job.path.edition, settings.travel, settings.isLaser, this.#showsTravels, hasRun, map, document.documentElement.dataset.theme]);
    if (now === this.#last) return;
    this.#last = now;
    const machine = {trace, done, position, power: spindle ? power : 0, running: hasRun};
    const then = looked && {trace: job.path, origin: zero, done: looked.done, position: looked.position.map((place, axis) => place + zero[axis]), power: 0, running: true};
    this.view.shown = {
      job: job.path, offset, zero, travel: settings.travel, softLimits: settings.hasSoftLimits, laser: settings.isLaser,
      travels: this.#showsTravels, map, unit: settings.unit, ...(then ?? machine),
    };
    this.view.touch();
  }

  drawLegend() {
    const {job, settings} = this.shown;
    const {state, map} = this.shown.now();
    const limits = settings.hasSoftLimits ? "soft limits" : "travel of the axes (soft limits off)";
    by("legend").replaceChildren(...marksOf(job.path, settings.isLaser, job.work, settings.unit), ...markOfMap(map, state?.offset[2] ?? 0, settings.unit), mark("var(--carriage)", "carriage"), mark("var(--box)", limits), make("span", {text: "pale: ahead"}));
  }

  /** @param {Side} side */
  #look(side) {
    this.view.look(side);
    this.view.fit();
    this.#mark(side);
  }

  /** @param {Side} [side] */
  #mark(side) {
    for (const one of ["top", "3d", "front"]) by(`view-${one}`).setAttribute("aria-pressed", String(one === (side ?? (this.view.camera.isFromAbove ? "top" : ""))));
  }
}
