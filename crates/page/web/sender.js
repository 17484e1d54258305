// @ts-check
// Sends lines as fast as the machine's receive buffer takes them: it counts the characters on the way.

/** Characters that would act wherever they stand, and those that no line has: left out of a job's lines. Letters stay:
 * the machine refuses a line that has one outside a comment. */
// eslint-disable-next-line no-control-regex
const NO_LINE = /[?!~\u0000-\u001f\u007f-\u009f\u00a1]/g;

/** Lines that write to memory: Grbl on a small board loses bytes meanwhile, so nothing is on the way beside one. */
const ALONE = /^\s*\$\s*(\d+\s*=|I\s*=|N\s*\d|RST)|G0*10\s*L|G0*(28|30)\.1/i;

/** Bytes of a line on the way. @param {string} text */
const sizeOf = (text) => new TextEncoder().encode(text).length + 1;

/** @typedef {{text: string, job: number}} Line a line, and its number in the job; 0 outside of it */

/**
 * @typedef {object} Ears
 * @property {(text: string) => void} send
 * @property {(line: Line, answer: string, number: number) => void} answered
 */

export class Sender {
  /** @type {Line[]} */
  #own = [];
  /** @type {Line[]} */
  #sent = [];
  #onTheWay = 0;
  /** @type {string[]} */
  #job = [];
  #next = 0;

  /**
   * @param {Ears} ears
   */
  constructor(ears) {
    this.ears = ears;
    this.room = 127;
  }

  /** Whether a job is under way. */
  get isRunning() {
    return this.#next < this.#job.length || this.#sent.some((line) => line.job > 0);
  }

  /** The oldest line of the job that has no answer: where the machine waits, if it does. @returns {Line | null} */
  get oldest() {
    return this.#sent.find((line) => line.job > 0) ?? null;
  }

  /** The line of the job that was answered last; 0 if none was. */
  last = 0;
  /** The line of the job that was sent last; 0 if none was. */
  reached = 0;
  /** Lines ahead of those of the job, and the number of its first one. */
  #ahead = {count: 0, first: 1};
  /** The line of the file of each, if they are not one behind the other. @type {number[]} */
  #numbers = [];

  /** How much of the job has been answered, 0 to 1. */
  get share() {
    return (this.#next - this.#sent.length) / (this.#job.length || 1);
  }

  /**
   * @param {string[]} lines of the job
   * @param {number} [first] the number of the first one
   * @param {string[]} [ahead] lines ahead of them
   * @param {number[]} [numbers] of the lines, if they are not one behind the other
   */
  run(lines, first = 1, ahead = [], numbers = []) {
    this.#numbers = numbers;
    this.last = 0;
    this.reached = 0;
    this.#job = [...ahead, ...lines];
    this.#ahead = {count: ahead.length, first};
    this.#next = 0;
    this.#feed();
  }

  /** Sends nothing more of the job. */
  stop() {
    this.#job = [];
    this.#next = 0;
  }

  /** Whether the machine takes a person's lines ahead of those that have no answer: a tool change. */
  isAside = false;
  /** Such lines: one at a time, the first is on the way if `#asideIsOut`. @type {Line[]} */
  #aside = [];
  #asideIsOut = false;

  /** The oldest line that has no answer, of the job or not. @returns {Line | null} */
  get first() {
    return this.#sent[0] ?? null;
  }

  /** Forgets everything: the machine has forgotten it too. */
  reset() {
    this.stop();
    this.#aside = [];
    this.isAside = this.#asideIsOut = false;
    this.#own = [];
    this.#sent = [];
    this.#onTheWay = 0;
  }

  /** @param {string} text */
  say(text) {
    const line = {text, job: 0};
    if (this.isAside || this.#asideIsOut) {
      this.#aside.push(line);
      return this.#feedAside();
    }
    this.#own.push(line);
    this.#feed();
  }

  #feedAside() {
    if (this.#asideIsOut || !this.#aside.length) return;
    this.#asideIsOut = true;
    this.ears.send(this.#aside[0].text + "\n");
  }

  /**
   * Takes the machine's answer to the oldest line that has none.
   * @param {string} answer `ok` or `error:N`
   * @param {number} number of the line, as the machine counts
   */
  answer(answer, number) {
    if (this.#asideIsOut) {
      this.#asideIsOut = false;
      const own = this.#aside.shift();
      if (own) this.ears.answered(own, answer, number);
      return this.#feedAside();
    }
    const line = this.#sent.shift();
    if (!line) return;
    this.#onTheWay -= sizeOf(line.text);
    if (line.job) this.last = line.job;
    this.ears.answered(line, answer, number);
    this.#feed();
  }

  #feed() {
    let bytes = "";
    for (;;) {
      const own = this.#own[0];
      const line = own ?? this.#ofJob();
      if (!line || !this.#hasRoom(line)) break;
      if (own) this.#own.shift();
      else this.#next++;
      if (line.job) this.reached = line.job;
      this.#sent.push(line);
      this.#onTheWay += sizeOf(line.text);
      bytes += line.text + "\n";
    }
    if (bytes) this.ears.send(bytes);
  }

  /** @param {Line} line */
  #hasRoom(line) {
    const before = this.#sent.at(-1);
    if (!before) return true;
    return this.#onTheWay + sizeOf(line.text) <= this.room && !ALONE.test(line.text) && !ALONE.test(before.text);
  }

  /** @returns {Line | null} */
  #ofJob() {
    if (this.#next >= this.#job.length) return null;
    const text = this.#job[this.#next];
    const index = Math.max(this.#next - this.#ahead.count, 0);
    // Marks of the tape's ends are no lines.
    return {text: text.trimStart().startsWith("%") ? "" : text.replace(NO_LINE, "").replace(/\u00a0/g, " "), job: this.#numbers[index] ?? this.#ahead.first + index};
  }
}

/** Takes the machine's bytes apart into lines. */
export class LineReader {
  #begun = "";

  /**
   * @param {Uint8Array} bytes
   * @param {(line: string) => void} each
   */
  read(bytes, each) {
    this.#begun += new TextDecoder().decode(bytes);
    const lines = this.#begun.split("\n");
    this.#begun = lines.pop() ?? "";
    for (const line of lines) each(line.replace(/\r$/, ""));
  }
}

/** Whether a line of the machine's answers a line of the sender's. @param {string} line */
export function isAnswer(line) {
  return line === "ok" || line.startsWith("error:");
}
