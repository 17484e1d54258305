// @ts-check
// Asks a person before the machine does what is known to go wrong.

import {by, say} from "dom";

/** Does something at once if there are no words against it, else if a person says so. @param {string} words @param {() => void} act */
export function ask(words, act) {
  if (words === "") return act();
  say(by("ask-text"), words);
  by("ask-run").onclick = act;
  /** @type {HTMLDialogElement} */ (by("ask")).showModal();
}
