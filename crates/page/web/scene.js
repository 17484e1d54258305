// @ts-check
// The path of a job or of the machine: 20 bytes a move, as the server sends them and as the graphics card takes them.
//
//   0   4   8   12    16    17     18
//   x   y   z   line  kind  power  tool    f32 mm, u32, u8 (0 travel, 1 cut, 2 jump), u8 (255 is full power), u16 (diameter, 0.01 mm;
//                                          0 where it is not known)

/** Bytes of a move. */
export const MOVE = 20;
/** Moves in a row of the texture that the graphics card reads them from. */
export const ROW = 400;
export const TRAVEL = 0;
export const CUT = 1;
/** The path begins anew here: nothing is drawn to it. */
export const JUMP = 2;

/**
 * A box around points, mm.
 * @typedef {{low: [number, number, number], high: [number, number, number]}} Box
 */

/** A list of moves that grows, and forgets its oldest half where it would grow without end. */
export class Path {
  /** @param {number} [most] moves that are kept */
  constructor(most = 1_000_000) {
    this.most = most;
    /** The number of the first move that is kept. */
    this.first = 0;
    this.count = 0;
    /** Changes whenever moves that were there have changed their place. */
    this.edition = 0;
    this.bytes = new Uint8Array(MOVE * ROW);
    /** @type {Box | null} */
    this.box = null;
    /** The lowest and the highest Z at which the tool works, mm. @type {[number, number] | null} */
    this.depth = null;
    /** The diameters of the tools, mm. @type {Set<number>} */
    this.tools = new Set();
  }

  /**
   * Adds moves behind the one with number `at`; those that were there are replaced.
   * @param {number} at
   * @param {Uint8Array} moves
   */
  append(at, moves) {
    if (at < this.first || at > this.first + this.count) {
      this.clear(at);
    } else if (at < this.first + this.count) {
      this.count = at - this.first;
      this.edition++;
    }
    const added = Math.floor(moves.length / MOVE);
    const before = this.at(this.first + this.count - 1);
    this.#makeRoom(added);
    this.bytes.set(moves.subarray(0, added * MOVE), this.count * MOVE);
    this.#widen(moves, added, before && [before.x, before.y, before.z]);
    this.count += added;
  }

  /** @param {number} [at] the number of the next move */
  clear(at = this.first + this.count) {
    this.first = at;
    this.count = 0;
    this.box = null;
    this.depth = null;
    this.tools.clear();
    this.edition++;
  }

  /** @param {number} number */
  at(number) {
    const index = number - this.first;
    if (index < 0 || index >= this.count) return null;
    const view = new DataView(this.bytes.buffer, index * MOVE, MOVE);
    return {
      x: view.getFloat32(0, true), y: view.getFloat32(4, true), z: view.getFloat32(8, true),
      line: view.getUint32(12, true), kind: view.getUint8(16), power: view.getUint8(17) / 255,
    };
  }

  /** @param {number} added */
  #makeRoom(added) {
    if (this.count + added > this.most) {
      const kept = Math.floor(this.count / 2);
      this.bytes.copyWithin(0, (this.count - kept) * MOVE, this.count * MOVE);
      this.first += this.count - kept;
      this.count = kept;
      this.edition++;
    }
    const needed = (this.count + added) * MOVE;
    if (needed > this.bytes.length) {
      const rows = Math.ceil(Math.max(needed, this.bytes.length * 2) / (MOVE * ROW));
      const larger = new Uint8Array(rows * MOVE * ROW);
      larger.set(this.bytes.subarray(0, this.count * MOVE));
      this.bytes = larger;
    }
  }

  /**
   * @param {Uint8Array} moves
   * @param {number} count
   * @param {number[] | null} from
   */
  #widen(moves, count, from) {
    const view = new DataView(moves.buffer, moves.byteOffset, moves.length);
    for (let at = 0; at < count * MOVE; at += MOVE) {
      const point = [view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true)];
      this.box = widened(this.box, point);
      if (view.getUint8(at + 16) === CUT) this.#cut(from ?? point, point, view.getUint16(at + 18, true) / 100);
      from = point;
    }
  }

  /**
   * Of a move straight down only the end counts: it may begin above the material. One straight up cuts nothing.
   * @param {number[]} from
   * @param {number[]} to
   * @param {number} tool
   */
  #cut(from, to, tool) {
    const isVertical = from[0] === to[0] && from[1] === to[1];
    if (isVertical && to[2] >= from[2]) return;
    if (tool > 0) this.tools.add(tool);
    for (const z of isVertical ? [to[2]] : [from[2], to[2]]) {
      this.depth = this.depth ? [Math.min(this.depth[0], z), Math.max(this.depth[1], z)] : [z, z];
    }
  }
}

/**
 * @param {Box | null} box
 * @param {number[]} point
 * @returns {Box}
 */
export function widened(box, point) {
  const [x, y, z] = point;
  if (!box) return {low: [x, y, z], high: [x, y, z]};
  for (let axis = 0; axis < 3; axis++) {
    if (point[axis] < box.low[axis]) box.low[axis] = point[axis];
    if (point[axis] > box.high[axis]) box.high[axis] = point[axis];
  }
  return box;
}

/**
 * The box moved by an offset.
 * @param {Box} box
 * @param {number[]} by
 * @returns {Box}
 */
export function shifted(box, by) {
  return {
    low: [box.low[0] + by[0], box.low[1] + by[1], box.low[2] + by[2]],
    high: [box.high[0] + by[0], box.high[1] + by[1], box.high[2] + by[2]],
  };
}
