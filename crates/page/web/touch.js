// @ts-check
// Touch off: Z of work is set where the tip of the tool is, by the probe or by hand; of its own accord when the job asks for a tool.

import {by, say} from "dom";
import {contactOf} from "grbl";
import {toolOf} from "life";
import {mmIn} from "units";

/** @typedef {import("state").State} State */
/** @typedef {import("sender").Line} Line */

/** How far the tool goes up from the plate, mm, and how fast during a tool change, mm/min. */
const OFF = 3;
const OFF_FEED = 600;

/**
 * Lines that probe for Z. Zero is set above the place of contact: the tool has gone farther, by the way in which it brakes.
 * @param {{plate: number, down: number, feed: number}} how `plate`: its thickness, mm; `down`: how far the tool may go, mm
 * @param {() => number} contact Z of contact, machine coordinates, mm
 * @param {boolean} isChange whether it is a tool change, in which nothing but jogs moves
 * @returns {import("perform").Step[]}
 */
export function linesDown({plate, down, feed}, contact, isChange) {
  const above = () => `Z${(contact() + OFF).toFixed(3)}`;
  const up = () => isChange ? `$J=G53G90G21${above()}F${OFF_FEED}` : `G53G0${above()}`;
  return ["G21G91", `G38.2Z${-down}F${feed}`, up, `G21G10L20P0Z${plate + OFF}`];
}

export class Touch {
  #panel = by("touch");
  #isOpen = false;
  /** The tool change under way: the line that has it, and its message. @type {{line: Line, message: string} | null} */
  #change = null;
  #contact = 0;

  /** @param {{probe: (steps: import("perform").Step[]) => void, here: (line: string) => void}} machine */
  constructor(machine) {
    const value = (/** @type {string} */ id) => mmIn(`touch-${id}`) || 0;
    by("touch-open").addEventListener("click", () => {
      this.#isOpen = !this.#isOpen;
      this.#show();
      if (!this.#isOpen) return;
      this.#panel.focus();
      this.#panel.scrollIntoView({block: "nearest"});
    });
    this.#panel.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !this.#isOpen) return;
      this.#isOpen = false;
      by("touch-open").focus();
      this.#show();
    });
    by("touch-probe").addEventListener("click", () => {
      const [down, feed] = [Math.abs(value("down")), value("feed")];
      if (down > 0 && feed > 0) machine.probe(linesDown({plate: value("plate"), down, feed}, () => this.#contact, this.isChange));
    });
    by("touch-here").addEventListener("click", () => machine.here(`G10L20P0Z${value("plate")}`));
  }

  /** Hears a line of the machine's. @param {string} line @param {number} mm in a unit of its reports */
  hear(line, mm) {
    this.#contact = contactOf(line, mm)?.[2] ?? this.#contact;
  }

  /** Whether the machine is a person's until Resume. */
  get isChange() {
    return this.#change !== null;
  }

  /**
   * Follows the machine; the message of a tool change is kept while a person jogs.
   * @param {State} state
   * @param {Line | null} line the oldest without an answer
   */
  follow(state, line) {
    const waits = /^(Hold|Tool)/.test(state.name);
    if (waits && line && toolOf(state.message)) this.#change = {line, message: state.message};
    else if (this.#change && (this.#change.line !== line || state.name === "Alarm")) this.#change = null;
    else if (this.#change && waits) state.message = this.#change.message;
    this.#show();
  }

  #show() {
    const tool = this.#change && toolOf(this.#change.message);
    this.#panel.hidden = !this.#isOpen && !tool;
    by("touch-open").setAttribute("aria-expanded", String(!this.#panel.hidden));
    say(by("touch-title"), tool ? `Tool ${tool.number}${tool.words && `: ${tool.words}`}` : "Touch off");
    by("touch-change").hidden = !tool;
  }
}
