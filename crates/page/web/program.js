// @ts-check
// The job's text: only the lines that are seen are elements.

import {by, make} from "dom";

const HIGH = 20;

export class Program {
  /** @type {string[]} */
  lines = [];
  #now = 0;
  /** @type {Map<number, "error" | "warning">} */
  #marks = new Map();
  #place = by("program");
  #inside = by("program-lines");
  #drawn = "";

  constructor() {
    this.#place.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.#place);
  }

  /** @param {string[]} lines */
  load(lines) {
    this.lines = lines;
    this.#now = 0;
    this.#marks.clear();
    this.#inside.style.height = `${lines.length * HIGH}px`;
    this.#place.scrollTop = 0;
    this.#drawn = "";
    this.draw();
  }

  /** @param {Map<number, "error" | "warning">} marks */
  mark(marks) {
    this.#marks = marks;
    this.#drawn = "";
    this.draw();
  }

  /**
   * Shows which line runs, counted from 1.
   * @param {number} line
   */
  run(line) {
    if (line === this.#now) return;
    this.#now = line;
    if (line > 0 && !this.#place.matches(":hover, :focus")) this.show(line);
    this.draw();
  }

  /** @param {number} line */
  show(line) {
    const at = (line - 1) * HIGH;
    const {scrollTop, clientHeight} = this.#place;
    if (at < scrollTop + HIGH || at > scrollTop + clientHeight - 3 * HIGH) this.#place.scrollTop = at - clientHeight / 3;
  }

  draw() {
    const first = Math.max(Math.floor(this.#place.scrollTop / HIGH) - 4, 0);
    const last = Math.min(first + Math.ceil(this.#place.clientHeight / HIGH) + 8, this.lines.length);
    const drawn = `${first} ${last} ${this.#now}`;
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    const shown = [];
    for (let index = first; index < last; index++) {
      const line = index + 1;
      const row = make("p", {text: this.lines[index] || " ", "data-n": line, style: `top:${index * HIGH}px`});
      const mark = this.#marks.get(line);
      if (mark) row.classList.add(mark);
      if (line === this.#now) row.classList.add("now");
      else if (line < this.#now) row.classList.add("done");
      shown.push(row);
    }
    this.#inside.replaceChildren(...shown);
  }
}
