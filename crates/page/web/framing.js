// @ts-check
// Frame: the tool goes round the box of the job, its beam off or at a low power.

import {by, lead, say} from "dom";
import {mmIn, place, sides} from "units";

/** @typedef {import("scene").Box} Box */

/** The highest power of a beam that frames, percent. */
const MOST = 10;

/**
 * Lines that lead the tool round a box, machine coordinates. Without a beam they are jogs, which change nothing else; soft limits
 * refuse those that lead outside.
 * @param {Box} box
 * @param {{feed: number, power: number, height: number | null, spindle: boolean}} how `power`: as S, 0 for none; `height`: Z to which
 * the tool rises first, machine coordinates; `spindle`: whether it is on
 * @returns {string[]}
 */
export function linesAround({low, high}, {feed, power, height, spindle}) {
  const at = (/** @type {number} */ x, /** @type {number} */ y) => `X${x.toFixed(4)}Y${y.toFixed(4)}`;
  const corners = [at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1]), at(low[0], low[1])];
  const jog = (/** @type {string} */ place) => `$J=G53G90G21${place}F${feed}`;
  const begin = [...(spindle ? ["M5"] : []), ...(height === null ? [] : [jog(`Z${height.toFixed(4)}`)]), jog(corners[0])];
  if (power === 0) return [...begin, ...corners.slice(1).map(jog)];
  // M4 is dark where the tool stands, and never brighter than S.
  return [...begin, "G21G90", `M4S${power}`, ...corners.slice(1).map((place) => `G53G1${place}F${feed}`), "M5S0", "G0"];
}

/**
 * @typedef {object} Machine
 * @property {() => Box | null} box of the job, machine coordinates; `null` if there is none
 * @property {() => {z: number, full: number, laser: boolean, spindle: boolean, offset: number}} now height of the tool, S of full power, and Z of work zero
 * @property {(lines: string[]) => void} go
 */

/** @param {Machine} machine */
export function listenForFraming(machine) {
  const dialog = /** @type {HTMLDialogElement} */ (by("framing"));
  const input = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (by(id));
  const heightOf = (/** @type {Box} */ box, /** @type {number} */ z) => (z < box.high[2] - 1e-4 ? box.high[2] : null);
  by("frame").addEventListener("click", () => {
    const box = machine.box();
    if (!box) return;
    const {z, laser, offset} = machine.now();
    const height = heightOf(box, z);
    const size = sides([0, 1].map((axis) => box.high[axis] - box.low[axis]));
    say(by("framing-text"), `The tool goes round the job, ${size}, at Z ${place((height ?? z) - offset)}${height === null ? ", where it is" : ", to which it rises first"}.`);
    by("framing-beam").hidden = !laser;
    lead(dialog, by("frame"));
  });
  by("framing-go").addEventListener("click", () => {
    const box = machine.box();
    dialog.close();
    if (!box) return;
    const {z, full, laser, spindle} = machine.now();
    const percent = laser ? Math.min(Math.max(Number(input("framing-power").value) || 0, 0), MOST) : 0;
    const feed = Math.max(Math.round(mmIn("framing-feed")) || 1000, 1);
    machine.go(linesAround(box, {feed, power: Math.floor((full * percent) / 100), height: heightOf(box, z), spindle}));
  });
}
