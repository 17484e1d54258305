// @ts-check
// The machine that the page drives: the simulated one, or a board at a port. The simulated one looks at jobs for both.

import {Board} from "board";
import {FROM, TO} from "frames";
import {Link} from "link";
import {ports} from "serial";

/** @typedef {import("board").BoardEars} Ears */
/** @typedef {import("serial").Port} Port */
/** Where a job is to be begun. @typedef {{line: number, clearance: number | null, spin_up: number, start: number[] | null}} Resume */

/** What the simulated machine tells of jobs, whatever machine they are for. */
const OF_JOBS = [FROM.SCENE, FROM.CHECK, FROM.PROFILE, FROM.PROGRESS, FROM.TAKEN, FROM.REST, FROM.PLAIN];
/** What is told again when the page comes back to it. */
const KEPT = [FROM.HELLO, FROM.ROLE, FROM.SETTINGS];

export class Machines {
  /** @type {Map<number, any>} */
  #kept = new Map();
  #isOpen = false;
  #why = "";
  /** @type {Board | null} */
  #board = null;
  /** @type {{port: Port, baud: number} | null} */
  #way = null;

  /** @param {Ears} ears */
  constructor(ears) {
    this.ears = ears;
    this.simulated = new Link({
      frame: (tag, content) => this.#said(tag, content),
      opened: (isOpen, why) => {
        [this.#isOpen, this.#why] = [isOpen, why];
        if (!this.#board) ears.opened(isOpen, why);
      },
    });
    ports()?.addEventListener("connect", (event) => {
      if (this.#way && event.target === /** @type {any} */ (this.#way.port) && !this.#board?.isOpen) this.connect(this.#way.port, this.#way.baud).catch(() => {});
    });
  }

  /** Whether the machine takes lines. */
  get isOpen() {
    return this.#board ? this.#board.isOpen : this.simulated.isOpen;
  }

  /** Whether a board is meant, even if it is gone. */
  get hasBoard() {
    return this.#board !== null;
  }

  /** Whether jobs can be looked at. */
  get looks() {
    return this.simulated.isOpen;
  }

  /**
   * @param {number} tag
   * @param {Uint8Array | string} [content]
   */
  send(tag, content) {
    (this.#board ?? this.simulated).send(tag, content);
  }

  /**
   * Has a job looked at, for the machine that is driven: with its settings, at its zero.
   * @param {{name: string, resume?: Resume, level?: {heights: string, tolerance: number}}} order
   * @param {string} text
   */
  look(order, text) {
    const known = this.#board?.known;
    const board = known && {settings: known.listing, origin: known.offset, grbl: known.isGrbl ? this.#way?.baud : null};
    this.simulated.send(TO.JOB, `${JSON.stringify({...order, ...board})}\n${text}`);
  }

  /** @param {Uint8Array} file */
  change(file) {
    return !this.#board && this.simulated.change(file);
  }

  /** The place of the board is right. */
  trust() {
    this.#board?.trust();
  }

  /**
   * Drives a board from now on.
   * @param {Port} port
   * @param {number} baud
   */
  async connect(port, baud) {
    const before = this.#way?.port === port ? this.#board?.place ?? null : null;
    await this.#board?.close();
    const words = {settings: this.#kept.get(FROM.SETTINGS) ?? [], faults: this.#kept.get(FROM.HELLO)?.faults ?? {}};
    const board = new Board(this.ears, port, words, before);
    [this.#board, this.#way] = [board, {port, baud}];
    this.ears.opened(false, "The port is open. Waiting for the board …");
    try {
      await board.open(baud);
    } catch (error) {
      this.ears.opened(false, `The port cannot be opened: ${error instanceof Error ? error.message : error}. Does another program have it?`);
      throw error;
    }
  }

  /** Drives the simulated machine again. */
  async leave() {
    const board = this.#board;
    [this.#board, this.#way] = [null, null];
    await board?.close();
    this.ears.silent("");
    this.ears.opened(this.#isOpen, this.#why);
    for (const tag of KEPT) if (this.#kept.has(tag)) this.ears.frame(tag, this.#kept.get(tag));
    this.simulated.send(TO.CLEAR);
  }

  /** @param {number} tag @param {any} content */
  #said(tag, content) {
    if (KEPT.includes(tag)) this.#kept.set(tag, content);
    if (!this.#board || OF_JOBS.includes(tag)) this.ears.frame(tag, content);
  }
}
