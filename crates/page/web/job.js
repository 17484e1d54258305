// @ts-check
// The job: its text, what the check has found, how long it takes, how far it has come.

import {by, make, say} from "dom";
import {isUnderWay, words} from "life";
import {Path} from "scene";

/**
 * @typedef {object} Finding
 * @property {number} line
 * @property {number | null} column
 * @property {string} message
 * @property {string} [kind]
 * @property {number} [code]
 * @property {string} text
 */
/**
 * What `leadscrew check --json` says.
 * @typedef {object} Check
 * @property {number} lines
 * @property {Finding[]} errors
 * @property {number} error_count
 * @property {Finding[]} warnings
 * @property {Record<string, {min: number, max: number}> | null} extents
 * @property {number} cut_mm
 * @property {number} travel_mm
 * @property {number[]} tools
 * @property {number[]} pauses
 * @property {number[]} zero_moved how far the job itself moves its zero, mm
 * @property {object[]} [branches] only of a program
 */
/** @typedef {{lines?: string[], numbers?: number[], refused?: string}} Plain what a program comes to, each with its line of the file; or why it cannot be told */
/**
 * What `leadscrew profile --json` says.
 * @typedef {object} Profile
 * @property {number} job_seconds
 * @property {{limit: string, because: string, held_by: string, seconds: number, share: number}[]} limits
 * @property {{line: number, seconds: number}[]} line_times
 * @property {[number, number][]} course lines and seconds in the order of time; line 0 at rest
 */

/** @typedef {import("life").Life} Life */

/** Findings of one cause that are listed. */
const LISTED = 5;

export class Job {
  name = "";
  /** @type {string[]} */
  lines = [];
  text = "";
  /** Its text before it was bent; `null` if it is as it came. @type {string | null} */
  flat = null;
  /** What the tool does: `cut` or `extruded`. */
  work = "cut";
  /** The unit that lengths are told in. @type {import("state").Unit} */
  unit = {mm: 1, name: "mm", digits: 3};
  /** How the file was taken, if it is not G-code. @type {string[]} */
  notes = [];
  path = new Path(Infinity);
  /** @type {Check | null} */
  checked = null;
  /** The plain lines of a program. @type {Plain | null} */
  plain = null;
  /** How much of a program has been answered, 0 to 1. */
  share = 0;
  /** @type {Profile | null} */
  profile = null;
  /** @type {Life} */
  life = {at: "none"};
  /** Time up to the end of each line, s. */
  #until = new Float64Array();
  /** How much of it is timed. */
  #timed = "";

  /**
   * @param {string} name
   * @param {string} text
   * @param {string[]} [notes]
   */
  load(name, text, notes = []) {
    this.name = name;
    this.text = text;
    this.flat = null;
    this.notes = notes;
    this.lines = text.replace(/\r\n?/g, "\n").replace(/\n$/, "").split("\n");
    this.path.clear(0);
    this.forget();
    say(by("job-name"), name);
    say(by("job-facts"), "");
    this.enter({at: "none"});
  }

  /** Enters a part of its life. @param {Life} life */
  enter(life) {
    this.life = life;
    this.#tell();
  }

  /** Ends it by a cause; what has ended stays as it is. @param {string} by @param {number} [line] */
  stop(by, line) {
    const life = this.life;
    if (life.at === "running" || life.at === "waiting" || life.at === "held") this.enter({at: "stopped", by, line: line ?? life.line});
  }

  #tell() {
    const {life} = this;
    const bar = /** @type {HTMLProgressElement} */ (by("progress"));
    const all = this.#until.at(-1) ?? 0;
    let left = null;
    bar.hidden = !isUnderWay(life);
    if (life.at === "running" || life.at === "waiting" || life.at === "held") {
      const done = this.plain ? this.share : all > 0 ? this.#until[Math.max(life.line - 1, 0)] / all : life.line / this.lines.length;
      bar.value = done;
      if (all > 0) left = (1 - done) * all;
    }
    say(by("job-time"), words(life, {lines: this.lines.length, left, errors: this.checked?.error_count ?? 0, seconds: this.profile?.job_seconds ?? null, timed: this.#timed}));
  }

  /** What is known to go wrong, in words: the machine would run into its end; else empty. */
  get danger() {
    const [first, ...more] = this.checked?.warnings.filter(({kind}) => kind === "outside_travel") ?? [];
    return first ? `Line ${first.line}: ${first.message}${more.length ? `, and ${more.length} more` : ""}. The machine would run into its end.` : "";
  }

  /** Forgets what was found. */
  forget() {
    this.checked = null;
    this.plain = null;
    this.profile = null;
    this.#until = new Float64Array();
    by("findings").replaceChildren();
    by("binds").hidden = true;
    this.#timed = "";
    this.#tell();
  }

  /**
   * @param {Check} check
   * @param {(line: number) => void} show
   * @returns {Map<number, "error" | "warning">} lines with findings
   */
  note(check, show) {
    this.checked = check;
    const length = (/** @type {number} */ value) => round(value / this.unit.mm);
    const size = Object.entries(check.extents ?? {}).map(([axis, {min, max}]) => `${axis.toUpperCase()} ${length(min)} … ${length(max)}`);
    const plural = (/** @type {number} */ count, /** @type {string} */ word) => `${count} ${word}${count === 1 ? "" : "s"}`;
    const facts = [plural(check.lines, "line"), `${length(check.cut_mm)} ${this.unit.name} ${this.work}`, `${length(check.travel_mm)} ${this.unit.name} travel`, ...size];
    if (check.tools.length) facts.push(`tools ${check.tools.join(", ")}`);
    if (check.pauses.length) facts.push(plural(check.pauses.length, "pause"));
    say(by("job-facts"), facts.join(" · "));
    if (this.life.at === "dropped") this.enter({at: "checked"});
    /** @type {Map<number, "error" | "warning">} */
    const marks = new Map();
    const list = [];
    const notes = this.notes.map((text) => make("li", {class: "note", text}));
    for (const [kind, all] of /** @type {["error" | "warning", Finding[]][]} */ ([["warning", check.warnings], ["error", check.errors]])) {
      for (const one of all) marks.set(one.line, kind);
      list.unshift(...grouped(all).map(({one, more}) => make("li", {}, [
        make("button", {class: kind, text: `Line ${one.line}: ${one.message}${more ? `, and ${more} more` : ""}`, onclick: () => show(one.line)})])));
    }
    by("findings").replaceChildren(...notes, ...list);
    return marks;
  }

  /** What is bent by a map: its text as it came, of a program its plain lines. */
  get level() {
    return this.flat ?? this.plain?.lines?.join("\n") ?? this.text;
  }

  /** Whether it may be sent: it has no error, and of a program the plain lines are known. */
  get isSound() {
    return this.text !== "" && this.checked?.errors.length === 0 && (!this.checked.branches || !!this.plain?.lines);
  }

  /** @param {Plain} plain */
  flatten(plain) {
    this.plain = plain;
    if (plain.refused) by("findings").append(make("li", {class: "note", text: `This program cannot be run from a page: ${plain.refused}.`}));
  }

  /** @param {Profile} profile */
  time(profile) {
    this.profile = profile;
    this.#until = new Float64Array(this.lines.length + 1);
    for (const {line, seconds} of profile.line_times) if (line < this.#until.length) this.#until[line] = seconds;
    for (let line = 1; line < this.#until.length; line++) this.#until[line] += this.#until[line - 1];
    const rows = profile.limits.slice(0, 8).map((one) => make("tr", {}, [
      make("td", {class: "bar-cell", style: `--share:${(one.share * 100).toFixed(1)}%`, text: [one.limit, one.because].filter(Boolean).join(", ")}),
      make("td", {text: `${(one.share * 100).toFixed(1)} %`}), make("td", {text: one.held_by})]));
    by("binds").querySelector("tbody")?.replaceChildren(...rows);
    by("binds").hidden = rows.length === 0;
    this.#tell();
  }

  /** How much of it is timed. @param {string} percent */
  timing(percent) {
    this.#timed = `${percent} %`;
    this.#tell();
  }
}

/**
 * The first findings of each cause; the last of them says how many more there are.
 * @param {Finding[]} all
 */
function grouped(all) {
  /** @type {Map<string, {one: Finding, more: number}[]>} */
  const causes = new Map();
  for (const one of all) {
    const cause = String(one.kind ?? one.code);
    const listed = causes.get(cause) ?? [];
    if (listed.length < LISTED) listed.push({one, more: 0});
    else listed[LISTED - 1].more++;
    causes.set(cause, listed);
  }
  return [...causes.values()].flat();
}

/** @param {number} value */
function round(value) {
  return Math.round(value * 100) / 100;
}
