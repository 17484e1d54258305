// @ts-check
// A finished job to be looked at: its path, and a slider along its time.

import {Course} from "course";
import {by, duration, make, say} from "dom";
import {mark, marksOf} from "legend";
import {Path} from "scene";
import {View} from "view";

/**
 * What is known of the job beside its moves.
 * @typedef {{title: string, summary: string, work: string, laser: boolean, letters: string[]}} Facts
 */

/** @type {Facts} */
const facts = JSON.parse(by("facts").textContent ?? "");
const path = new Path(Infinity);
path.append(0, bytes("moves"));
const stretches = floats("course");
const course = new Course(stretches, floats("lengths"));
const slider = /** @type {HTMLInputElement} */ (by("slider"));
const view = new View(by("view"), () => markView());
let showsTravels = true;
let now = course.seconds;
/** The frame before while the job is played, ms. @type {number | null} */
let playedAt = null;

/** The data of an element. @param {string} id */
function bytes(id) {
  const text = atob(by(id).textContent ?? "");
  const all = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) all[at] = text.charCodeAt(at);
  return all;
}

/** @param {string} id */
function floats(id) {
  return new Float32Array(bytes(id).buffer);
}

/** Shows the job at a time, s. @param {number} seconds */
function show(seconds) {
  now = Math.min(Math.max(seconds, 0), course.seconds);
  slider.value = String(now / Math.max(course.seconds, 1e-9));
  slider.setAttribute("aria-valuetext", duration(now));
  const {move, share, speed} = course.at(now);
  const isOver = now >= course.seconds;
  const [from, to] = [path.at(Math.max(move - 1, 0)), path.at(move)];
  if (!from || !to) return;
  const part = isOver ? 1 : share;
  const position = [from.x + (to.x - from.x) * part, from.y + (to.y - from.y) * part, from.z + (to.z - from.z) * part];
  const isCut = to.kind === 1 && !isOver;
  view.shown = {
    job: path, trace: path, done: isOver ? path.count : move, position, offset: [0, 0, 0], zero: [0, 0, 0], travel: {low: [0, 0, 0], high: [0, 0, 0]}, softLimits: true,
    laser: facts.laser, power: facts.laser && isCut ? to.power : 0, running: true, travels: showsTravels,
  };
  view.touch();
  const places = position.map((value, axis) => `${facts.letters[axis]} ${value.toFixed(3)}`).join("  ");
  const line = isOver ? "done" : to.line ? `line ${to.line}` : "";
  say(by("now"), `${now.toFixed(2)} s of ${course.seconds.toFixed(2)} s   ${line}   ${places}   ${(speed * 60).toFixed(0)} mm/min`);
  drawChart();
}

/** @param {number} time of the frame, ms */
function play(time) {
  if (playedAt === null) return;
  const pace = Number(/** @type {HTMLSelectElement} */ (by("pace")).value);
  show(now + ((time - playedAt) / 1000) * pace);
  playedAt = time;
  if (now >= course.seconds) return pause();
  requestAnimationFrame(play);
}

function pause() {
  playedAt = null;
  say(by("play"), "Play");
}

function startOrPause() {
  if (playedAt !== null) return pause();
  if (now >= course.seconds) show(0);
  playedAt = performance.now();
  say(by("play"), "Pause");
  requestAnimationFrame(play);
}

/** Draws the speed along time, and where the job is. */
function drawChart() {
  const canvas = /** @type {HTMLCanvasElement} */ (by("chart"));
  const density = window.devicePixelRatio || 1;
  const {width, height} = canvas.getBoundingClientRect();
  [canvas.width, canvas.height] = [Math.round(width * density) || 1, Math.round(height * density) || 1];
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const style = getComputedStyle(document.documentElement);
  pen.setTransform(density, 0, 0, density, 0, 0);
  const most = Math.max(speeds.reduce((a, b) => Math.max(a, b), 0), 1);
  pen.fillStyle = style.getPropertyValue("--chart-power");
  pen.beginPath();
  pen.moveTo(0, height);
  speeds.forEach((speed, at) => pen.lineTo((at / (speeds.length - 1)) * width, height - (speed / most) * (height - 16)));
  pen.lineTo(width, height);
  pen.fill();
  pen.fillStyle = style.getPropertyValue("--soft");
  pen.font = "11px system-ui, sans-serif";
  pen.fillText(`${Math.round(most * 60)} mm/min`, 4, 11);
  pen.fillStyle = style.getPropertyValue("--carriage");
  pen.fillRect((now / Math.max(course.seconds, 1e-9)) * width - 1, 0, 2, height);
}

/** The speed at equal steps of the whole time, mm/s. */
const speeds = Array.from({length: 601}, (_, at) => course.at((course.seconds * at) / 600).speed);

/** @param {"top" | "3d" | "front"} [name] */
function markView(name) {
  for (const one of ["top", "3d", "front"]) by(`view-${one}`).setAttribute("aria-pressed", String(one === (name ?? (view.camera.isFromAbove ? "top" : ""))));
}

/** @param {"top" | "3d" | "front"} name */
function look(name) {
  view.look(name);
  view.fit();
  markView(name);
}

function drawLegend() {
  by("legend").replaceChildren(...marksOf(path, facts.laser, facts.work), mark("var(--carriage)", "tool now"), make("span", {text: "pale: still to come"}));
}

function begin() {
  const root = document.documentElement;
  root.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  document.title = `${facts.title} · leadscrew`;
  say(by("title"), facts.title);
  say(by("summary"), facts.summary);
  slider.addEventListener("input", () => {
    pause();
    // A share of the job, since a browser rounds a time: its end would be a little before the end.
    show(Number(slider.value) * course.seconds);
  });
  /** @type {Record<string, () => void>} */
  const clicks = {
    play: startOrPause, "view-top": () => look("top"), "view-3d": () => look("3d"), "view-front": () => look("front"), "view-fit": () => view.fit(),
    "view-travels": () => {
      showsTravels = !showsTravels;
      by("view-travels").setAttribute("aria-pressed", String(showsTravels));
      show(now);
    },
    theme: () => {
      root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
      drawLegend();
      show(now);
    },
  };
  for (const [id, act] of Object.entries(clicks)) by(id).addEventListener("click", act);
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target !== document.body) return;
    event.preventDefault();
    startOrPause();
  });
  new ResizeObserver(drawChart).observe(by("chart"));
  drawLegend();
  show(0);
  view.fit();
}

begin();
/** For tests: what is shown. */
Object.assign(globalThis, {leadscrew: {shown: () => view.shown, course, show}});
