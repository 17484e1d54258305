// @ts-check
// The legend of a path: the same for a job on the machine and for one that is played.

import {DEPTH, INK, PLATE, css, ramp} from "colours";
import {make} from "dom";

/** @typedef {import("scene").Path} Path */

/** The colours of the theme. */
export function inkNow() {
  return INK[document.documentElement.dataset.theme === "dark" ? "dark" : "light"];
}

/**
 * @param {string} background
 * @param {string} name
 */
export function mark(background, name, cls = "") {
  return make("span", {}, [make("i", {class: cls, style: `background:${background}`}), name]);
}

/** @typedef {import("state").Unit} Unit */
/** @type {Unit} */
const MM = {mm: 1, name: "mm", digits: 3};

/** A height with a digit less than a step takes. @param {number} z @param {Unit} unit */
const height = (z, {mm, digits}) => String(Number((z / mm).toFixed(digits - 1)) + 0);

/**
 * The marks of a path's colours and tools.
 * @param {Path} path
 * @param {boolean} isLaser
 * @param {string} work what the tool does: `cut` or `extruded`
 * @param {Unit} [unit]
 */
export function marksOf(path, isLaser, work, unit = MM) {
  const ink = inkNow();
  const isFlat = path.depth && path.depth[0] >= path.depth[1];
  const [inks, shape] = isFlat ? [css(DEPTH[DEPTH.length - 1]), ""] : [ramp(DEPTH), "ramp"];
  const cut = isLaser ? mark(ramp([ink.powerOff, ink.powerFull]), "laser: off to full power", "ramp") : mark(inks, `${work}: ${heights(path, unit)}`, shape);
  const tools = isLaser ? [] : [...path.tools].sort((a, b) => b - a);
  return [cut, ...tools.map((mm) => make("span", {text: `tool ${mm} mm`})), mark(css(ink.travel), "travel")];
}

/** The mark of a height map, from work zero. @param {import("heights").HeightMap | null} map @param {number} zero @param {Unit} unit */
export function markOfMap(map, zero, unit) {
  if (!map) return [];
  const [low, high] = [Math.min(...map.heights), Math.max(...map.heights)].map((z) => height(z - zero, unit));
  return [mark(ramp(PLATE), `plate: Z ${low} to Z ${high}`, "ramp")];
}

/** The heights of the cuts. @param {Path} path @param {Unit} unit */
function heights({depth}, unit) {
  const words = (/** @type {number} */ z) => height(z, unit);
  if (!depth) return "shallow to deep";
  return depth[0] < depth[1] ? `Z ${words(depth[1])} to Z ${words(depth[0])}` : `Z ${words(depth[0])}`;
}
