// @ts-check
// Files that are chosen or dropped: a job, or a machine.

import {by} from "dom";

/** The largest job that is taken: bytes, and lines. */
const LARGEST = 32e6;
const LONGEST = 1e6;

/**
 * @typedef {object} Takers
 * @property {() => boolean | void} isFree whether a file is taken now
 * @property {(file: Uint8Array) => void} machine
 * @property {(name: string, text: string) => void} job
 * @property {(words: string) => void} refused
 */

/** @param {Takers} takers */
export function listenForFiles(takers) {
  const file = /** @type {HTMLInputElement} */ (by("file"));
  file.addEventListener("change", () => file.files?.[0] && open(file.files[0], takers));
  let depth = 0;
  const over = (/** @type {number} */ change) => {
    depth = Math.max(depth + change, 0);
    by("drop").hidden = depth === 0;
  };
  document.addEventListener("dragenter", () => over(1));
  document.addEventListener("dragleave", () => over(-1));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    over(-depth);
    const file = event.dataTransfer?.files[0];
    if (file) open(file, takers);
  });
}

/** @param {File} file @param {Takers} takers */
async function open(file, takers) {
  if (!takers.isFree()) return;
  const refuse = (/** @type {string} */ size) => takers.refused(
    `${file.name} has ${size}. A page takes ${LARGEST / 1e6} MB and ${LONGEST / 1e6} million lines at most: check it with \`leadscrew check\`, and send it with a sender.`);
  if (file.size > LARGEST) return refuse(`${(file.size / 1e6).toFixed(0)} MB`);
  if (/\.toml$/i.test(file.name)) return takers.machine(new Uint8Array(await file.arrayBuffer()));
  const text = await file.text();
  const lines = countLines(text);
  if (lines > LONGEST) return refuse(`${lines} lines`);
  takers.job(file.name, text);
}

/** @param {string} text */
function countLines(text) {
  let count = 1;
  for (let at = text.indexOf("\n"); at >= 0; at = text.indexOf("\n", at + 1)) count++;
  return count;
}
