// @ts-check
// What the machine is and does, as the server tells it.

/**
 * @typedef {object} State
 * @property {string} name as status reports spell it
 * @property {boolean} quiet whether nothing is under way: no motion, no line, no wait
 * @property {{name: string, now: number, target: number}[]} heaters Celsius
 * @property {boolean[]} outputs whether each output of M62 to M65 is on
 * @property {string} alarm `ALARM:1` while the machine is locked by it, else empty
 * @property {string} message the message that came with the state, such as `Reset to continue`; else empty
 * @property {number[]} overrides feed, rapid, spindle: percent
 * @property {number} limits a bit for each motor whose limit switch is pressed
 * @property {number} switches bits: probe, door, hold, start, reset are pressed
 * @property {number} seconds simulated time since power-up
 * @property {number} feed mm/min
 * @property {number} power share of full power, 0 to 1
 * @property {number} lines answered lines since power-up
 * @property {number} running number of the line whose move is under way; 0 for none
 * @property {number} moves moves planned since power-up
 * @property {number} done moves that have begun
 * @property {number} queued seconds of motion in the queue; NaN if it is not known
 * @property {number} spindle 0 off, 1 clockwise, 2 counterclockwise
 * @property {number} coolant bits: flood, mist
 * @property {number[]} position machine position, mm
 * @property {number[]} offset work offset, mm
 * @property {string} doubt why the place is not known; empty if it is
 */

/**
 * @typedef {object} Hello
 * @property {string} name
 * @property {string} version
 * @property {string[]} axes
 * @property {number} motors
 * @property {string | null} second axis of the second motor
 * @property {number} receive_buffer bytes
 * @property {boolean} normally_closed
 * @property {number} channel the page's own
 * @property {string} work what the tool does: `cut` or `extruded`
 * @property {boolean} [board] whether it is a board at a port of this computer, and no simulator
 * @property {Record<string, [string, string]>} faults for `error:20` and `ALARM:1`: the event, and the remedy
 */

/**
 * @typedef {object} Setting
 * @property {number} number
 * @property {string} name
 * @property {string} unit
 * @property {string} description
 * @property {string} value
 * @property {string} range
 */

/**
 * @typedef {object} Role
 * @property {boolean} controls whether this page moves the machine
 * @property {string[]} senders who else is connected
 */

/**
 * Reads a state frame.
 * @param {Uint8Array} bytes
 * @returns {State}
 */
export function readState(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const floats = (/** @type {number} */ at, /** @type {number} */ count) =>
    Array.from({length: count}, (_, i) => view.getFloat32(at + 4 * i, true));
  const axes = bytes[7];
  const [report, alarm, message] = new TextDecoder().decode(bytes.subarray(48 + 8 * axes)).split("\n");
  const [name, ...fields] = report.split("|");
  return {
    name, alarm, message, doubt: "",
    quiet: bytes[1] === 1,
    heaters: heatersOf(fields),
    outputs: outputsOf(fields),
    overrides: [bytes[2], bytes[3], bytes[4]],
    limits: bytes[5],
    switches: bytes[6],
    seconds: view.getFloat64(8, true),
    feed: view.getFloat32(16, true),
    power: view.getFloat32(20, true),
    lines: view.getUint32(24, true),
    running: view.getUint32(28, true),
    moves: view.getUint32(32, true),
    done: view.getUint32(36, true),
    queued: view.getFloat32(40, true),
    spindle: bytes[44],
    coolant: bytes[45],
    position: floats(48, axes),
    offset: floats(48 + 4 * axes, axes),
  };
}

/** Heaters by their letters in reports. @type {Record<string, string>} */
const HEATERS = {N: "nozzle", B: "bed"};

/**
 * Heaters in the fields of a report: `Heat:N,85.2,200.0;B,60.0,60.0`.
 * @param {string[]} fields
 */
export function heatersOf(fields) {
  const field = fields.find((one) => one.startsWith("Heat:"))?.slice(5) ?? "";
  return field.split(";").filter(Boolean).map((one) => {
    const [name, now, target] = one.split(",");
    return {name: HEATERS[name] ?? name, now: Number(now), target: Number(target)};
  });
}

/** Outputs in the fields of a report: `Out:0100`. @param {string[]} fields */
export function outputsOf(fields) {
  return [...(fields.find((one) => one.startsWith("Out:"))?.slice(4) ?? "")].map((one) => one === "1");
}

/** A unit of length: in mm, its name, and the digits behind the point that tell a step. @typedef {{mm: number, name: string, digits: number}} Unit */

/** @type {Unit} */
const MM = {mm: 1, name: "mm", digits: 3};
/** @type {Unit} */
const INCH = {mm: 25.4, name: "in", digits: 4};

/** The settings by number. */
export class Settings {
  /** @type {Map<number, Setting>} */
  byNumber = new Map();
  /** How often they have changed. */
  edition = 0;

  /** @param {Setting[]} all */
  load(all) {
    this.edition++;
    this.byNumber = new Map(all.map((one) => [one.number, one]));
  }

  /** @param {number} number */
  value(number) {
    return Number(this.byNumber.get(number)?.value ?? 0);
  }

  get isLaser() {
    return this.value(32) !== 0;
  }

  get hasSoftLimits() {
    return this.value(20) !== 0;
  }

  /** The unit that the machine reports in. @returns {Unit} */
  get unit() {
    return this.value(13) ? INCH : MM;
  }

  /**
   * The ends of the travel of X, Y, Z and a fourth axis, machine position in mm: from minus the travel to 0, or with the home
   * switch at a place of its own.
   */
  get travel() {
    const [own, negative] = [719, 23].map((number) => this.value(number));
    const travels = [130, 131, 132, 133].map((number) => this.value(number));
    const high = travels.map((travel, axis) => {
      const place = own >> axis & 1 ? this.value(740 + axis) : 0;
      return own >> axis & 1 && negative >> axis & 1 ? place + travel : place;
    });
    return {low: high.map((end, axis) => end - travels[axis]), high};
  }
}
