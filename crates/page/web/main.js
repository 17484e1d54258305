// @ts-check
// The page: brings the machine's frames to the panels, and what is pressed to the machine.

import {ask} from "ask";
import {Chart} from "chart";
import {Dialogues} from "dialogues";
import {by, download, say, tabs} from "dom";
import {listenForFiles} from "files";
import {FROM, TO} from "frames";
import {enableAll} from "enable";
import {showHead, showRole, showSilence} from "head";
import {Job} from "job";
import {Jog} from "jog";
import {isBanner} from "grbl";
import {listenForKeys} from "keys";
import {isUnderWay, pauseOf} from "life";
import {Machines} from "machines";
import {Console, Position, SettingsPanel, Switches, buildOverrides, showOutputs, showOverrides} from "panels";
import {Overheard} from "overheard";
import {Performer} from "perform";
import {Picture} from "picture";
import {Program} from "program";
import {Path} from "scene";
import {Scrub} from "scrub";
import {Sender, isAnswer} from "sender";
import {Settings} from "state";
import {listenForTheme} from "theme";
import {measure} from "units";

/** @typedef {import("state").State} State */
/** @typedef {import("state").Hello} Hello */
/** @typedef {import("state").Role} Role */

const RESET = 0x18;
const settings = new Settings();
const job = new Job();
const trace = new Path();
const program = new Program();
const log = new Console((line) => command(line));
const chart = new Chart(/** @type {HTMLCanvasElement} */ (by("chart")));
const position = new Position();
const switches = new Switches();
const settingsPanel = new SettingsPanel((line) => command(line));
/** @type {Hello | null} */
let hello = null;
/** @type {Role} */
let role = {controls: false, senders: []};
/** @type {State | null} */
let state = null;
/** Line of the job by the machine's number of it. @type {Map<number, number>} */
const jobLines = new Map();
const overheard = new Overheard(job, program, jobLines);
/** When the job of this page began, s. */
let jobBegan = 0;
let hasFitted = false;
/** Whether the job has been run since it was opened: what it has not done yet is pale. */
let hasRun = false;
/** Work zero and settings with which the job was checked. */
let checkedAt = "";
/** Work zero with which the job was checked. @type {number[]} */
let checkedZero = [];

const scrub = new Scrub(() => picture.show());
/** @type {Picture} */
const picture = new Picture({
  job, trace, settings, now: () => ({state, zero: zeroOfJob(), looked: scrub.place(), map: dialogues.heights.map, hasRun}),
  clear: () => link.send(TO.CLEAR),
});
const sender = new Sender({send: (text) => link.send(TO.WIRE, text), answered});
const jog = new Jog({
  say: (line) => command(line, false), press,
  machine: () => ({position: state?.position ?? [], travel: settings.travel, softLimits: settings.hasSoftLimits, jogs: state?.name === "Jog"}),
});

/** What each frame brings. @type {Record<number, (content: any) => void>} */
const frames = {
  [FROM.WIRE]: wire,
  [FROM.STATE]: showState,
  [FROM.MOVES]: ({first, moves}) => {
    trace.append(first, moves);
    picture.view.touch();
  },
  [FROM.HELLO]: greet,
  [FROM.ROLE]: takeRole,
  [FROM.NOTE]: (words) => log.add(words, "note"),
  // What was checked comes at once behind the last moves: a picture of each part would take longer than all of it.
  [FROM.SCENE]: (moves) => job.path.append(job.path.first + job.path.count, moves),
  [FROM.CHECK]: (found) => {
    program.mark(job.note(found, (line) => program.show(line)));
    picture.drawLegend();
    picture.show();
    if (!isBusy()) picture.view.fit();
    picture.view.touch();
    enable();
  },
  [FROM.PLAIN]: (plain) => {
    job.flatten(plain);
    enable();
  },
  [FROM.TAKEN]: take,
  [FROM.REST]: (found) => dialogues.beginning.take(found),
  [FROM.PROFILE]: (profile) => {
    job.time(profile);
    scrub.load(job.path, profile.course);
    enable();
  },
  [FROM.PROGRESS]: (percent) => job.timing(percent),
  [FROM.SETTINGS]: (all) => {
    settings.load(all);
    settingsPanel.load(settings);
    measure(settings.unit);
    jog.measure(settings.unit);
    job.unit = chart.unit = settings.unit;
    chart.draw();
    picture.drawLegend();
    picture.show();
  },
};
const link = new Machines({frame: (tag, content) => frames[tag]?.(content), opened, silent: showSilence, lost});

/** How far the job has come that ends here. */
function account() {
  return isUnderWay(job.life) ? `${job.name}: answered up to line ${sender.last}, sent up to line ${sender.reached}. ` : "";
}

/** Answers of the board's are lost: what it has done of these lines is not known. @param {number} lines */
function lost(lines) {
  const words = `An answer is lost: the board stands still, and ${lines} line${lines === 1 ? " has" : "s have"} no answer. ${account()}Nothing more is sent.`;
  job.stop("a lost answer", sender.oldest?.job);
  letGo();
  log.add(words, "bad");
  showSilence(words);
  enable();
}

/** Forgets all lines that are on the way: nobody answers them any more. */
function letGo() {
  sender.reset();
  performer.stop();
}

/** The machine has forgotten its modes, or is another one. */
function startAnew() {
  letGo();
  performer.forget();
}

/** @param {boolean} isOpen @param {string} why it is not */
function opened(isOpen, why) {
  by("link").hidden = isOpen;
  say(by("where"), link?.hasBoard ? "board" : "simulator");
  if (isOpen) return;
  say(by("link"), link?.hasBoard ? `${why} ${account()}` : why);
  if (link?.hasBoard && isUnderWay(job.life)) log.add(`${why} ${account()}The board may go on with the lines that it has.`, "bad");
  say(by("state"), "not connected");
  by("state").dataset.kind = "bad";
  job.stop("the loss of the connection");
  letGo();
  role = {controls: false, senders: []};
  enable();
}

/** @param {Hello} now */
function greet(now) {
  if (now.name !== hello?.name || now.board !== hello.board) performer.forget();
  hello = now;
  job.work = now.work;
  say(by("machine-name"), now.board ? now.name : now.name ? `leadscrew · ${now.name}` : "leadscrew");
  say(by("where"), now.board ? "board" : "simulator");
  document.title = now.name ? `${now.name} · leadscrew` : "leadscrew";
  job.stop("a restart of the machine");
  letGo();
  jobLines.clear();
  sender.room = Math.max(now.receive_buffer - 1, 16);
  trace.clear(0);
  position.build(now.axes, (axis) => command(`G10L20P0${axis}0`));
  switches.build(now, (key) => link.send(TO.KEY, new Uint8Array([key])));
  jog.build(now.axes);
  enable();
}

/** @param {Role} now */
function takeRole(now) {
  role = now;
  showRole(now);
  if (!now.controls) {
    job.stop("another program");
    startAnew();
  }
  enable();
}

/** Bytes on a line of the machine's. @param {import("frames").WireFrame} frame */
function wire({channel, fromMachine, number, bytes}) {
  const isOwn = channel === hello?.channel && role.controls;
  const reader = overheard.reader(channel, fromMachine);
  let answers = 0;
  reader.read(bytes, (line) => {
    if (!fromMachine) {
      if (!isOwn) overheard.sent(channel, line);
      return;
    }
    if (isAnswer(line)) {
      answers++;
      if (isOwn) sender.answer(line, number + answers);
      else overheard.answered(channel, number + answers);
    }
    if (isBanner(line)) {
      if (isOwn && isUnderWay(job.life)) log.add(`The machine was reset. ${account()}`, "bad");
      if (isOwn) job.stop("a reset");
      if (isOwn) startAnew();
      jobLines.clear();
    }
    if (!line.startsWith("<") && line !== "ok" && overheard.isFirst(channel, line)) log.add(line, /^(error|ALARM)/.test(line) ? "bad" : "heard");
    // An alarm is told on each line of the machine's, and stops what is under way with the first.
    if (isOwn || line.startsWith("ALARM:")) dialogues.hear(line);
    if (isOwn) performer.hear(line);
    if (line.startsWith("ALARM:")) {
      performer.stop();
      // If it is no matter of motion, the machine had come to the oldest line without an answer.
      job.stop(line, Number(line.slice(6)) > 3 ? sender.oldest?.job : undefined);
      sender.stop();
    }
  });
}

/**
 * A line of this page's has been answered.
 * @param {import("sender").Line} line
 * @param {string} answer
 * @param {number} number
 */
function answered(line, answer, number) {
  if (line.job) jobLines.set(number, line.job);
  else performer.answered(line.text, answer);
  if (answer === "ok") return;
  if (line.text.startsWith("$")) settingsPanel.restore(settings);
  if (!line.job) return;
  sender.stop();
  const words = hello?.faults[answer]?.[0];
  job.stop(words ? `${answer} (${words})` : answer, line.job);
  program.mark(new Map([[line.job, "error"]]));
  program.show(line.job);
}

/**
 * Sends a line; answers whether this page may.
 * @param {string} line
 * @param {boolean} [shows] whether it is shown in the console
 */
function command(line, shows = true) {
  if (!role.controls || !link.isOpen) return false;
  if (shows) log.add(line, "sent");
  sender.say(line);
  return true;
}

/** Sends a realtime byte. @param {number} byte */
function press(byte) {
  link.send(TO.WIRE, new Uint8Array([byte]));
}

function isBusy() {
  return state !== null && !/^(Idle|Alarm|Check|Sleep)/.test(state.name);
}

/** @param {State} now */
function showState(now) {
  const before = state;
  state = now;
  dialogues.touch.follow(now, sender.first);
  sender.isAside = dialogues.touch.isChange;
  performer.follow(now.name);
  const pause = pauseOf(now, sender.oldest?.text ?? "");
  showHead(now, pause, hello?.faults ?? {}, settings.value(22) !== 0);
  position.show(now, settings.isLaser, settings.value(30), settings.unit);
  showOverrides(now);
  showOutputs(now, (line) => command(line));
  switches.show(now);
  if (chart.note(now)) chart.draw();
  followJob(now, pause);
  if (before?.name !== now.name || before.quiet !== now.quiet || before.message !== now.message) enable();
  // The job lies elsewhere now, or the machine takes it otherwise.
  if (now.name === "Idle" && now.quiet && job.checked && !isUnderWay(job.life) && checkedAt !== conditions()) check();
  picture.show();
  if (!hasFitted && settings.byNumber.size) {
    hasFitted = true;
    picture.view.fit();
  }
}

/** @param {State} now @param {import("life").Pause | null} pause */
function followJob(now, pause) {
  const line = jobLines.get(now.running) ?? 0;
  const waits = pause && isUnderWay(job.life) ? sender.oldest?.job : 0;
  if (job.life.at !== "done" && (waits || line)) program.run(waits || line);
  const life = job.life;
  if (life.at !== "running" && life.at !== "waiting" && life.at !== "held") return;
  const at = line || sender.oldest?.job || life.line;
  job.share = sender.share;
  if (now.name === "Alarm" || now.name === "Sleep") {
    job.stop(now.alarm || now.name, now.name === "Sleep" ? sender.last : at);
    sender.stop();
  } else if (!sender.isRunning && /^(Idle|Check)$/.test(now.name) && now.quiet) {
    job.enter({at: "done", seconds: now.seconds - jobBegan});
    program.run(program.lines.length + 1);
  } else if (pause) {
    job.enter({at: pause.kind, line: sender.oldest?.job ?? at, why: pause.why});
  } else {
    job.enter({at: "running", line: at});
  }
  if (!isUnderWay(job.life)) enable();
}

/** What the findings about a job depend on. */
function conditions() {
  return `${state?.offset.join()} ${settings.edition}`;
}

/** Where the job has its own zero, machine coordinates. */
function zeroOfJob() {
  const moved = job.checked?.zero_moved ?? [];
  return [0, 1, 2].map((axis) => (checkedZero[axis] ?? state?.offset[axis] ?? 0) + (moved[axis] ?? 0));
}

function enable() {
  enableAll({
    may: role.controls && link.isOpen, isOpen: link.isOpen, looks: link.looks, free: isFree(), state, job, hasBox: dialogues.box() !== null,
  });
  dialogues.follow();
  scrub.show(job.profile !== null && !isUnderWay(job.life));
}

/**
 * Takes the G-code that was made of a dropped file of another machine, or of the job by a height map.
 * @param {{text: string, notes: string[], level?: true} | {refused: string, level?: true}} made
 */
function take(made) {
  // It was dropped on another page.
  if (!job.text) return;
  if (made.level) dialogues.heights.bent("refused" in made ? made.refused : undefined);
  if (made.level && "refused" in made) return;
  if ("refused" in made) return discard(made.refused);
  const flat = made.level ? job.level : null;
  job.load(job.name, made.text, made.notes);
  job.flat = flat;
  program.load(job.lines);
  say(by("job-facts"), "checking …");
  job.enter({at: "dropped"});
  for (const note of made.notes) log.add(note, "note");
}

/** Discards the job; says why. @param {string} words */
function discard(words) {
  job.load("", "");
  program.load([]);
  job.lines = [];
  say(by("job-name"), "No job.");
  say(by("job-facts"), words);
  log.add(words, "bad");
  enable();
}

/** Changes the machine for that of a file. @param {Uint8Array} file */
function change(file) {
  if (!link.change(file)) return log.add(link.hasBoard ? "a board is connected: it has its own settings" : "this machine is behind a server: its file is told by --machine", "note");
  hasFitted = false;
  if (job.text) check();
}

function check() {
  hasRun = false;
  job.forget();
  scrub.load(null);
  job.path.clear(0);
  picture.drawLegend();
  checkedAt = conditions();
  checkedZero = state?.offset ?? [];
  say(by("job-facts"), "checking …");
  if (job.life.at !== "done" && job.life.at !== "stopped") job.enter({at: "dropped"});
  link.look({name: job.name}, job.text);
  enable();
}

/** Does what moves the job; asks first if something is known to be wrong. @param {() => void} act */
function dare(act) {
  ask((state?.doubt ? `The place is not known: ${state.doubt}. ` : "") + job.danger, act);
}

/** Runs the job from a line on, behind lines that lead there. @param {number} [line] @param {string[]} [ahead] */
function start(line = 1, ahead = []) {
  trace.clear();
  link.send(TO.CLEAR);
  jobLines.clear();
  hasRun = true;
  showSilence("");
  job.enter({at: "running", line});
  jobBegan = state?.seconds ?? 0;
  log.add(line > 1 ? `${job.name} from line ${line}` : job.name, "sent");
  for (const text of ahead) log.add(text, "sent");
  const {lines, numbers} = job.plain ?? {};
  sender.run(lines ?? job.lines.slice(line - 1), line, ahead, numbers);
  enable();
}

/** Whether nothing is under way. @returns {boolean} */
function isFree() {
  return state?.name === "Idle" && state.quiet && !isUnderWay(job.life) && !sender.isRunning && !performer.isBusy;
}

/** @type {Performer} */
const performer = new Performer({
  send: (line) => command(line),
  isFree: () => isFree() || (dialogues.touch.isChange && /^(Hold|Tool)/.test(state?.name ?? "")),
  log: (words, kind) => log.add(words, kind),
  ended: enable,
});

/** @type {Dialogues} */
const dialogues = new Dialogues({state: () => state, settings, job, link, performer, picture, isFree, zero: zeroOfJob, begin: (line, preamble) => dare(() => start(line, preamble))});

function reset() {
  job.stop("a reset");
  letGo();
  press(RESET);
}

function begin() {
  listenForTheme(() => {
    picture.drawLegend();
    chart.draw();
    picture.show();
  });
  /** @type {Record<string, () => void>} */
  const clicks = {
    hold: () => press(0x21), resume: () => press(0x7e), reset, run: () => dare(start), check, save: () => download(job.name, job.text), home: () => command("$H"), unlock: () => command("$X"), "alarm-reset": reset, trust: () => link.trust(),
    "zero-all": () => command("G10L20P0X0Y0"), "go-zero": () => command("G90G0X0Y0"),
  };
  for (const [id, act] of Object.entries(clicks)) by(id).addEventListener("click", act);
  buildOverrides(press);
  tabs(/** @type {HTMLElement} */ (document.querySelector('[role="tablist"]')));
  listenForFiles({
    isFree: () => !isUnderWay(job.life) || void log.add("a job is under way: reset it first", "note"),
    machine: change, refused: discard,
    job: (name, text) => {
      job.load(name, text);
      program.load(job.lines);
      check();
    },
  });
  window.addEventListener("beforeunload", (event) => {
    if (link.hasBoard && isUnderWay(job.life)) event.preventDefault();
  });
  listenForKeys({isBusy, reset, isHeld: () => state?.name.startsWith("Hold") === true, press});
  picture.drawLegend();
  enable();
}

begin();
/** For tests. */
Object.assign(globalThis, {leadscrew: {cost: () => picture.view.cost, drawn: () => picture.view.drawn, draw: () => picture.view.draw(), state: () => state, shown: () => picture.view.shown, trace, job}});
