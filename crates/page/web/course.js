// @ts-check
// Where the tool of a finished job is at each time: the course of the speed, and the lengths of the moves.

/** Numbers of a stretch: its time in s, its length in mm, the speed that it begins with in mm/s. Speed changes evenly in it. */
const STRETCH = 3;

/**
 * Where the job is.
 * @typedef {object} Place
 * @property {number} move the number of the move under way
 * @property {number} share of it that lies behind
 * @property {number} speed mm/s
 */

export class Course {
  /**
   * @param {Float32Array} stretches
   * @param {Float32Array} lengths of the moves, mm; the first has none, it is where the path begins
   */
  constructor(stretches, lengths) {
    this.stretches = stretches;
    this.count = Math.floor(stretches.length / STRETCH);
    /** When each stretch begins, s, and how far the tool has come then, mm; one more for the end. */
    this.begins = new Float64Array(this.count + 1);
    this.ways = new Float64Array(this.count + 1);
    for (let at = 0; at < this.count; at++) {
      this.begins[at + 1] = this.begins[at] + stretches[STRETCH * at];
      this.ways[at + 1] = this.ways[at] + stretches[STRETCH * at + 1];
    }
    /** How far the tool has come at the end of each move, mm. */
    this.ends = new Float64Array(lengths.length);
    for (let at = 1; at < lengths.length; at++) this.ends[at] = this.ends[at - 1] + lengths[at];
  }

  get seconds() {
    return this.begins[this.count];
  }

  /**
   * @param {number} seconds
   * @returns {Place}
   */
  at(seconds) {
    const stretch = Math.min(after(this.begins, seconds), this.count) - 1;
    if (stretch < 0) return {move: 0, share: 0, speed: 0};
    const [whole, length, first] = this.stretches.subarray(STRETCH * stretch, STRETCH * (stretch + 1));
    const time = Math.min(Math.max(seconds - this.begins[stretch], 0), whole);
    const gain = whole > 0 ? (2 * (length - first * whole)) / (whole * whole) : 0;
    const way = this.ways[stretch] + first * time + (gain * time * time) / 2;
    const move = Math.min(after(this.ends, way), this.ends.length - 1);
    const begun = this.ends[move - 1] ?? 0;
    const of = this.ends[move] - begun;
    return {move, share: of > 0 ? Math.min((way - begun) / of, 1) : 1, speed: Math.max(first + gain * time, 0)};
  }
}

/**
 * How many values of an ascending list are not above `value`.
 * @param {Float64Array} list
 * @param {number} value
 */
function after(list, value) {
  let [low, high] = [0, list.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
}
