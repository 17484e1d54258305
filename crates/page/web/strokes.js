// @ts-check
// Draws paths on the graphics card: one rectangle a move, with round ends. Of a tool whose diameter is known, the material that it
// takes away is drawn first, pale and as wide as the tool; then the path of its centre. The card reads the moves from a texture, a row
// of which holds 400 of them: cards that draw in software take a whole draw for each instance.

import {DEPTH} from "colours";
import {MOVE, ROW} from "scene";

/** @typedef {import("scene").Path} Path */
/** @typedef {import("camera").Camera} Camera */
/** @typedef {import("colours").Ink} Ink */

/** How much of a colour is in the material that was taken away. */
const PALE = "0.35";
/** A laser's spot, mm. */
const SPOT = 0.1;

const VERTEX = `#version 300 es
uniform highp usampler2D moves;
uniform int first;
uniform vec3 right, up, offset;
uniform vec2 half_size;
uniform float millimetre, hair, spot, alpha;
uniform vec2 depth;
uniform bool laser, travels, swept;
uniform vec3 travel, power_off, power_full, ground, ramp[5];
out vec4 colour;
// Pixels along the move and beside it; its length, and half of its width.
out vec2 place_;
flat out vec2 size;
const int CORNERS[6] = int[](0, 1, 2, 2, 1, 3);
vec2 flat_(vec3 p) { return vec2(dot(right, p), dot(up, p)); }
vec3 by_depth(float z) {
  float t = clamp((depth.y - z) / max(depth.y - depth.x, 1e-6), 0.0, 1.0) * 4.0;
  int i = min(int(t), 3);
  return mix(ramp[i], ramp[i + 1], t - float(i));
}
uint word(int move, int number) {
  return texelFetch(moves, ivec2(move % ${ROW} * 5 + number, move / ${ROW}), 0).r;
}
vec3 place(int move) {
  return vec3(uintBitsToFloat(word(move, 0)), uintBitsToFloat(word(move, 1)), uintBitsToFloat(word(move, 2)));
}
void main() {
  int number = first + gl_VertexID / 6, corner = CORNERS[gl_VertexID % 6];
  uint what = word(number + 1, 4);
  uint kind = what & 255u;
  float power = float((what >> 8) & 255u) / 255.0;
  vec3 from = place(number), to = place(number + 1);
  bool cut = kind == 1u;
  float tool = float(what >> 16) * 0.01 * millimetre;
  bool shown = swept ? cut && tool > 0.0 : cut || travels;
  if (kind == 2u || !shown) { gl_Position = vec4(2.0); return; }
  vec3 a3 = from + offset, b3 = to + offset;
  vec2 a = flat_(a3), b = flat_(b3);
  vec2 along = b - a;
  float long_ = length(along);
  along = long_ > 1e-4 ? along / long_ : vec2(1.0, 0.0);
  float end = float(corner & 1), side = float(corner >> 1) * 2.0 - 1.0;
  float wide = swept ? tool : cut ? max(laser ? spot * millimetre : 0.0, hair) : hair * 0.75;
  float half_ = wide * 0.5 + 0.5;
  place_ = vec2(mix(-half_, long_ + half_, end), side * half_);
  size = vec2(long_, wide * 0.5);
  vec2 p = a + along * place_.x + vec2(-along.y, along.x) * place_.y;
  gl_Position = vec4(p / half_size, 0.0, 1.0);
  vec3 ink = !cut ? travel : laser ? mix(power_off, power_full, power) : by_depth(mix(from.z, to.z, end));
  // Opaque: where moves overlap, they are no darker.
  colour = swept ? vec4(mix(ground, ink, ${PALE} * alpha), 1.0) : vec4(ink, cut ? alpha : alpha * 0.75);
}`;

const FRAGMENT = `#version 300 es
precision mediump float;
in vec4 colour;
in highp vec2 place_;
flat in highp vec2 size;
out vec4 shown;
void main() {
  float away = length(vec2(place_.x - clamp(place_.x, 0.0, size.x), place_.y));
  float there = colour.a * clamp(size.y + 0.5 - away, 0.0, 1.0);
  shown = vec4(colour.rgb * there, there);
}`;

/**
 * How a path is drawn.
 * @typedef {object} Style
 * @property {number[]} offset added to each point, mm
 * @property {number} alpha
 * @property {[number, number]} depth the lowest and the highest Z of cuts, before the offset
 * @property {boolean} laser
 * @property {boolean} travels
 * @property {Ink} ink
 */

/** A path in the card's memory. */
class Held {
  edition = -1;
  count = 0;
  rows = 0;
  /** @param {WebGLTexture} texture */
  constructor(texture) {
    this.texture = texture;
  }
}

export class Strokes {
  /** @type {Map<Path, Held>} */
  #held = new Map();
  /** @type {Map<string, WebGLUniformLocation | null>} */
  #places = new Map();

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    // What was drawn stays: a path that grows is not drawn anew each time.
    const gl = canvas.getContext("webgl2", {antialias: false, premultipliedAlpha: true, alpha: true, preserveDrawingBuffer: true});
    if (!gl) throw new Error("this browser has no WebGL2");
    this.gl = gl;
    this.program = compiled(gl);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /**
   * Begins a picture.
   * @param {Camera} camera
   * @param {number} density pixels of the canvas in a pixel of the page
   * @param {boolean} anew whether what was drawn goes
   */
  begin(camera, density, anew) {
    const gl = this.gl;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    if (anew) gl.clear(gl.COLOR_BUFFER_BIT);
    gl.useProgram(this.program);
    const [right, up] = camera.rows();
    this.camera = camera;
    gl.uniform3fv(this.#place("right"), right);
    gl.uniform3fv(this.#place("up"), up);
    gl.uniform2f(this.#place("half_size"), camera.width / 2, camera.height / 2);
    gl.uniform1f(this.#place("hair"), density > 1.5 ? 1.2 : 1.5);
  }

  /**
   * Draws the moves of a path up to the one with number `end`.
   * @param {Path} path
   * @param {Style} style
   * @param {number} [end]
   * @param {number} [begin]
   */
  draw(path, style, end = path.first + path.count, begin = path.first) {
    const [gl, held] = [this.gl, this.#upload(path)];
    const from = Math.max(begin - path.first, 0);
    const moves = Math.min(end - path.first, path.count) - 1 - from;
    if (moves <= 0) return;
    const offset = style.offset.map((value, axis) => value - (this.camera?.target[axis] ?? 0));
    gl.uniform3fv(this.#place("offset"), offset);
    gl.uniform1f(this.#place("alpha"), style.alpha);
    gl.uniform1f(this.#place("millimetre"), this.camera?.scale ?? 1);
    gl.uniform1f(this.#place("spot"), SPOT);
    // Cuts of one depth have the colour of the deepest, as the legend shows.
    const [low, high] = style.depth;
    gl.uniform2f(this.#place("depth"), low, high > low ? high : low + 1);
    gl.uniform1i(this.#place("laser"), style.laser ? 1 : 0);
    gl.uniform1i(this.#place("travels"), style.travels ? 1 : 0);
    gl.uniform3fv(this.#place("travel"), style.ink.travel);
    gl.uniform3fv(this.#place("ground"), style.ink.ground);
    gl.uniform3fv(this.#place("power_off"), style.ink.powerOff);
    gl.uniform3fv(this.#place("power_full"), style.ink.powerFull);
    gl.uniform3fv(this.#place("ramp"), DEPTH.flat());
    gl.bindTexture(gl.TEXTURE_2D, held.texture);
    gl.uniform1i(this.#place("first"), from);
    for (const swept of path.tools.size > 0 && !style.laser ? [1, 0] : [0]) {
      gl.uniform1i(this.#place("swept"), swept);
      gl.drawArrays(gl.TRIANGLES, 0, 6 * moves);
    }
  }

  /** @param {Path} path */
  #upload(path) {
    const gl = this.gl;
    let held = this.#held.get(path);
    if (!held) {
      held = new Held(/** @type {WebGLTexture} */ (gl.createTexture()));
      this.#held.set(path, held);
    }
    if (held.edition === path.edition && held.count === path.count) return held;
    gl.bindTexture(gl.TEXTURE_2D, held.texture);
    const words = new Uint32Array(path.bytes.buffer);
    const [rows, width] = [path.bytes.length / (MOVE * ROW), (MOVE * ROW) / 4];
    if (held.edition !== path.edition || rows !== held.rows) {
      for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32UI, width, rows, 0, gl.RED_INTEGER, gl.UNSIGNED_INT, words);
      held.rows = rows;
    } else {
      const [begin, end] = [Math.floor(held.count / ROW), Math.ceil(path.count / ROW)];
      const changed = words.subarray(begin * width, end * width);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, begin, width, end - begin, gl.RED_INTEGER, gl.UNSIGNED_INT, changed);
    }
    [held.edition, held.count] = [path.edition, path.count];
    return held;
  }

  /** @param {string} name */
  #place(name) {
    if (!this.#places.has(name)) this.#places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.#places.get(name) ?? null;
  }
}

/** @param {WebGL2RenderingContext} gl */
function compiled(gl) {
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  for (const [type, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(type));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "program");
  return program;
}
