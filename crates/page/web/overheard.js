// @ts-check
// What goes over the lines of a machine: each line's bytes apart, a message on several of them once, and what another sender sends.

import {by, say} from "dom";
import {LineReader} from "sender";

/** @typedef {import("job").Job} Job */
/** @typedef {import("program").Program} Program */

/** How long the lines of a message on several channels may be apart, ms. */
const SPREAD = 1000;
/** The name of a job that another sender sends. */
const SENT = "what the sender sends";

export class Overheard {
  /** @type {Map<string, LineReader>} */
  #readers = new Map();
  /** The channel that brought a line first, and when, ms. @type {Map<string, {channel: number, at: number}>} */
  #told = new Map();
  /** By channel, lines of another sender's that have no answer. @type {Map<number, number[]>} */
  #waiting = new Map();

  /** @param {Job} job @param {Program} program @param {Map<number, number>} lines of the job by the machine's number of them */
  constructor(job, program, lines) {
    this.job = job;
    this.program = program;
    this.lines = lines;
  }

  /** @param {number} channel @param {boolean} fromMachine */
  reader(channel, fromMachine) {
    const name = `${channel} ${fromMachine}`;
    const reader = this.#readers.get(name) ?? new LineReader();
    this.#readers.set(name, reader);
    return reader;
  }

  /** Whether no other channel has just brought this line: the machine says a message on each. @param {number} channel @param {string} line */
  isFirst(channel, line) {
    const [before, at] = [this.#told.get(line), performance.now()];
    if (before && before.channel !== channel && at - before.at < SPREAD) return false;
    if (this.#told.size > 1000) this.#told.clear();
    this.#told.set(line, {channel, at});
    return true;
  }

  /** Another sender has sent a line. @param {number} channel @param {string} line */
  sent(channel, line) {
    const {job} = this;
    const bare = line.replace(/[?!~\u0080-\uffff]/g, "");
    if (!bare) return;
    if (job.name !== SENT) {
      job.load(SENT, "");
      job.lines = [];
      say(by("job-facts"), "");
      this.lines.clear();
      this.#waiting.clear();
    }
    job.lines.push(bare);
    this.#waiting.set(channel, [...(this.#waiting.get(channel) ?? []), job.lines.length]);
    if (job.lines.length % 50 === 1) this.program.load(job.lines);
    else this.program.lines = job.lines;
  }

  /** Another sender's oldest line is answered, as the machine's line of this number. @param {number} channel @param {number} number */
  answered(channel, number) {
    const line = this.#waiting.get(channel)?.shift();
    if (line) this.lines.set(number, line);
  }
}
