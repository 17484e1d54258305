// @ts-check
// What is asked and shown beside the panels: each dialogue gets what it needs of the page.

import {listenForBackups} from "backup";
import {Beginning, lineAt} from "begin";
import {listenForPorts} from "connect";
import {Corner} from "corner";
import {listenForFraming} from "framing";
import {Heights} from "heights";
import {isUnderWay} from "life";
import {Macros} from "macros";
import {shifted} from "scene";
import {Touch} from "touch";

/**
 * @typedef {object} Page
 * @property {() => import("state").State | null} state
 * @property {import("state").Settings} settings
 * @property {import("job").Job} job
 * @property {import("machines").Machines} link
 * @property {import("perform").Performer} performer
 * @property {import("picture").Picture} picture
 * @property {() => boolean} isFree whether nothing is under way
 * @property {() => number[]} zero of the job, machine coordinates
 * @property {(line: number, preamble: string[]) => void} begin runs the job from a line on
 */

export class Dialogues {
  /** @param {Page} page */
  constructor(page) {
    const {settings, job, link, performer, picture, isFree} = page;
    this.page = page;
    const now = () => {
      const state = page.state();
      return {position: state?.position ?? [0, 0, 0], offset: state?.offset ?? [0, 0, 0], spindle: (state?.spindle ?? 0) > 0, unit: settings.unit};
    };
    this.beginning = new Beginning({
      job: () => ({lines: job.lines.length, line: this.#standsAt()}),
      ask: (resume) => link.look({name: job.name, resume}, job.text),
      go: page.begin,
    });
    new Macros(({name, lines}) => performer.do(lines, name));
    /** @type {Touch} */
    this.touch = new Touch({
      probe: (steps) => this.touch.isChange ? performer.do(steps, "touch off") : performer.inMillimetres(steps, "touch off"),
      here: (line) => this.touch.isChange ? performer.do([`G21${line}`], "touch off") : performer.inMillimetres([line], "touch off"),
    });
    this.heights = new Heights({
      box: () => this.box(), isFree, now,
      go: (steps, ended) => performer.inMillimetres(steps, "height map", ended),
      bend: (level) => link.look({name: job.name, level}, job.level),
      changed: () => {
        picture.drawLegend();
        picture.show();
      },
    });
    this.corner = new Corner({isFree, now, go: (steps, ended) => performer.inMillimetres(steps, "corner or hole", ended)});
    listenForFraming({
      box: () => this.box(),
      now: () => ({z: now().position[2], full: settings.value(30), laser: settings.isLaser, spindle: now().spindle, offset: now().offset[2]}),
      go: (lines) => performer.do(lines, "frame"),
    });
    listenForBackups(settings, (lines, words) => performer.do(lines, words, {stops: false}));
    listenForPorts(link, () => !isUnderWay(job.life));
  }

  /** The box of the job, machine coordinates. @returns {import("scene").Box | null} */
  box() {
    const {job} = this.page;
    const {x, y} = job.checked?.extents ?? {};
    const [low, high] = [job.path.box?.low[2] ?? 0, job.path.box?.high[2] ?? 0];
    return x && y ? shifted({low: [x.min, y.min, low], high: [x.max, y.max, high]}, this.page.zero()) : null;
  }

  /** The line at which the job stands: where it was stopped, or its first. */
  #standsAt() {
    const {job} = this.page;
    if (job.life.at !== "stopped") return 1;
    const position = this.page.state()?.position ?? [];
    return lineAt(job.path, this.page.zero().map((place, axis) => (position[axis] ?? 0) - place), job.life.line);
  }

  /** Hears a line of the machine's. @param {string} line */
  hear(line) {
    this.heights.hear(line);
    this.corner.hear(line);
    this.touch.hear(line, this.page.settings.unit.mm);
  }

  /** The machine may have become free. */
  follow() {
    this.heights.follow();
    this.corner.follow();
  }
}
