// @ts-check
// The state above all, and the banners below it: what the machine waits for, and what is wrong.

import {by, say} from "dom";
import {alarmWords, needsReset} from "life";

/**
 * @param {import("state").State} now
 * @param {import("life").Pause | null} pause
 * @param {import("state").Hello["faults"]} faults
 * @param {boolean} homes whether the machine has homing
 */
export function showHead(now, pause, faults, homes) {
  const box = by("state");
  say(box, now.name);
  const kind = /^(Run|Jog|Home)/.test(now.name) ? "run" : /^(Hold|Door|Tool)/.test(now.name) ? "hold" : /^(Alarm|Sleep)/.test(now.name) ? "bad" : "idle";
  if (box.dataset.kind !== kind) box.dataset.kind = kind;
  by("alarm").hidden = now.name !== "Alarm";
  if (now.name === "Alarm") say(by("alarm-text"), alarmWords(now, faults, homes));
  by("unlock").hidden = needsReset(now);
  by("alarm-reset").hidden = !needsReset(now);
  by("pause").hidden = pause === null;
  say(by("pause"), pause ? `${pause.why[0].toUpperCase()}${pause.why.slice(1)}.` : "");
  by("doubt").hidden = now.doubt === "";
  say(by("doubt-text"), now.doubt && `The place is not known: ${now.doubt}. Home the machine, or set zero anew.`);
}

/** Says who has the machine, if this page has not. @param {import("state").Role} role */
export function showRole({controls, senders}) {
  by("watching").hidden = controls;
  const who = senders.length ? `A sender has the machine (${senders.join("; ")}).` : "Another page has the machine.";
  say(by("watching"), `${who} This page watches; Hold and Reset work.`);
}

/** Says what a person should know of a board that is silent. @param {string} words */
export function showSilence(words) {
  by("silent").hidden = words === "";
  say(by("silent"), words);
}
