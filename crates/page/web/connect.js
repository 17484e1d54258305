// @ts-check
// The dialogue in which a board is connected: a port, a baud rate.

import {by, lead, make, say} from "dom";
import {nameOf, ports} from "serial";

/** @typedef {import("machines").Machines} Machines */
/** @typedef {import("serial").Port} Port */

/** Under which name the browser keeps the baud rate. */
const KEPT = "baud";

/**
 * @param {Machines} machines
 * @param {() => boolean} isFree whether no job is under way
 */
export function listenForPorts(machines, isFree) {
  const dialog = /** @type {HTMLDialogElement} */ (by("ports"));
  const baud = /** @type {HTMLSelectElement} */ (by("baud"));
  const kept = localStorageItem(KEPT);
  if ([...baud.options].some(({value}) => value === kept)) baud.value = kept;

  /** @param {Port} port */
  const connect = (port) => {
    dialog.close();
    try {
      localStorage.setItem(KEPT, baud.value);
    } catch {
      // A page without storage forgets it.
    }
    machines.connect(port, Number(baud.value)).catch(() => {});
  };
  /** @param {Port[]} known */
  const show = (known) => {
    by("ports-known").replaceChildren(...known.map((port) => make("button", {type: "button", class: "go", text: `Connect ${nameOf(port)}`, onclick: () => connect(port)})));
    for (const button of dialog.querySelectorAll("button:not([value])")) /** @type {HTMLButtonElement} */ (button).disabled = !isFree();
  };
  by("connect").addEventListener("click", async () => {
    const all = ports();
    by("ports-choose").hidden = by("baud-row").hidden = all === null;
    by("ports-leave").hidden = !machines.hasBoard;
    say(by("ports-text"), !all ? "This browser has no Web Serial. Chrome, Edge and Opera on a desktop computer have it." : isFree() ? "" : "A job is under way: reset it first.");
    show([]);
    // At once: while there is no dialogue, Escape stops the machine.
    lead(dialog, by("connect"));
    if (all) show(await all.getPorts());
  });
  by("ports-choose").addEventListener("click", () => {
    // Who chooses nothing connects nothing.
    ports()?.requestPort().then(connect, () => {});
  });
  by("ports-leave").addEventListener("click", () => {
    dialog.close();
    machines.leave();
  });
}

/** @param {string} name */
function localStorageItem(name) {
  try {
    return localStorage.getItem(name) ?? "";
  } catch {
    return "";
  }
}
