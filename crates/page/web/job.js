// @ts-check
// The job: its text, what the check has found, how long it takes, how far it has come.

import {by, duration, make, say} from "dom";
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
 */
/**
 * What `leadscrew profile --json` says.
 * @typedef {object} Profile
 * @property {number} job_seconds
 * @property {{limit: string, because: string, held_by: string, seconds: number, share: number}[]} limits
 * @property {{line: number, seconds: number}[]} line_times
 */

/** Findings of one cause that are listed. */
const LISTED = 5;

export class Job {
  name = "";
  /** @type {string[]} */
  lines = [];
  text = "";
  path = new Path(Infinity);
  /** @type {Check | null} */
  checked = null;
  /** @type {Profile | null} */
  profile = null;
  /** Time up to the end of each line, s. */
  #until = new Float64Array();

  /**
   * @param {string} name
   * @param {string} text
   */
  load(name, text) {
    this.name = name;
    this.text = text;
    this.lines = text.replace(/\r\n?/g, "\n").replace(/\n$/, "").split("\n");
    this.path.clear(0);
    this.forget();
    say(by("job-name"), name);
    say(by("job-facts"), "checking …");
    by("progress").hidden = true;
  }

  /** Forgets what was found. */
  forget() {
    this.checked = null;
    this.profile = null;
    this.#until = new Float64Array();
    by("findings").replaceChildren();
    by("binds").hidden = true;
    say(by("job-time"), "");
  }

  /**
   * @param {Check} check
   * @param {(line: number) => void} show
   * @returns {Map<number, "error" | "warning">} lines with findings
   */
  note(check, show) {
    this.checked = check;
    const size = Object.entries(check.extents ?? {}).map(([axis, {min, max}]) => `${axis.toUpperCase()} ${round(min)} … ${round(max)}`);
    const plural = (/** @type {number} */ count, /** @type {string} */ word) => `${count} ${word}${count === 1 ? "" : "s"}`;
    const facts = [plural(check.lines, "line"), `${round(check.cut_mm)} mm cut`, `${round(check.travel_mm)} mm travel`, ...size];
    if (check.tools.length) facts.push(`tools ${check.tools.join(", ")}`);
    if (check.pauses.length) facts.push(plural(check.pauses.length, "pause"));
    say(by("job-facts"), facts.join(" · "));
    if (!this.profile) say(by("job-time"), check.error_count ? plural(check.error_count, "error") : "timing …");
    /** @type {Map<number, "error" | "warning">} */
    const marks = new Map();
    const list = [];
    for (const [kind, all] of /** @type {["error" | "warning", Finding[]][]} */ ([["warning", check.warnings], ["error", check.errors]])) {
      for (const one of all) marks.set(one.line, kind);
      list.unshift(...grouped(all).map(({one, more}) => make("li", {}, [
        make("button", {class: kind, text: `Line ${one.line}: ${one.message}${more ? `, and ${more} more` : ""}`, onclick: () => show(one.line)})])));
    }
    by("findings").replaceChildren(...list);
    return marks;
  }

  /** @param {Profile} profile */
  time(profile) {
    this.profile = profile;
    say(by("job-time"), `takes ${duration(profile.job_seconds)}`);
    this.#until = new Float64Array(this.lines.length + 1);
    for (const {line, seconds} of profile.line_times) if (line < this.#until.length) this.#until[line] = seconds;
    for (let line = 1; line < this.#until.length; line++) this.#until[line] += this.#until[line - 1];
    const rows = profile.limits.slice(0, 8).map((one) => make("tr", {}, [
      make("td", {class: "bar-cell", style: `--share:${(one.share * 100).toFixed(1)}%`, text: [one.limit, one.because].filter(Boolean).join(", ")}),
      make("td", {text: `${(one.share * 100).toFixed(1)} %`}), make("td", {text: one.held_by})]));
    by("binds").querySelector("tbody")?.replaceChildren(...rows);
    by("binds").hidden = rows.length === 0;
  }

  /**
   * Shows how far the job has come.
   * @param {number} line that runs, from 1; 0 where none does
   * @param {boolean} isRunning
   */
  progress(line, isRunning) {
    const bar = /** @type {HTMLProgressElement} */ (by("progress"));
    if (!isRunning || line < 1) return;
    bar.hidden = false;
    const all = this.#until.at(-1) ?? 0;
    const done = all > 0 ? this.#until[line - 1] / all : line / this.lines.length;
    bar.value = done;
    const left = all > 0 ? `, ${duration((1 - done) * all)} left` : "";
    say(by("job-time"), `line ${line} of ${this.lines.length}${left}`);
  }

  /** @param {string} text how it ended */
  end(text) {
    by("progress").hidden = true;
    say(by("job-time"), this.profile ? `${text}, ${duration(this.profile.job_seconds)} without pauses` : text);
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
