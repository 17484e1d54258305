// @ts-check
// Lines of a person's that are no job: they go out one after the other, each when the one before is answered.

/** A line, or what makes it when its turn comes; `null` ends them all. @typedef {string | (() => string | null)} Step */

/** Lines that are named if they are not sent. */
const NAMED = 8;

/**
 * @typedef {object} Machine
 * @property {(line: string) => boolean} send answers whether it could
 * @property {() => boolean} isFree whether nothing is under way
 * @property {(words: string, kind: "note" | "bad") => void} log
 * @property {() => void} ended no more lines are on the way
 */

export class Performer {
  /** @type {Step[]} */
  #steps = [];
  #now = "";
  #stops = true;
  /** The modes in force before, as `$G` tells them. */
  #modes = "";
  /** What puts those modes back that lines have left which ended early: it goes out when the machine takes it. @type {string[]} */
  #owed = [];
  /** @type {(isWhole: boolean) => void} */
  #ended = () => {};
  /** How many reports told of a machine that does not jog, since a line waits for that. @type {{still: number} | null} */
  #waiting = null;

  /** @param {Machine} machine */
  constructor(machine) {
    this.machine = machine;
  }

  /** Whether lines are on the way. */
  get isBusy() {
    return this.#now !== "";
  }

  /**
   * Sends lines if nothing is under way.
   * @param {Step[]} steps
   * @param {string} what
   * @param {{stops?: boolean, ended?: (isWhole: boolean) => void}} [how] `stops`: an error ends them; `ended`: whether all were sent and taken
   */
  do(steps, what, {stops = true, ended = () => {}} = {}) {
    if (this.isBusy || !this.machine.isFree()) {
      this.machine.log(`${what}: the machine is not free`, "note");
      return ended(false);
    }
    this.machine.log(what, "note");
    [this.#steps, this.#stops, this.#ended] = [[...steps], stops, ended];
    this.#next();
  }

  /** Sends lines in mm, and puts the modes back that were in force, an alarm or not. @param {Step[]} steps @param {string} what @param {(isWhole: boolean) => void} [ended] */
  inMillimetres(steps, what, ended = () => {}) {
    this.#modes = "";
    const back = () => `G0${["G20", "G91"].filter((mode) => this.#modes.split(" ").includes(mode)).join("")}`;
    this.do(["$G", "G21G90G94", ...steps, "G90", back], what, {
      ended: (isWhole) => {
        if (!isWhole && this.#modes) this.#owed = ["G90", back()];
        ended(isWhole);
      },
    });
  }

  /** Hears a line of the machine's. @param {string} line */
  hear(line) {
    if (this.isBusy && line.startsWith("[GC:")) this.#modes = line;
  }

  #next() {
    const step = this.#steps.shift() ?? "";
    const before = this.#now;
    const line = typeof step === "function" ? step() : step;
    if (line === null) return this.#end(false);
    this.#now = line;
    if (this.#now === "") return this.#end(true);
    // A jog is answered when it begins, and a machine that jogs takes nothing but jogs.
    if (before.startsWith("$J=") && !this.#now.startsWith("$J=")) this.#waiting = {still: 0};
    else this.#send();
  }

  #send() {
    this.#waiting = null;
    if (!this.machine.send(this.#now)) this.stop();
  }

  /** Follows the machine's reports. @param {string} state */
  follow(state) {
    if (this.#owed.length && state === "Idle" && this.machine.isFree()) {
      const owed = this.#owed;
      this.#owed = [];
      this.do(owed, "the modes as before");
    }
    if (!this.#waiting) return;
    this.#waiting.still = state.startsWith("Jog") ? 0 : this.#waiting.still + 1;
    if (this.#waiting.still > 1) this.#send();
  }

  /** @param {boolean} isWhole */
  #end(isWhole) {
    const ended = this.#ended;
    [this.#steps, this.#now, this.#waiting, this.#ended] = [[], "", null, () => {}];
    ended(isWhole);
    this.machine.ended();
  }

  /** Sends nothing more. */
  stop() {
    if (this.isBusy) this.#end(false);
  }

  /** Leaves the modes as they are. */
  forget() {
    this.#owed = [];
  }

  /** A line that is none of the job's has been answered. @param {string} line @param {string} answer */
  answered(line, answer) {
    if (line !== this.#now || line === "" || this.#waiting) return;
    if (answer === "ok" || !this.#stops) return this.#next();
    const left = this.#steps.filter((step) => typeof step === "string");
    const more = left.length > NAMED ? `, and ${left.length - NAMED} more` : "";
    if (left.length) this.machine.log(`${line}: ${answer}; the lines behind it are not sent: ${left.slice(0, NAMED).join(", ")}${more}`, "bad");
    this.stop();
  }
}
