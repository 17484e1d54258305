// @ts-check
// The picture, in four layers: grid and travel; the job and what is ahead; what the machine has done; carriage and numbers. Each is
// drawn anew only where it has changed.

import {Camera, cornersOf} from "camera";
import {PLATE, between, css} from "colours";
import {inkNow} from "legend";
import {JUMP, MOVE, Path, shifted, widened} from "scene";
import {Strokes} from "strokes";

/** @typedef {import("scene").Box} Box */

/**
 * What is shown.
 * @typedef {object} Shown
 * @property {Path} job the job as it was checked, in work coordinates
 * @property {Path} trace what the machine has planned, in machine coordinates
 * @property {number} done moves of the trace that have begun
 * @property {number[]} position of the carriage, machine coordinates
 * @property {number[]} offset of work zero
 * @property {number[]} zero where the job has its own zero, machine coordinates
 * @property {{low: number[], high: number[]}} travel the ends of the axes' travel, machine position
 * @property {boolean} softLimits
 * @property {boolean} laser
 * @property {number} power share of full power now
 * @property {boolean} running whether what the machine has done is told from what is ahead
 * @property {boolean} travels whether rapids are drawn
 * @property {number[]} [origin] where the trace has its zero, machine coordinates; machine zero if it is not told
 * @property {import("state").Unit} [unit] of the grid; mm if it is not told
 * @property {import("heights").HeightMap | null} [map] heights of the plate
 */

/** Moves up to which all are drawn anew at each picture where a wide tool would cover the lines before. */
const MOST_SWEPT = 20_000;

export class View {
  camera = new Camera();
  /** @type {Shown | null} */
  shown = null;
  #dirty = false;
  /** Script time of the last picture, ms. */
  cost = 0;
  /** Moves of the job in the picture that was drawn last. */
  drawn = 0;
  #now = new Path();
  /** What the layers show. */
  #aheadDrawn = "";
  #behindDrawn = "";
  #doneDrawn = 0;

  /**
   * @param {HTMLElement} place
   * @param {() => void} [moved] called when the user has turned or moved the picture
   */
  constructor(place, moved = () => {}) {
    this.place = place;
    this.moved = moved;
    const canvas = () => {
      const one = document.createElement("canvas");
      one.setAttribute("aria-hidden", "true");
      place.append(one);
      return one;
    };
    this.below = canvas();
    this.ahead = canvas();
    this.behind = canvas();
    this.above = canvas();
    this.strokes = {ahead: new Strokes(this.ahead), behind: new Strokes(this.behind)};
    new ResizeObserver(() => this.#resize()).observe(place);
    this.#resize();
    this.#listen();
  }

  /** Draws soon. */
  touch() {
    if (this.#dirty) return;
    this.#dirty = true;
    requestAnimationFrame(() => this.draw());
  }

  /** @param {"top" | "3d" | "front"} name */
  look(name) {
    this.camera.look(name);
    this.touch();
  }

  /** Shows all of the job and of the trace; the machine where there is neither. */
  fit() {
    const shown = this.shown;
    if (!shown) return;
    const boxes = [shown.job.box && shifted(shown.job.box, shown.zero), shown.running || !shown.job.box ? shown.trace.box : null];
    /** @type {Box | null} */
    let all = null;
    for (const box of boxes) {
      if (box) all = widened(widened(all, box.low), box.high);
    }
    const beside = shown.laser ? 0 : Math.max(0, ...shown.job.tools) / 2;
    const grown = (/** @type {number[]} */ point, /** @type {number} */ by) => [point[0] + by, point[1] + by, point[2]];
    if (all && size(all) > 0.01) this.camera.fit(widened(widened(all, grown(all.low, -beside)), grown(all.high, beside)));
    else return this.fitMachine();
    this.touch();
  }

  /** Shows all of the travel. */
  fitMachine() {
    if (!this.shown) return;
    this.camera.fit(travelBox(this.shown));
    this.touch();
  }

  #resize() {
    const {width, height} = this.place.getBoundingClientRect();
    const scale = density();
    [this.camera.width, this.camera.height] = [Math.max(width, 1), Math.max(height, 1)];
    for (const canvas of [this.below, this.ahead, this.behind, this.above]) {
      [canvas.width, canvas.height] = [Math.round(width * scale) || 1, Math.round(height * scale) || 1];
    }
    this.#aheadDrawn = this.#behindDrawn = "";
    this.touch();
  }

  /** Draws now. */
  draw() {
    this.#dirty = false;
    const begun = performance.now();
    const shown = this.shown;
    if (!shown) return;
    const style = getComputedStyle(document.documentElement);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    this.#drawBelow(shown, colour);
    this.#drawPaths(shown);
    this.#drawAbove(shown, colour);
    this.drawn = shown.job.count;
    this.cost = performance.now() - begun;
  }

  /** @param {HTMLCanvasElement} canvas */
  #pen(canvas) {
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const scale = density();
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, this.camera.width, this.camera.height);
    return pen;
  }

  /**
   * @param {Shown} shown
   * @param {(name: string) => string} colour
   */
  #drawBelow(shown, colour) {
    const pen = this.#pen(this.below);
    const floor = this.camera.pitch < 0.2 ? null : gridOf(this.camera, shown);
    if (floor) {
      const {step, low, high, z} = floor;
      for (const axis of [0, 1]) {
        for (let at = Math.ceil(low[axis] / step) * step; at <= high[axis]; at += step) {
          const place = at + shown.offset[axis];
          const ends = [low, high].map((end) => {
            const point = [end[0] + shown.offset[0], end[1] + shown.offset[1], z];
            point[axis] = place;
            return point;
          });
          pen.strokeStyle = colour(Math.abs(at) < step / 2 ? "--grid-bold" : "--grid");
          pen.lineWidth = Math.abs(at) < step / 2 ? 2 : 1;
          this.#line(pen, ends);
        }
      }
    }
    if (shown.map) this.#drawMap(pen, shown.map);
    const corners = cornersOf(travelBox(shown));
    pen.strokeStyle = colour("--box");
    pen.lineWidth = 1.2;
    pen.setLineDash(shown.softLimits ? [] : [6, 5]);
    for (const [a, b] of EDGES) this.#line(pen, [corners[a], corners[b]]);
    pen.setLineDash([]);
  }

  /** @param {CanvasRenderingContext2D} pen @param {import("heights").HeightMap} map */
  #drawMap(pen, {columns, rows, heights}) {
    const [low, high] = range([Math.min(...heights), Math.max(...heights)]);
    const parts = columns.length * rows.length > 200 ? 1 : 4;
    const at = (/** @type {number[]} */ side, /** @type {number} */ cell, /** @type {number} */ part) => side[cell] + ((side[cell + 1] - side[cell]) * part) / parts;
    pen.globalAlpha = 0.55;
    for (let row = 0; row + 1 < rows.length; row++) {
      for (let column = 0; column + 1 < columns.length; column++) {
        const height = (/** @type {number} */ u, /** @type {number} */ v) => {
          const [a, b] = [0, 1].map((up) => heights[(row + up) * columns.length + column] * (1 - u / parts) + (heights[(row + up) * columns.length + column + 1] * u) / parts);
          return a + ((b - a) * v) / parts;
        };
        for (let u = 0; u < parts; u++) {
          for (let v = 0; v < parts; v++) {
            const corners = [[u, v], [u + 1, v], [u + 1, v + 1], [u, v + 1]].map(([i, j]) => [at(columns, column, i), at(rows, row, j), height(i, j)]);
            pen.fillStyle = pen.strokeStyle = css(between(PLATE, (height(u + 0.5, v + 0.5) - low) / (high - low)));
            pen.lineWidth = 0.5;
            this.#line(pen, corners);
            pen.fill();
          }
        }
      }
    }
    pen.globalAlpha = 1;
  }

  /** @param {Shown} shown */
  #drawPaths(shown) {
    const ink = inkNow();
    const depth = depthOf(shown);
    const common = {laser: shown.laser, travels: shown.travels, ink};
    const hasJob = shown.job.count > 1;
    const origin = shown.origin ?? [0, 0, 0];
    /** @type {[number, number]} */
    const inMachine = hasJob ? [depth[0] + shown.zero[2] - origin[2], depth[1] + shown.zero[2] - origin[2]] : range(shown.trace.depth ?? [0, 0]);
    const style = {...common, offset: origin, depth: inMachine};
    const {camera} = this;
    const scene = JSON.stringify([camera, common, inMachine]);
    const isBegun = hasJob && shown.running;
    const ahead = scene + JSON.stringify([shown.zero, isBegun, shown.job.edition, shown.job.count, hasJob ? 0 : [shown.done, shown.trace.count]]);
    if (ahead !== this.#aheadDrawn) {
      this.#aheadDrawn = ahead;
      this.strokes.ahead.begin(camera, density(), true);
      if (hasJob) this.strokes.ahead.draw(shown.job, {...common, offset: shown.zero, alpha: isBegun ? 0.28 : 1, depth});
      else this.strokes.ahead.draw(shown.trace, {...style, alpha: 0.28}, undefined, shown.done - 1);
    }
    const behind = `${scene} ${origin} ${shown.trace === shown.job} ${shown.trace.edition} ${shown.trace.first}`;
    const isSwept = !shown.laser && shown.trace.tools.size > 0 && shown.done < MOST_SWEPT;
    const anew = behind !== this.#behindDrawn || shown.done < this.#doneDrawn || isSwept;
    const from = anew ? shown.trace.first : Math.max(this.#doneDrawn - 1, shown.trace.first);
    [this.#behindDrawn, this.#doneDrawn] = [behind, shown.done];
    this.strokes.behind.begin(camera, density(), anew);
    this.strokes.behind.draw(shown.trace, {...style, alpha: 1}, shown.done, from);
    this.#drawUnderWay(shown, style);
  }

  /**
   * @param {Shown} shown
   * @param {Omit<import("strokes").Style, "alpha">} style
   */
  #drawUnderWay(shown, style) {
    const [from, to] = [shown.trace.at(shown.done - 1), shown.trace.at(shown.done)];
    if (!from || !to || to.kind === JUMP) return;
    const bytes = new Uint8Array(2 * MOVE);
    const view = new DataView(bytes.buffer);
    [from.x, from.y, from.z].forEach((value, axis) => view.setFloat32(4 * axis, value, true));
    shown.position.slice(0, 3).forEach((value, axis) => view.setFloat32(MOVE + 4 * axis, value - style.offset[axis], true));
    view.setUint8(MOVE + 16, to.kind);
    view.setUint8(MOVE + 17, Math.round(to.power * 255));
    this.#now.append(0, bytes);
    this.strokes.behind.draw(this.#now, {...style, alpha: 1});
  }

  /**
   * @param {Shown} shown
   * @param {(name: string) => string} colour
   */
  #drawAbove(shown, colour) {
    const pen = this.#pen(this.above);
    pen.font = "12px system-ui, sans-serif";
    this.#drawNumbers(pen, shown, colour);
    this.#drawZero(pen, shown.offset, "work zero", colour);
    const [x, y] = this.camera.project(shown.position);
    const foot = this.camera.project([shown.position[0], shown.position[1], shown.offset[2]]);
    pen.strokeStyle = pen.fillStyle = colour("--carriage");
    pen.lineWidth = 2;
    if (Math.hypot(foot[0] - x, foot[1] - y) > 3) {
      pen.setLineDash([3, 3]);
      this.#stroke(pen, [[x, y], foot]);
      pen.setLineDash([]);
    }
    if (shown.laser && shown.power > 0) {
      pen.globalAlpha = 0.25 + 0.5 * shown.power;
      pen.beginPath();
      pen.arc(x, y, 14, 0, 7);
      pen.fill();
      pen.globalAlpha = 1;
    }
    pen.beginPath();
    pen.arc(x, y, 6, 0, 7);
    pen.stroke();
    this.#stroke(pen, [[x - 11, y], [x + 11, y]]);
    this.#stroke(pen, [[x, y - 11], [x, y + 11]]);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {Shown} shown
   * @param {(name: string) => string} colour
   */
  #drawNumbers(pen, shown, colour) {
    const grid = gridOf(this.camera, shown);
    const unit = unitOf(shown);
    pen.fillStyle = colour("--soft");
    if (!this.camera.isFromAbove || Math.abs(this.camera.yaw) > 1e-6) {
      pen.fillText(`grid ${short(grid.step / unit.mm)} ${unit.name}`, 8, this.camera.height - 8);
      return;
    }
    pen.textAlign = "center";
    for (let at = Math.ceil(grid.low[0] / grid.step) * grid.step; at <= grid.high[0]; at += grid.step) {
      const [x] = this.camera.project([at + shown.offset[0], 0, 0]);
      if (x > 40 && x < this.camera.width - 20) pen.fillText(short(at / unit.mm), x, this.camera.height - 6);
    }
    pen.textAlign = "left";
    for (let at = Math.ceil(grid.low[1] / grid.step) * grid.step; at <= grid.high[1]; at += grid.step) {
      const [, y] = this.camera.project([0, at + shown.offset[1], 0]);
      if (y > 12 && y < this.camera.height - 20) pen.fillText(short(at / unit.mm), 4, y + 4);
    }
    pen.fillText(unit.name, 4, this.camera.height - 6);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number[]} at
   * @param {string} name
   * @param {(name: string) => string} colour
   */
  #drawZero(pen, at, name, colour) {
    const zero = this.camera.project(at);
    const arm = 34 / this.camera.scale;
    const tips = ["X", "Y", "Z"].map((letter, axis) => {
      const end = [at[0], at[1], at[2]];
      end[axis] += arm;
      return {letter, end: this.camera.project(end)};
    });
    pen.lineWidth = 2;
    pen.textAlign = "center";
    tips.forEach(({letter, end}, axis) => {
      if (Math.hypot(end[0] - zero[0], end[1] - zero[1]) < 4) return;
      pen.strokeStyle = pen.fillStyle = ["#d03a3a", "#2f9e44", "#3b7ddd"][axis];
      this.#stroke(pen, [zero, end]);
      pen.fillText(letter, end[0] + (end[0] - zero[0]) * 0.25, end[1] + (end[1] - zero[1]) * 0.25 + 4);
    });
    pen.textAlign = "left";
    pen.fillStyle = colour("--soft");
    // Seen aslant, the arm of X ends close below zero.
    pen.fillText(name, zero[0] + 6, zero[1] + (this.camera.isFromAbove ? 15 : 30));
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number[][]} points in mm
   */
  #line(pen, points) {
    this.#stroke(pen, points.map((point) => this.camera.project(point)));
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number[][]} points in pixels
   */
  #stroke(pen, points) {
    pen.beginPath();
    points.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }

  #listen() {
    const place = this.place;
    /** @type {Map<number, {x: number, y: number}>} */
    const fingers = new Map();
    const at = (/** @type {PointerEvent | WheelEvent} */ event) => {
      const box = place.getBoundingClientRect();
      return {x: event.clientX - box.left, y: event.clientY - box.top};
    };
    place.addEventListener("pointerdown", (event) => {
      place.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, at(event));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      place.addEventListener(end, (event) => fingers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    place.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = at(event);
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, finger]) => finger);
      this.#drag(before, now, others[0], event.button === 2 || event.buttons === 2 || event.shiftKey);
      fingers.set(event.pointerId, now);
    });
    place.addEventListener("contextmenu", (event) => event.preventDefault());
    place.addEventListener("wheel", (event) => {
      event.preventDefault();
      const {x, y} = at(event);
      this.camera.zoom(Math.exp(-event.deltaY * 0.0015), x, y);
      this.#moved();
    }, {passive: false});
    place.addEventListener("keydown", (event) => this.#key(event));
  }

  /**
   * @param {{x: number, y: number}} before
   * @param {{x: number, y: number}} now
   * @param {{x: number, y: number} | undefined} other a second finger
   * @param {boolean} second whether the second thing is done: turn where one moves, move where one turns
   */
  #drag(before, now, other, second) {
    const [dx, dy] = [now.x - before.x, now.y - before.y];
    if (other) {
      const apart = (/** @type {{x: number, y: number}} */ one) => Math.hypot(one.x - other.x, one.y - other.y);
      this.camera.zoom(apart(now) / Math.max(apart(before), 1), (now.x + other.x) / 2, (now.y + other.y) / 2);
      this.camera.pan(dx / 2, dy / 2);
    } else if (second !== this.camera.isFromAbove) {
      if (second) this.camera.pan(dx, dy);
      else this.camera.orbit(dx, dy);
    } else if (second) {
      this.camera.orbit(dx, dy);
    } else {
      this.camera.pan(dx, dy);
    }
    this.#moved();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => this.camera.pan(40, 0), ArrowRight: () => this.camera.pan(-40, 0),
      ArrowUp: () => this.camera.pan(0, 40), ArrowDown: () => this.camera.pan(0, -40),
      "+": () => this.camera.zoom(1.25), "=": () => this.camera.zoom(1.25), "-": () => this.camera.zoom(0.8),
      f: () => this.fit(), t: () => this.camera.look("top"), d: () => this.camera.look("3d"),
    };
    const act = event.ctrlKey || event.metaKey ? undefined : keys[event.key];
    if (!act) return;
    event.preventDefault();
    event.stopPropagation();
    act();
    this.#moved();
  }

  #moved() {
    this.moved();
    this.touch();
  }
}

/** Pixels of a canvas in a pixel of the page. */
function density() {
  return window.devicePixelRatio || 1;
}

/** The edges of a box, by its corners. */
const EDGES = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/** @param {Shown} shown */
function unitOf(shown) {
  return shown.unit ?? {mm: 1, name: "mm"};
}

/** @param {Shown} shown @returns {Box} */
function travelBox(shown) {
  const corner = (/** @type {number[]} */ [x, y, z]) => /** @type {[number, number, number]} */ ([x, y, z]);
  return {low: corner(shown.travel.low), high: corner(shown.travel.high)};
}

/** @param {Box} box */
function size(box) {
  return Math.max(...box.high.map((value, axis) => value - box.low[axis]));
}

/** @param {Shown} shown @returns {[number, number]} */
function depthOf(shown) {
  return range(shown.job.depth ?? [0, 1]);
}

/**
 * A single depth has the last colour.
 * @param {[number, number]} depth
 * @returns {[number, number]}
 */
function range([low, high]) {
  return [low, Math.max(high, low + 1e-3)];
}

/**
 * The grid in work coordinates: round numbers, some 60 pixels apart, over what is to be seen.
 * @param {Camera} camera
 * @param {Shown} shown
 */
function gridOf(camera, shown) {
  const {mm} = unitOf(shown);
  const wanted = 60 / camera.scale / mm;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const step = mm * ([1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= wanted) ?? 10 * power);
  const reach = (camera.width + camera.height) / camera.scale;
  const centre = [0, 1].map((axis) => camera.target[axis] - shown.offset[axis]);
  const half = camera.isFromAbove ? reach : Math.min(reach, 20 * step);
  return {step, low: centre.map((value) => value - half), high: centre.map((value) => value + half), z: shown.offset[2]};
}

/** @param {number} value */
function short(value) {
  return String(Math.round(value * 1000) / 1000);
}
