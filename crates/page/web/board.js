// @ts-check
// The way to a board at a serial port: asks it what it is, and tells what it says as a machine's frames.
//
//   waking    the port is open; a board that restarts is silent for a second or two
//   asking    $I, $$, $#, $G, one at a time: lines of the page wait
//   ready     lines and bytes of the page go out as they come; ? asks for the state

import {FROM, TO} from "frames";
import {Known, dwells, isBanner, reportOf} from "grbl";
import {CUT, JUMP, MOVE, TRAVEL} from "scene";
import {LineReader, isAnswer} from "sender";
import {Serial, nameOf} from "serial";

/** @typedef {import("state").Setting} Setting */
/** @typedef {import("state").Hello} Hello */
/** @typedef {import("serial").Port} Port */

/** What the page knows of Grbl's settings and faults, whatever machine has them. @typedef {{settings: Setting[], faults: Hello["faults"]}} Words */
/** A place that a board had, and whether it stood still there. @typedef {{position: number[], rests: boolean, own: boolean}} Place `own`: the page has reset it */

/**
 * @typedef {object} BoardEars
 * @property {(tag: number, content: any) => void} frame
 * @property {(open: boolean, why: string) => void} opened
 * @property {(words: string) => void} silent what a person should know of a silent board; empty: it speaks
 * @property {(lines: number) => void} lost so many lines have no answer, and none will come
 */

const RESET = 0x18;
/** Between two questions for the state, ms. */
const POLL = 100;
/** How long a board that has just got its port may be silent before it is asked, ms: a loader listens for so long. */
const WAKES = 2000;
/** How long it may be silent in all before the port is given up, ms. */
const GIVES_UP = 8000;
/** How long an answer to a question may take, ms. */
const ANSWERS = 3000;
/** How long a board may stand still with lines unanswered, ms. */
const STANDS = 2500;
/** How long a board may be silent in work, ms. */
const SILENT = 4000;
/** How long after a reset of the page's the board may start, ms. */
const RESTARTS = 3000;
/** The least count of bytes that are no text from a port that has no Grbl: a bootloader talks, or the baud rate is wrong. */
const NOISE = 200;

export class Board {
  known = new Known();
  #reader = new LineReader();
  #serial;
  /** @type {"waking" | "asking" | "ready" | "gone"} */
  #phase = "waking";
  /** Lines without an answer. @type {string[]} */
  #sent = [];
  #answers = 0;
  /** Lines of the page that wait while the board is asked. */
  #held = "";
  /** @type {{lines: string[], done: (lines: string[]) => void} | null} */
  #question = null;
  /** Whether the settings may have changed. */
  #isStale = true;
  /** Reports of a machine at rest since the last line or answer. */
  #still = 0;
  #stoodSince = 0;
  #opened = performance.now();
  #heard = 0;
  #polled = 0;
  #reports = 0;
  #noise = 0;
  #isSilent = false;
  /** Whether the page knows the board. */
  #isGreeted = false;
  #timer = 0;
  /** The place before a restart. @type {Place | null} */
  #before;
  #hasStarted = false;
  #resetAt = -Infinity;
  /** Moves that are drawn, and where the last one ends. */
  #moves = 0;
  #drawn = "";

  /**
   * @param {BoardEars} ears
   * @param {Port} port
   * @param {Words} words
   * @param {Place | null} before the place that this board had when its cable was pulled
   */
  constructor(ears, port, words, before) {
    this.ears = ears;
    this.words = words;
    this.name = nameOf(port);
    this.#before = before;
    this.#serial = new Serial(port, {bytes: (bytes) => this.#bytes(bytes), gone: () => this.#gone()});
  }

  /** @param {number} baud */
  async open(baud) {
    await this.#serial.open(baud);
    this.baud = baud;
    this.#opened = performance.now();
    this.#timer = setInterval(() => this.#tick(), POLL);
  }

  /** Whether lines go out. */
  get isOpen() {
    return this.#phase === "asking" || this.#phase === "ready";
  }

  /** @returns {Place | null} */
  get place() {
    const {position, rests} = this.known;
    return position.length ? {position, rests: rests && this.#sent.length === 0, own: false} : this.#before;
  }

  async close() {
    this.#phase = "gone";
    clearInterval(this.#timer);
    await this.#serial.close();
  }

  /**
   * @param {number} tag
   * @param {Uint8Array | string} [content] lines as a string, single bytes that act at once as bytes
   */
  send(tag, content = "") {
    if (tag !== TO.WIRE || !this.isOpen) return;
    if (typeof content !== "string") this.#press(content);
    else if (this.#phase === "asking") this.#held += content;
    else this.#write(content);
  }

  /** @param {Uint8Array} bytes */
  #press(bytes) {
    if (bytes.includes(RESET)) {
      this.#resetAt = performance.now();
      this.#before = {position: this.known.position, rests: this.known.rests, own: true};
    }
    this.#serial.write(bytes);
  }

  /** @param {string} text lines */
  #write(text) {
    const lines = text.split("\n").slice(0, -1);
    for (const line of lines) {
      this.#sent.push(line);
      if (/G0*10\s*L|G0*92(?![.\d])/i.test(line)) this.known.doubt = "";
    }
    this.#still = 0;
    this.#stoodSince = 0;
    // A byte beyond ASCII would act at once, wherever it stands: Grbl takes it for a command.
    this.#serial.write(new TextEncoder().encode(text.replace(/[^\n\x20-\x7e]/g, "_")));
  }

  /** The place is right: a person has said so. */
  trust() {
    this.known.doubt = "";
    this.#tell();
  }

  #tick() {
    const now = performance.now();
    if (this.#phase === "waking") {
      const wakes = this.#hasStarted || now - this.#opened > WAKES;
      if (now - this.#opened > GIVES_UP) return this.#giveUp();
      if (!wakes) return;
    } else if (now - this.#heard > SILENT && !/^Home/.test(this.known.name) && !this.#sent.some((line) => /^\$H/i.test(line))) {
      this.#isSilent = true;
      this.ears.silent(`The board has not answered for ${((now - this.#heard) / 1000).toFixed(0)} s.`);
    }
    // One question at a time: a line by radio, or a board that homes, answers late.
    if (this.#polled > this.#reports && now - this.#heard < 1000 && this.#phase !== "waking") return;
    this.#polled = this.#reports + 1;
    this.#serial.write(Uint8Array.of(0x3f));
  }

  #giveUp() {
    this.close();
    const why = this.#noise > NOISE ? "What comes from the port is no text: another baud rate?" : `Nothing answers at ${this.baud} baud.`;
    this.ears.opened(false, `${why} Connect again with another port or baud rate.`);
  }

  #gone() {
    this.#before = this.place;
    this.#phase = "gone";
    clearInterval(this.#timer);
    this.ears.opened(false, "The board is gone: its cable is unplugged, or it has no power.");
  }

  /** @param {Uint8Array} bytes */
  #bytes(bytes) {
    this.#heard = performance.now();
    this.#noise += bytes.filter((byte) => byte > 0x7e || byte === 0).length;
    this.#reader.read(bytes, (line) => this.#line(line));
  }

  /** @param {string} line */
  #line(line) {
    const report = reportOf(line);
    if (report) return this.#report(report);
    if (isBanner(line)) this.#start(line);
    else if (this.#phase === "waking") return;
    if (line.startsWith("ALARM:")) this.#alarm(line);
    else if (line.startsWith("[MSG:")) this.known.say(line.slice(5, -1));
    else if (this.#question) {
      if (isAnswer(line)) this.#answered();
      else this.#question.lines.push(line);
      return;
    }
    const number = this.#answers;
    if (isAnswer(line)) {
      const answered = this.#sent.shift();
      this.#answers++;
      this.#still = 0;
      this.#stoodSince = 0;
      if (answered && /^\s*\$\s*(\d+\s*=|RST)/i.test(answered)) this.#isStale = true;
    }
    this.ears.frame(FROM.WIRE, {channel: 0, fromMachine: true, number, bytes: new TextEncoder().encode(`${line}\n`)});
  }

  #answered() {
    const question = this.#question;
    this.#question = null;
    question?.done(question.lines);
  }

  /** @param {string} line */
  #alarm(line) {
    this.known.alarm = line;
    const code = Number(line.slice(6));
    if (code === 1 || code === 3 || code > 5) this.known.doubt = this.words.faults[line]?.[0] ?? line;
  }

  /** The board has started: all that it had is lost. @param {string} banner */
  #start(banner) {
    this.#hasStarted = true;
    if (this.#phase === "waking") this.known.version = banner.match(/^\S+ (\S+)/)?.[1] ?? "";
    const isOwn = performance.now() - this.#resetAt < RESTARTS;
    if (this.#phase !== "waking" && !isOwn) this.#before = {position: this.known.position, rests: false, own: false};
    this.#sent = [];
    this.#held = "";
    this.#still = 0;
    this.#stoodSince = 0;
    this.#isStale = true;
    this.#answered();
  }

  /** @param {import("grbl").Report} report */
  #report(report) {
    const {known} = this;
    this.#reports++;
    if (this.#isSilent) this.ears.silent("");
    this.#isSilent = false;
    const homed = known.name.startsWith("Home") && report.name === "Idle";
    known.take(report);
    if (homed) known.doubt = "";
    if (this.#hasStarted) this.#judge();
    this.#still = known.rests && this.#sent.length === 0 ? this.#still + 1 : 0;
    if (this.#phase === "waking") return void this.#greet();
    if (this.#phase === "gone" || !this.#isGreeted) return;
    this.#watch();
    if (this.#isStale && this.#phase === "ready" && this.#sent.length === 0 && this.#mayAsk) this.#askAgain();
    this.#tell();
  }

  /** Judges, after a start of the board, whether its place is still right. */
  #judge() {
    this.#hasStarted = false;
    const [before, now] = [this.#before, this.known.position];
    this.#before = null;
    if (!before || before.position.length === 0) return;
    const isSame = before.position.every((place, axis) => place === now[axis]);
    if (before.own && before.rests && isSame) return;
    this.known.doubt = before.own ? "it was reset in motion, and may have lost steps" : "the board has started anew, and has forgotten it";
  }

  /** Whether the board answers questions: in motion it refuses them. */
  get #mayAsk() {
    return this.known.name === "Idle" || (this.known.name === "Alarm" && this.known.message !== "Reset to continue");
  }

  /** Looks for answers that will not come: the board stands still, has room for everything, and lines have no answer. */
  #watch() {
    const {known} = this;
    const now = performance.now();
    const {free, most} = known;
    const isBusy = free !== null && (free.bytes < most.bytes || free.blocks < most.blocks);
    if (this.#sent.length === 0 || !/^(Idle|Check)/.test(known.name) || isBusy) {
      this.#stoodSince = 0;
      return;
    }
    this.#stoodSince ||= now;
    if (now - this.#stoodSince < STANDS + dwells(this.#sent)) return;
    const lines = this.#sent.length;
    this.#sent = [];
    this.#stoodSince = 0;
    this.ears.lost(lines);
  }

  #tell() {
    const state = this.known.state(this.#still > 1, performance.now() / 1000);
    this.#draw(state);
    this.ears.frame(FROM.STATE, {...state, moves: this.#moves, done: this.#moves});
  }

  /** Draws the way to a new place: as exact as the reports are frequent. @param {import("state").State} state */
  #draw({position, spindle, power}) {
    const place = position.slice(0, 3);
    if (String(place) === this.#drawn) return;
    const kind = this.#drawn === "" ? JUMP : spindle > 0 && this.known.name !== "Jog" && (!this.known.setting(32) || power > 0) ? CUT : TRAVEL;
    this.#drawn = String(place);
    const move = new DataView(new ArrayBuffer(MOVE));
    place.forEach((mm, axis) => move.setFloat32(4 * axis, mm, true));
    move.setUint8(16, kind);
    move.setUint8(17, Math.round(power * 255));
    this.ears.frame(FROM.MOVES, {first: this.#moves, moves: new Uint8Array(move.buffer)});
    this.#moves++;
  }

  async #greet() {
    this.#phase = "asking";
    if (this.#mayAsk) await this.#askAll();
    if (!this.isOpen) return;
    this.#isGreeted = true;
    this.ears.opened(true, "");
    this.ears.frame(FROM.HELLO, this.#hello());
    this.ears.frame(FROM.ROLE, {controls: true, senders: []});
    this.#tellSettings();
    this.#tell();
    this.#goOn();
  }

  async #askAgain() {
    this.#phase = "asking";
    this.#isStale = false;
    this.known.list(await this.#ask("$$"));
    this.#tellSettings();
    this.#goOn();
  }

  async #askAll() {
    this.#isStale = false;
    this.known.build(await this.#ask("$I"));
    this.known.list(await this.#ask("$$"));
    this.known.zero(await this.#ask("$#"), await this.#ask("$G"));
  }

  /** Sends what has waited. */
  #goOn() {
    if (this.#phase === "asking") this.#phase = "ready";
    const held = this.#held;
    this.#held = "";
    if (held) this.#write(held);
  }

  /** Asks; answers the lines before the answer, none if it does not come. @param {string} line @returns {Promise<string[]>} */
  #ask(line) {
    return new Promise((resolve) => {
      if (this.#phase === "gone") return resolve([]);
      const question = {lines: /** @type {string[]} */ ([]), done: resolve};
      this.#question = question;
      this.#serial.write(new TextEncoder().encode(`${line}\n`));
      setTimeout(() => {
        if (this.#question !== question) return;
        this.#question = null;
        this.#isStale = true;
        resolve([]);
      }, ANSWERS);
    });
  }

  #hello() {
    const {known} = this;
    const name = `${known.isForeign ? "" : "Grbl "}${known.version}`.trim();
    /** @type {Hello} */
    const hello = {
      name: `${name} · ${this.name}`, version: known.version, axes: known.axes, motors: known.axes.length, second: null,
      receive_buffer: known.most.bytes || 128, normally_closed: false, channel: 0, work: "cut", faults: this.words.faults, board: true,
    };
    return hello;
  }

  #tellSettings() {
    const described = new Map(this.words.settings.map((one) => [one.number, one]));
    const all = [...this.known.settings].map(([number, value]) => {
      const row = this.known.isForeign && number > 140 ? undefined : described.get(number);
      return {number, name: row?.name ?? "", unit: row?.unit ?? "", description: row?.description ?? "", range: row?.range ?? "", value};
    });
    this.ears.frame(FROM.SETTINGS, all);
  }
}
