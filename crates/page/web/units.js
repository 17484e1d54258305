// @ts-check
// Lengths that a person types: in the machine's unit, which its reports have too. What stands in a field goes along when the unit changes.

import {by} from "dom";

/** @typedef {import("state").Unit} Unit */

/** @type {Unit} */
let now = {mm: 1, name: "mm", digits: 3};
/** What the page has put into a field, and what it stands for, mm. @type {WeakMap<HTMLInputElement, {shown: string, mm: number[]}>} */
const put = new WeakMap();

/** Lengths in fields have the digits of a step; rates have fewer. @param {HTMLInputElement} field @param {number} value */
const rounded = (field, value) => Number(value.toFixed(field.dataset.length === "/min" ? (Math.abs(value) < 10 ? 2 : 0) : now.digits));

/** The lengths in a field, mm. @param {HTMLInputElement} field */
function lengthsOf(field) {
  const known = put.get(field);
  if (known?.shown === field.value) return known.mm;
  return field.value.split(/[,;\s]+/).filter(Boolean).map((one) => Number(one) * now.mm);
}

/** @param {HTMLInputElement} field @param {number[]} mm */
function show(field, mm) {
  if (mm.some(Number.isNaN)) return;
  field.value = mm.map((one) => rounded(field, one / now.mm)).join(", ");
  put.set(field, {shown: field.value, mm});
}

/** All the lengths in a field, mm; `NaN` for what is none. @param {string} id */
export function allIn(id) {
  return lengthsOf(by(id));
}

/** The length in a field, mm, or mm/min; `NaN` if there is none. @param {string} id */
export function mmIn(id) {
  return allIn(id)[0] ?? NaN;
}

/** Puts a length into a field. @param {string} id @param {number} mm */
export function putMm(id, mm) {
  show(by(id), [mm]);
}

/** A length in words. @param {number} mm */
export function told(mm) {
  return `${Number((mm / now.mm).toFixed(now.digits))} ${now.name}`;
}

/** The sides of something in words. @param {number[]} mm */
export function sides(mm) {
  return `${mm.map((one) => (one / now.mm).toFixed(now.digits - 1)).join(" × ")} ${now.name}`;
}

/** A place in words: all its digits. @param {number} mm */
export function place(mm) {
  return (mm / now.mm).toFixed(now.digits);
}

/** Takes another unit: for the fields marked `data-length`, and the words marked `data-unit`. @param {Unit} unit */
export function measure(unit) {
  if (unit.name === now.name) return;
  const before = now;
  for (const field of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll("input[data-length]"))) {
    const mm = lengthsOf(field);
    now = unit;
    if (mm.length) show(field, mm);
    for (const end of ["min", "max"]) {
      const value = field.getAttribute(end);
      if (value !== null) field.setAttribute(end, String(Number(((Number(value) * before.mm) / unit.mm).toPrecision(5))));
    }
    now = before;
  }
  now = unit;
  for (const words of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-unit]"))) words.textContent = `${unit.name}${words.dataset.unit}`;
}
