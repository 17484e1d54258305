// @ts-check
// A job's life, and what the machine waits for: the one account of both, made of what the wire says.

import {duration} from "dom";

/** @typedef {import("state").State} State */

/**
 * @typedef {{at: "none"} | {at: "dropped"} | {at: "checked"}
 *   | {at: "running", line: number} | {at: "waiting", line: number, why: string} | {at: "held", line: number, why: string}
 *   | {at: "stopped", by: string, line: number} | {at: "done", seconds: number}} Life
 */

/** @typedef {{kind: "waiting" | "held", why: string}} Pause */

/** Whether lines of the job are on the way, or moves of it. @param {Life} life */
export function isUnderWay(life) {
  return life.at === "running" || life.at === "waiting" || life.at === "held";
}

/**
 * What the machine waits for; `null` if it does not.
 * @param {State} state
 * @param {string} line the oldest line of the job without an answer; empty if there is none
 * @returns {Pause | null}
 */
export function pauseOf(state, line) {
  const [name, phase] = state.name.split(":");
  if (name === "Door") return door(phase);
  if (name === "Hold" || name === "Tool") return asked(state, line) ?? {kind: "held", why: "Resume goes on"};
  const code = line.replace(/\(.*?\)|;.*/g, "");
  if (state.feed === 0 && !state.quiet && !/G0*4(?![.\d])/i.test(code)) {
    const cold = state.heaters.filter((heater) => heater.target > 0 && heater.now < heater.target - 1);
    if (cold.length) return {kind: "waiting", why: `heating: ${cold.map(({name, now, target}) => `${name} ${now.toFixed(0)} of ${target.toFixed(0)} °C`).join(", ")}`};
  }
  return null;
}

/** @param {string} phase @returns {Pause} */
function door(phase) {
  const why = phase === "1" ? "the door is open: close it, then Resume" : phase === "0" ? "the door is closed: Resume goes on" : "the door is open";
  return {kind: "waiting", why};
}

/** The tool that a message asks for. @param {string} message */
export function toolOf(message) {
  const tool = message.match(/^Tool (\d+)(?:: (.*))?, then ~$/);
  return tool && {number: tool[1], words: tool[2] ?? ""};
}

/** What a program asks of a person. @param {State} state @param {string} line @returns {Pause | null} */
function asked(state, line) {
  const tool = toolOf(state.message);
  if (tool) return {kind: "waiting", why: `insert tool ${tool.number}${tool.words && `, ${tool.words}`}, then Resume`};
  const comment = line.match(/\((.*?)\)|;(.*)/);
  const words = (comment?.[1] ?? comment?.[2] ?? "").trim();
  if (!/M0*[01](?!\d)/i.test(line.replace(/\(.*?\)|;.*/g, ""))) return null;
  return {kind: "waiting", why: `the program pauses${words ? `, ${words}` : ""}: Resume goes on`};
}

/**
 * The account in words.
 * @param {Life} life
 * @param {{lines: number, left: number | null, errors: number, seconds: number | null, timed: string}} job `left` and `seconds`: if they are known
 */
export function words(life, job) {
  switch (life.at) {
    case "none": case "dropped": return "";
    case "checked": return job.errors ? `${job.errors} error${job.errors === 1 ? "" : "s"}` : job.seconds === null ? `timing … ${job.timed}` : `takes ${duration(job.seconds)}`;
    case "running": return `line ${life.line} of ${job.lines}${job.left === null ? "" : `, ${duration(job.left)} left`}`;
    case "waiting": return `line ${life.line} of ${job.lines}: ${life.why}`;
    case "held": return `held at line ${life.line} of ${job.lines}: ${life.why}`;
    case "stopped": return `stopped by ${life.by} at line ${life.line}`;
    case "done": return `done in ${life.seconds.toFixed(1)} s${job.seconds === null ? "" : `, ${duration(job.seconds)} without pauses`}`;
  }
}

/**
 * What is known of an alarm and what leads out of it.
 * @param {State} state
 * @param {Record<string, [string, string]>} faults
 * @param {boolean} homes whether the machine has homing
 */
export function alarmWords(state, faults, homes) {
  const out = needsReset(state) ? "" : homes ? "Home it, or unlock it." : "Unlock it.";
  const own = /to unlock$|^Reset to continue$/.test(state.message) ? "" : state.message;
  const fault = faults[state.alarm];
  const what = fault ? `${state.alarm}: ${fault[0]}. ${fault[1]}` : "The machine is locked.";
  return [what, own, out].filter(Boolean).join(" ");
}

/** Whether nothing but a reset leads out of the alarm. @param {State | null} state */
export function needsReset(state) {
  return state?.name === "Alarm" && state.message === "Reset to continue";
}
