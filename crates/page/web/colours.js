// @ts-check
// The colours of paths. The pictures of `leadscrew run --svg` use the same.

/** From the top of the material down, equally spaced: each is told from white and from black. */
export const DEPTH = [[0.93, 0.64, 0.10], [0.88, 0.34, 0.18], [0.72, 0.22, 0.50], [0.42, 0.36, 0.80], [0.16, 0.52, 0.85]];

/** Of a plate, from its lowest place to its highest. */
export const PLATE = [[0.20, 0.42, 0.60], [0.55, 0.68, 0.62], [0.93, 0.90, 0.60]];

/** A colour of a list by a share from 0 to 1. @param {number[][]} colours @param {number} share */
export function between(colours, share) {
  const at = Math.min(Math.max(share, 0), 1) * (colours.length - 1);
  const low = Math.min(Math.floor(at), colours.length - 2);
  return colours[low].map((part, index) => part + (colours[low + 1][index] - part) * (at - low));
}

/**
 * @typedef {{travel: number[], powerOff: number[], powerFull: number[], ground: number[]}} Ink
 * @type {Record<string, Ink>}
 */
export const INK = {
  light: {travel: [0.62, 0.69, 0.76], powerOff: [0.78, 0.81, 0.85], powerFull: [0.08, 0.09, 0.11], ground: [0.98, 0.99, 0.99]},
  dark: {travel: [0.34, 0.40, 0.47], powerOff: [0.20, 0.23, 0.27], powerFull: [0.97, 0.96, 0.92], ground: [0.08, 0.10, 0.13]},
};

/** @param {number[]} colour */
export function css(colour) {
  return `rgb(${colour.map((part) => Math.round(part * 255)).join(" ")})`;
}

/** @param {number[][]} colours */
export function ramp(colours) {
  return `linear-gradient(to right, ${colours.map(css).join(", ")})`;
}
