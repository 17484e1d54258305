// @ts-check
// Where the picture is seen from: parallel rays, so that lengths can be compared.

/** @typedef {import("scene").Box} Box */

export class Camera {
  /** @type {[number, number, number]} */
  target = [0, 0, 0];
  /** Turn about Z, radians. */
  yaw = 0;
  /** Height above the horizon, radians: a quarter turn is from above. */
  pitch = Math.PI / 2;
  /** Pixels a millimetre. */
  scale = 2;
  width = 1;
  height = 1;

  /** @param {"top" | "3d" | "front"} name */
  look(name) {
    this.yaw = name === "3d" ? -0.6 : 0;
    this.pitch = name === "top" ? Math.PI / 2 : name === "front" ? 0 : 0.62;
  }

  /** Whether it looks straight down. */
  get isFromAbove() {
    return this.pitch > 1.55;
  }

  /**
   * The rows of the map from millimetres to pixels from the middle: right, up.
   * @returns {[number[], number[]]}
   */
  rows() {
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const [up, lean] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    const k = this.scale;
    return [[c * k, -s * k, 0], [s * lean * k, c * lean * k, up * k]];
  }

  /**
   * @param {number[]} point
   * @returns {[number, number]} pixels from the left and from the top
   */
  project(point) {
    const [right, up] = this.rows();
    const by = point.map((value, axis) => value - this.target[axis]);
    const dot = (/** @type {number[]} */ row) => row[0] * by[0] + row[1] * by[1] + row[2] * by[2];
    return [this.width / 2 + dot(right), this.height / 2 - dot(up)];
  }

  /**
   * Moves the picture by pixels.
   * @param {number} dx
   * @param {number} dy
   */
  pan(dx, dy) {
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const lean = Math.sin(this.pitch);
    const [right, up] = [-dx / this.scale, dy / this.scale];
    const flat = lean > 0.2 ? up / lean : 0;
    this.target[0] += c * right + s * flat;
    this.target[1] += -s * right + c * flat;
    if (lean <= 0.2) this.target[2] += up;
  }

  /**
   * @param {number} factor
   * @param {number} x
   * @param {number} y the place that stays, in pixels
   */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const before = this.scale;
    this.scale = Math.min(Math.max(before * factor, 0.01), 5000);
    const moved = this.scale / before - 1;
    this.pan(-(x - this.width / 2) * moved, -(y - this.height / 2) * moved);
  }

  /** @param {number} dx @param {number} dy */
  orbit(dx, dy) {
    this.yaw += dx * 0.008;
    this.pitch = Math.min(Math.max(this.pitch + dy * 0.008, 0), Math.PI / 2);
  }

  /**
   * Shows all of a box.
   * @param {Box} box
   */
  fit(box) {
    const middle = (/** @type {number} */ axis) => (box.low[axis] + box.high[axis]) / 2;
    this.target = [middle(0), middle(1), middle(2)];
    this.scale = 1;
    const corners = cornersOf(box).map((corner) => this.project(corner));
    const span = (/** @type {0 | 1} */ i) => {
      const all = corners.map((corner) => corner[i]);
      return Math.max(...all) - Math.min(...all);
    };
    const room = [this.width - 70, this.height - 60].map((size) => Math.max(size, 40));
    this.scale = Math.min(room[0] / Math.max(span(0), 0.5), room[1] / Math.max(span(1), 0.5), 400);
  }
}

/** @param {Box} box */
export function cornersOf(box) {
  const ends = [box.low, box.high];
  return Array.from({length: 8}, (_, n) => [ends[n & 1][0], ends[(n >> 1) & 1][1], ends[(n >> 2) & 1][2]]);
}
