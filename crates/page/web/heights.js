// @ts-check
// The height map: the probe touches the plate at the places of a grid over the job. The map is drawn, and the job is bent by it.

import {by, download, lead, make, say} from "dom";
import {contactOf} from "grbl";
import {mmIn, place, putMm, told} from "units";

/** @typedef {import("scene").Box} Box */
/** A grid of heights, machine coordinates, mm; row by row. @typedef {{columns: number[], rows: number[], heights: number[]}} HeightMap */

/** The most places of a grid. */
const MOST = 900;
/** The least side of a grid, mm: it takes two columns and two rows. */
const LEAST = 1;
/** How near places may be to each other, mm. */
const CLOSEST = 0.5;
/** How far a piece of the bent job may be from the map, mm. */
const TOLERANCE = 0.005;

/**
 * Places at most `spacing` apart that cover a side of a box.
 * @param {number} low @param {number} high @param {number} spacing
 */
function along(low, high, spacing) {
  const more = Math.max(LEAST - (high - low), 0) / 2;
  const [from, to] = [low - more, high + more];
  const count = Math.max(Math.ceil((to - from) / spacing - 1e-6), 1);
  return Array.from({length: count + 1}, (_, at) => from + ((to - from) * at) / count);
}

/** A grid over a box. @param {Box} box @param {number} spacing mm @returns {HeightMap} */
export function gridOver({low, high}, spacing) {
  return {columns: along(low[0], high[0], spacing), rows: along(low[1], high[1], spacing), heights: []};
}

/** The places of a grid in the order in which they are touched: there and back. @param {HeightMap} grid */
function places({columns, rows}) {
  return rows.flatMap((y, row) => columns.map((_, at) => {
    const column = row % 2 ? columns.length - 1 - at : at;
    return {x: columns[column], y, index: row * columns.length + column};
  }));
}

/**
 * Lines that touch the plate at each place.
 * @param {HeightMap} grid
 * @param {{travel: number, bottom: number, feed: number, offset: number, spindle: boolean}} how `travel` and `bottom`: Z from work zero, mm; `offset`: of work zero
 */
export function linesOver(grid, {travel, bottom, feed, offset, spindle}) {
  const up = `G53G0Z${(travel + offset).toFixed(3)}`;
  const touch = `G38.2Z${bottom.toFixed(3)}F${feed}`;
  return [...(spindle ? ["M5"] : []), up, ...places(grid).flatMap(({x, y}) => [`G53G0X${x.toFixed(3)}Y${y.toFixed(3)}`, touch, up])];
}

/** A map as `leadscrew level` reads it: work coordinates. @param {HeightMap} map @param {number[]} zero */
export function csvOf({columns, rows, heights}, zero) {
  const number = (/** @type {number} */ value) => String(Math.round(value * 1e4) / 1e4);
  return "x,y,z\n" + rows.flatMap((y, row) => columns.map((x, column) =>
    `${[x, y, heights[row * columns.length + column]].map((value, axis) => number(value - zero[axis])).join(",")}\n`)).join("");
}

/** Reads a map that was saved; `null` if its places are no grid. @param {string} text @param {number[]} zero @returns {HeightMap | null} */
export function mapOf(text, zero) {
  const all = text.split("\n").map((line) => line.split(/[,;\s]+/).filter(Boolean).map(Number)).filter((one) => one.length >= 3 && !one.some(Number.isNaN));
  const sides = [0, 1].map((axis) => [...new Set(all.map((one) => one[axis]))].sort((a, b) => a - b));
  const heights = sides[1].flatMap((y) => sides[0].map((x) => all.find((one) => one[0] === x && one[1] === y)?.[2] ?? NaN));
  if (sides.some((side) => side.length < 2) || heights.some(Number.isNaN)) return null;
  const [columns, rows] = sides.map((side, axis) => side.map((value) => value + zero[axis]));
  return {columns, rows, heights: heights.map((height) => height + zero[2])};
}

/**
 * @typedef {object} Machine
 * @property {() => Box | null} box of the job, machine coordinates; `null` if there is none
 * @property {() => {position: number[], offset: number[], spindle: boolean, unit: import("state").Unit}} now `unit`: of its reports
 * @property {(lines: string[], ended: (isWhole: boolean) => void) => void} go
 * @property {() => boolean} isFree
 * @property {(level: {heights: string, tolerance: number}) => void} bend
 * @property {() => void} changed the map is another one
 */

export class Heights {
  #dialog = /** @type {HTMLDialogElement} */ (by("heights"));
  /** @type {HeightMap | null} */
  map = null;
  /** What is being probed, and how many places have been touched. @type {{grid: HeightMap, touched: number} | null} */
  #probing = null;

  /** @param {Machine} machine */
  constructor(machine) {
    this.machine = machine;
    by("level").addEventListener("click", () => this.#open());
    for (const id of ["spacing", "travel", "bottom", "feed"]) this.#input(id).addEventListener("input", () => this.#plan());
    by("heights-probe").addEventListener("click", () => this.#probe());
    by("heights-bend").addEventListener("click", () => {
      if (this.map) this.machine.bend({heights: csvOf(this.map, this.machine.now().offset), tolerance: TOLERANCE});
    });
    by("heights-save").addEventListener("click", () => this.map && download("heights.csv", csvOf(this.map, this.machine.now().offset)));
    const file = /** @type {HTMLInputElement} */ (by("heights-file"));
    file.addEventListener("change", async () => {
      const text = await file.files?.[0]?.text();
      file.value = "";
      if (text === undefined) return;
      const map = mapOf(text, this.machine.now().offset);
      if (!map) return say(by("heights-map"), "The places of this file are no grid: a line for each, X,Y,Z.");
      this.#keep(map);
    });
  }

  /** @param {string} id */
  #input(id) {
    return /** @type {HTMLInputElement} */ (by(`heights-${id}`));
  }

  #open() {
    const {position, offset} = this.machine.now();
    const box = this.machine.box();
    if (Number.isNaN(mmIn("heights-travel")) && box) putMm("heights-travel", Math.max(position[2], box.high[2]) - offset[2]);
    this.#tell();
    lead(this.#dialog, by("level"));
    this.#plan();
  }

  /** What will be probed; `null` if it cannot be. */
  #planned() {
    const box = this.machine.box();
    const [spacing, travel, bottom, feed] = ["spacing", "travel", "bottom", "feed"].map((id) => mmIn(`heights-${id}`));
    if (!box || !(spacing >= CLOSEST - 1e-6) || !(travel > bottom) || !(feed > 0)) return null;
    const grid = gridOver(box, spacing);
    const {offset, spindle} = this.machine.now();
    return {grid, lines: linesOver(grid, {travel, bottom, feed, offset: offset[2], spindle})};
  }

  #plan() {
    const plan = this.#planned();
    const [x, y] = plan ? [plan.grid.columns.length, plan.grid.rows.length] : [0, 0];
    const isTooMany = x * y > MOST;
    const words = !this.machine.box() ? "The job has no extent." : !plan ? `The tool travels higher than it probes, and places are ${told(CLOSEST)} apart or more.`
      : `${x} × ${y} = ${x * y} places${isTooMany ? `; ${MOST} at most` : ". These lines go out, one after the other:"}`;
    say(by("heights-facts"), words);
    by("heights-lines").replaceChildren(...(plan && !isTooMany ? plan.lines : []).map((text) => make("li", {text})));
    this.follow();
  }

  #probe() {
    const plan = this.#planned();
    if (!plan) return;
    this.#dialog.close();
    this.#probing = {grid: plan.grid, touched: 0};
    this.machine.go(plan.lines, (isWhole) => {
      const grid = this.#probing?.grid;
      this.#probing = null;
      if (isWhole && grid && Object.keys(grid.heights).length === grid.columns.length * grid.rows.length) this.#keep(grid);
      this.#open();
      if (!isWhole) say(by("heights-map"), "The probing has ended early: see the console.");
    });
  }

  /** The machine may have become free. */
  follow() {
    if (this.#dialog.open) /** @type {HTMLButtonElement} */ (by("heights-probe")).disabled = !this.machine.isFree() || by("heights-lines").childElementCount === 0;
  }

  /** Hears a line of the machine's. @param {string} line */
  hear(line) {
    if (!this.#probing) return;
    const touched = contactOf(line, this.machine.now().unit.mm);
    if (!touched) return;
    const {grid} = this.#probing;
    const at = places(grid)[this.#probing.touched++];
    if (at) grid.heights[at.index] = touched[2];
  }

  /** @param {HeightMap} map */
  #keep(map) {
    this.map = map;
    this.#tell();
    this.machine.changed();
  }

  /** What the map is. */
  #tell() {
    const {map} = this;
    const zero = this.machine.now().offset[2];
    say(by("heights-map"), map ? `The map has ${map.columns.length} × ${map.rows.length} places, Z ${place(Math.min(...map.heights) - zero)} to ${place(Math.max(...map.heights) - zero)}.` : "");
    for (const id of ["heights-bend", "heights-save"]) /** @type {HTMLButtonElement} */ (by(id)).disabled = !map;
  }

  /** The job is bent, or why it is not. @param {string | undefined} refused */
  bent(refused) {
    if (refused) return say(by("heights-map"), `The job cannot be bent: ${refused}.`);
    this.#dialog.close();
  }
}
