// @ts-check
// The page: brings the machine's frames to the panels, and what is pressed to the machine.

import {listenForBackups} from "backup";
import {Beginning, lineAt} from "begin";
import {Chart} from "chart";
import {by, make, say, tabs} from "dom";
import {listenForFraming} from "framing";
import {FROM, TO} from "frames";
import {Job} from "job";
import {Jog} from "jog";
import {listenForPorts} from "connect";
import {isBanner} from "grbl";
import {mark, marksOf} from "legend";
import {alarmWords, isUnderWay, needsReset, pauseOf} from "life";
import {Machines} from "machines";
import {Macros} from "macros";
import {Console, Position, SettingsPanel, Switches, buildOverrides, showOverrides} from "panels";
import {Program} from "program";
import {Path, shifted} from "scene";
import {LineReader, Sender, isAnswer} from "sender";
import {Settings} from "state";
import {View} from "view";

/** @typedef {import("state").State} State */
/** @typedef {import("state").Hello} Hello */
/** @typedef {import("state").Role} Role */

const RESET = 0x18;
/** The largest job that is taken: bytes, and lines. */
const LARGEST = 32e6;
const LONGEST = 1e6;

const settings = new Settings();
const job = new Job();
const trace = new Path();
const program = new Program();
const log = new Console();
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
/** When the job of this page began, s. */
let jobBegan = 0;
let showsTravels = true;
let hasFitted = false;
/** Whether the job has been run since it was opened: what it has not done yet is pale. */
let hasRun = false;
/** What the picture shows. */
let shownLast = "";
/** Work zero and settings with which the job was checked. */
let checkedAt = "";
/** Work zero with which the job was checked. @type {number[]} */
let checkedZero = [];

const view = new View(by("view"), () => markView());
const sender = new Sender({send: (text) => link.send(TO.WIRE, text), answered});
const jog = new Jog({
  say: (line) => command(line, false), press,
  machine: () => ({position: state?.position ?? [], travel: settings.travel, softLimits: settings.hasSoftLimits}),
});

/** What each frame brings. @type {Record<number, (content: any) => void>} */
const frames = {
  [FROM.WIRE]: wire,
  [FROM.STATE]: showState,
  [FROM.MOVES]: ({first, moves}) => {
    trace.append(first, moves);
    view.touch();
  },
  [FROM.HELLO]: greet,
  [FROM.ROLE]: takeRole,
  [FROM.NOTE]: (words) => log.add(words, "note"),
  [FROM.SCENE]: (moves) => {
    job.path.append(job.path.first + job.path.count, moves);
    drawLegend();
    show();
    if (!isBusy()) view.fit();
    view.touch();
  },
  [FROM.CHECK]: (found) => {
    program.mark(job.note(found, (line) => program.show(line)));
    show();
    if (!isBusy()) view.fit();
    enable();
  },
  [FROM.PLAIN]: (plain) => {
    job.flatten(plain);
    enable();
  },
  [FROM.TAKEN]: take,
  [FROM.REST]: (found) => beginning.take(found),
  [FROM.PROFILE]: (profile) => {
    job.time(profile);
    enable();
  },
  [FROM.PROGRESS]: (percent) => job.timing(percent),
  [FROM.SETTINGS]: (all) => {
    settings.load(all);
    settingsPanel.load(settings);
    drawLegend();
    show();
  },
};
const link = new Machines({frame: (tag, content) => frames[tag]?.(content), opened, silent, lost});

/** How far the job has come that ends here. */
function account() {
  return isUnderWay(job.life) ? `${job.name}: answered up to line ${sender.last}, sent up to line ${sender.reached}. ` : "";
}

/** Says what a person should know of a board that is silent. @param {string} words */
function silent(words) {
  by("silent").hidden = words === "";
  say(by("silent"), words);
}

/** Answers of the board's are lost: what it has done of these lines is not known. @param {number} lines */
function lost(lines) {
  const words = `An answer is lost: the board stands still, and ${lines} line${lines === 1 ? " has" : "s have"} no answer. ${account()}Nothing more is sent.`;
  job.stop("a lost answer", sender.oldest?.job);
  sender.reset();
  log.add(words, "bad");
  silent(words);
  enable();
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
  sender.reset();
  role = {controls: false, senders: []};
  enable();
}

/** @param {Hello} now */
function greet(now) {
  hello = now;
  job.work = now.work;
  say(by("machine-name"), now.board ? now.name : now.name ? `leadscrew · ${now.name}` : "leadscrew");
  say(by("where"), now.board ? "board" : "simulator");
  document.title = now.name ? `${now.name} · leadscrew` : "leadscrew";
  job.stop("a restart of the machine");
  sender.reset();
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
  const watching = by("watching");
  watching.hidden = now.controls;
  const who = now.senders.length ? `A sender has the machine (${now.senders.join("; ")}).` : "Another page has the machine.";
  say(watching, `${who} This page watches; Hold and Reset work.`);
  if (!now.controls) {
    job.stop("another program");
    sender.reset();
  }
  enable();
}

/** Bytes on a line of the machine's. @param {import("frames").WireFrame} frame */
function wire({channel, fromMachine, number, bytes}) {
  const isOwn = channel === hello?.channel && role.controls;
  const reader = readerOf(channel, fromMachine);
  let answers = 0;
  reader.read(bytes, (line) => {
    if (!fromMachine) {
      if (!isOwn) heardSender(channel, line);
      return;
    }
    if (isAnswer(line)) {
      answers++;
      if (isOwn) sender.answer(line, number + answers);
      else answeredSender(channel, number + answers);
    }
    if (isBanner(line)) {
      if (isOwn && isUnderWay(job.life)) log.add(`The machine was reset. ${account()}`, "bad");
      if (isOwn) job.stop("a reset");
      if (isOwn) {
        sender.reset();
        performing.lines = [];
      }
      jobLines.clear();
    }
    if (!line.startsWith("<") && line !== "ok" && isFirst(channel, line)) log.add(line, /^(error|ALARM)/.test(line) ? "bad" : "heard");
    if (line.startsWith("ALARM:")) {
      // If it is no matter of motion, the machine had come to the oldest line without an answer.
      job.stop(line, Number(line.slice(6)) > 3 ? sender.oldest?.job : undefined);
      sender.stop();
    }
  });
}

/** How long the lines of a message on several channels may be apart, ms. */
const SPREAD = 1000;
/** The channel that brought a line first, and when, ms. @type {Map<string, {channel: number, at: number}>} */
const told = new Map();

/** Whether no other channel has just brought this line: the machine says a message on each. @param {number} channel @param {string} line */
function isFirst(channel, line) {
  const [before, at] = [told.get(line), performance.now()];
  if (before && before.channel !== channel && at - before.at < SPREAD) return false;
  if (told.size > 1000) told.clear();
  told.set(line, {channel, at});
  return true;
}

/** @type {Map<string, LineReader>} */
const readers = new Map();

/** @param {number} channel @param {boolean} fromMachine */
function readerOf(channel, fromMachine) {
  const name = `${channel} ${fromMachine}`;
  const reader = readers.get(name) ?? new LineReader();
  readers.set(name, reader);
  return reader;
}

/** Lines that another sender has sent, and those of them that have been answered. @type {Map<number, {waiting: number[]}>} */
const others = new Map();

/** @param {number} channel @param {string} line */
function heardSender(channel, line) {
  const bare = line.replace(/[?!~\u0080-\uffff]/g, "");
  if (!bare) return;
  if (job.name !== "what the sender sends") {
    job.load("what the sender sends", "");
    job.lines = [];
    say(by("job-facts"), "");
    jobLines.clear();
    others.clear();
  }
  job.lines.push(bare);
  const other = others.get(channel) ?? {waiting: []};
  other.waiting.push(job.lines.length);
  others.set(channel, other);
  if (job.lines.length % 50 === 1) program.load(job.lines);
  else program.lines = job.lines;
}

/** @param {number} channel @param {number} number */
function answeredSender(channel, number) {
  const line = others.get(channel)?.waiting.shift();
  if (line) jobLines.set(number, line);
}

/**
 * A line of this page's has been answered.
 * @param {import("sender").Line} line
 * @param {string} answer
 * @param {number} number
 */
function answered(line, answer, number) {
  if (line.job) jobLines.set(number, line.job);
  else performed(line.text, answer);
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
  const box = by("state");
  say(box, now.name);
  const kind = /^(Run|Jog|Home)/.test(now.name) ? "run" : /^(Hold|Door|Tool)/.test(now.name) ? "hold" : /^(Alarm|Sleep)/.test(now.name) ? "bad" : "idle";
  if (box.dataset.kind !== kind) box.dataset.kind = kind;
  by("alarm").hidden = now.name !== "Alarm";
  if (now.name === "Alarm") say(by("alarm-text"), alarmWords(now, hello?.faults ?? {}, settings.value(22) !== 0));
  by("unlock").hidden = needsReset(now);
  by("alarm-reset").hidden = !needsReset(now);
  const pause = pauseOf(now, sender.oldest?.text ?? "");
  by("pause").hidden = pause === null;
  say(by("pause"), pause ? `${pause.why[0].toUpperCase()}${pause.why.slice(1)}.` : "");
  by("doubt").hidden = now.doubt === "";
  say(by("doubt-text"), now.doubt && `The place is not known: ${now.doubt}. Home the machine, or set zero anew.`);
  position.show(now, settings.isLaser, settings.value(30));
  showOverrides(now);
  switches.show(now);
  if (chart.note(now)) chart.draw();
  followJob(now, pause);
  if (before?.name !== now.name || before.quiet !== now.quiet || before.message !== now.message) enable();
  // The job lies elsewhere now, or the machine takes it otherwise.
  if (now.name === "Idle" && now.quiet && job.checked && !isUnderWay(job.life) && checkedAt !== conditions()) check();
  show();
  if (!hasFitted && settings.byNumber.size) {
    hasFitted = true;
    view.fit();
  }
}

/** @param {State} now @param {import("life").Pause | null} pause */
function followJob(now, pause) {
  const line = jobLines.get(now.running) ?? 0;
  const waits = pause && isUnderWay(job.life) ? sender.oldest?.job : 0;
  if (waits || line) program.run(waits || line);
  const life = job.life;
  if (life.at !== "running" && life.at !== "waiting" && life.at !== "held") return;
  const at = line || sender.oldest?.job || life.line;
  job.share = sender.share;
  if (now.name === "Alarm" || now.name === "Sleep") {
    job.stop(now.alarm || now.name, now.name === "Sleep" ? sender.last : at);
    sender.stop();
  } else if (!sender.isRunning && /^(Idle|Check)$/.test(now.name) && now.quiet) {
    job.enter({at: "done", seconds: now.seconds - jobBegan});
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

/** Draws the picture where something has changed. */
function show() {
  if (!state) return;
  const {done, position, offset, power, spindle, moves} = state;
  const now = JSON.stringify([done, position, offset, zeroOfJob(), spindle && power, moves, trace.edition, job.path.edition, settings.travel, settings.isLaser, showsTravels, hasRun, document.documentElement.dataset.theme]);
  if (now === shownLast) return;
  shownLast = now;
  view.shown = {
    job: job.path, trace, done: state.done, position: state.position, offset: state.offset, zero: zeroOfJob(), travel: settings.travel,
    softLimits: settings.hasSoftLimits, laser: settings.isLaser, power: state.spindle ? state.power : 0,
    running: hasRun, travels: showsTravels,
  };
  view.touch();
}

function enable() {
  const may = role.controls && link.isOpen;
  const name = state?.name ?? "";
  for (const element of document.querySelectorAll(".drive")) /** @type {HTMLButtonElement} */ (element).disabled = !may;
  const free = isFree();
  /** @type {HTMLButtonElement} */ (by("run")).disabled = !may || !free || !job.isSound;
  /** @type {HTMLButtonElement} */ (by("from")).disabled = !may || !free || !job.isSound || !job.profile || !!job.plain;
  /** @type {HTMLButtonElement} */ (by("frame")).disabled = !may || !free || !boxOfJob();
  if (needsReset(state)) /** @type {HTMLButtonElement} */ (by("home")).disabled = true;
  /** @type {HTMLButtonElement} */ (by("check")).disabled = !link.looks || job.text === "";
  for (const id of ["hold", "reset"]) /** @type {HTMLButtonElement} */ (by(id)).disabled = !link.isOpen;
  /** @type {HTMLButtonElement} */ (by("resume")).disabled = !may || !/^(Hold|Door|Tool)/.test(name);
}

/** @param {File} file */
async function open(file) {
  if (isUnderWay(job.life)) return log.add("a job is under way: reset it first", "note");
  if (file.size > LARGEST) return refuse(file.name, `${(file.size / 1e6).toFixed(0)} MB`);
  if (/\.toml$/i.test(file.name)) return change(new Uint8Array(await file.arrayBuffer()));
  const text = await file.text();
  const lines = countLines(text);
  if (lines > LONGEST) return refuse(file.name, `${lines} lines`);
  job.load(file.name, text);
  program.load(job.lines);
  check();
}

/** Refuses a job that is too large for a page. @param {string} name @param {string} size */
function refuse(name, size) {
  discard(`${name} has ${size}. A page takes ${LARGEST / 1e6} MB and ${LONGEST / 1e6} million lines at most: check it with \`leadscrew check\`, and send it with a sender.`);
}

/**
 * Takes the G-code that was made of a dropped file of another machine.
 * @param {{text: string, notes: string[]} | {refused: string}} made
 */
function take(made) {
  // It was dropped on another page.
  if (!job.text) return;
  if ("refused" in made) return discard(made.refused);
  job.load(job.name, made.text, made.notes);
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

/** @param {string} text */
function countLines(text) {
  let count = 1;
  for (let at = text.indexOf("\n"); at >= 0; at = text.indexOf("\n", at + 1)) count++;
  return count;
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
  job.path.clear(0);
  drawLegend();
  checkedAt = conditions();
  checkedZero = state?.offset ?? [];
  say(by("job-facts"), "checking …");
  if (job.life.at !== "done" && job.life.at !== "stopped") job.enter({at: "dropped"});
  link.look({name: job.name}, job.text);
  enable();
}

/** What is done if a person says so all the same. */
let dared = () => {};

/** Does what moves the job; asks first if something is known to be wrong. @param {() => void} act */
function dare(act) {
  const [first, ...more] = job.dangers;
  const doubt = state?.doubt ? `The place is not known: ${state.doubt}. ` : "";
  if (!first && !doubt) return act();
  const danger = first ? `Line ${first.line}: ${first.message}${more.length ? `, and ${more.length} more` : ""}. The machine would run into its end.` : "";
  say(by("ask-text"), doubt + danger);
  dared = act;
  /** @type {HTMLDialogElement} */ (by("ask")).showModal();
}

/** Runs the job from a line on, behind lines that lead there. @param {number} [line] @param {string[]} [ahead] */
function start(line = 1, ahead = []) {
  trace.clear();
  link.send(TO.CLEAR);
  jobLines.clear();
  hasRun = true;
  silent("");
  job.enter({at: "running", line});
  jobBegan = state?.seconds ?? 0;
  log.add(line > 1 ? `${job.name} from line ${line}` : job.name, "sent");
  for (const text of ahead) log.add(text, "sent");
  const {lines, numbers} = job.plain ?? {};
  sender.run(lines ?? job.lines.slice(line - 1), line, ahead, numbers);
  enable();
}

/** The line at which the job stands: where it was stopped, or its first. */
function standsAt() {
  if (job.life.at !== "stopped") return 1;
  const zero = zeroOfJob();
  return lineAt(job.path, zero.map((place, axis) => (state?.position[axis] ?? 0) - place), job.life.line);
}

const beginning = new Beginning({
  job: () => ({lines: job.lines.length, line: standsAt()}),
  ask: (resume) => link.look({name: job.name, resume}, job.text),
  go: (line, preamble) => dare(() => start(line, preamble)),
});

/** Whether nothing is under way. */
function isFree() {
  return state?.name === "Idle" && state.quiet && !isUnderWay(job.life) && !sender.isRunning;
}

/** Lines of a person's that wait for the answer to the one before, and whether an error ends them. */
let performing = {lines: /** @type {string[]} */ ([]), now: "", stops: true};

/**
 * Sends lines of a person's, one after the other, if nothing is under way.
 * @param {string[]} lines
 * @param {string} what
 * @param {boolean} [stops] whether an error ends them
 */
function perform(lines, what, stops = true) {
  if (!isFree()) return log.add(`${what}: the machine is not free`, "note");
  log.add(what, "note");
  performing = {lines: [...lines], now: "", stops};
  performNext();
}

function performNext() {
  performing.now = performing.lines.shift() ?? "";
  if (performing.now && !command(performing.now)) performing.lines = [];
}

/** A line that is none of the job's has been answered. @param {string} line @param {string} answer */
function performed(line, answer) {
  if (line !== performing.now || line === "") return;
  if (answer !== "ok" && performing.stops && performing.lines.length) {
    log.add(`${line}: ${answer}; the lines behind it are not sent: ${performing.lines.join(", ")}`, "bad");
    performing.lines = [];
  }
  performNext();
}

new Macros(({name, lines}) => perform(lines, name));

/** The box of the job, machine coordinates. @returns {import("scene").Box | null} */
function boxOfJob() {
  const {x, y} = job.checked?.extents ?? {};
  const [low, high] = [job.path.box?.low[2] ?? 0, job.path.box?.high[2] ?? 0];
  return x && y ? shifted({low: [x.min, y.min, low], high: [x.max, y.max, high]}, zeroOfJob()) : null;
}

function reset() {
  job.stop("a reset");
  sender.reset();
  press(RESET);
}

function drawLegend() {
  const limits = settings.hasSoftLimits ? "soft limits" : "travel of the axes (soft limits off)";
  by("legend").replaceChildren(...marksOf(job.path, settings.isLaser, job.work), mark("var(--carriage)", "carriage"), mark("var(--box)", limits), make("span", {text: "pale: ahead"}));
}

/** @param {"top" | "3d" | "front"} [name] */
function markView(name) {
  for (const one of ["top", "3d", "front"]) by(`view-${one}`).setAttribute("aria-pressed", String(one === (name ?? (view.camera.isFromAbove ? "top" : ""))));
}

function theme() {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  try {
    localStorage.setItem("theme", root.dataset.theme);
  } catch {
    // A page without storage forgets it.
  }
  drawLegend();
  chart.draw();
  show();
}

function begin() {
  let kept = null;
  try {
    kept = localStorage.getItem("theme");
  } catch {
    // As the system is.
  }
  document.documentElement.dataset.theme = kept ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  /** @type {Record<string, () => void>} */
  const clicks = {
    hold: () => press(0x21), resume: () => press(0x7e), reset, theme, run: () => dare(start), check, home: () => command("$H"), unlock: () => command("$X"), "alarm-reset": reset, "ask-run": () => dared(), trust: () => link.trust(),
    "zero-all": () => command("G10L20P0X0Y0"), "go-zero": () => command("G90G0X0Y0"),
    "view-top": () => look("top"), "view-3d": () => look("3d"), "view-front": () => look("front"), "view-fit": () => view.fit(), "view-machine": () => view.fitMachine(),
    "view-clear": () => {
      trace.clear();
      link.send(TO.CLEAR);
      show();
    },
    "view-travels": () => {
      showsTravels = !showsTravels;
      by("view-travels").setAttribute("aria-pressed", String(showsTravels));
      show();
    },
  };
  for (const [id, act] of Object.entries(clicks)) by(id).addEventListener("click", act);
  const file = /** @type {HTMLInputElement} */ (by("file"));
  file.addEventListener("change", () => file.files?.[0] && open(file.files[0]));
  buildOverrides(press);
  tabs(/** @type {HTMLElement} */ (document.querySelector('[role="tablist"]')));
  by("say").addEventListener("submit", (event) => {
    event.preventDefault();
    const line = /** @type {HTMLInputElement} */ (by("line"));
    if (line.value && command(line.value)) line.value = "";
  });
  listenForFiles();
  listenForFraming({
    box: boxOfJob,
    now: () => ({z: state?.position[2] ?? 0, full: settings.value(30), laser: settings.isLaser, spindle: (state?.spindle ?? 0) > 0, offset: state?.offset[2] ?? 0}),
    go: (lines) => perform(lines, "frame"),
  });
  listenForBackups(settings, (lines, words) => perform(lines, words, false));
  listenForPorts(link, () => !isUnderWay(job.life));
  window.addEventListener("beforeunload", (event) => {
    if (link.hasBoard && isUnderWay(job.life)) event.preventDefault();
  });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && isBusy()) reset();
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.key === " " && target === document.body) {
      event.preventDefault();
      press(state?.name.startsWith("Hold") ? 0x7e : 0x21);
    }
  });
  drawLegend();
  enable();
}

/** @param {"top" | "3d" | "front"} name */
function look(name) {
  view.look(name);
  view.fit();
  markView(name);
}

function listenForFiles() {
  let depth = 0;
  const over = (/** @type {number} */ change) => {
    depth = Math.max(depth + change, 0);
    by("drop").hidden = depth === 0;
  };
  document.addEventListener("dragenter", () => over(1));
  document.addEventListener("dragleave", () => over(-1));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    over(-depth);
    const file = event.dataTransfer?.files[0];
    if (file) open(file);
  });
}

begin();
/** For tests: the script time of the last picture. */
Object.assign(globalThis, {leadscrew: {cost: () => view.cost, draw: () => view.draw(), state: () => state, trace, job}});
