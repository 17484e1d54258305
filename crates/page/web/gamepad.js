// @ts-check
// A gamepad jogs for as long as a stick or an arrow of it is held. It does nothing until a person turns it on.

import {by, hasDialog} from "dom";

/** How far a stick is pushed before it counts: worn sticks rest beside their middle. */
const DEAD = 0.4;
/** Between two looks, ms. */
const LOOK = 40;

/** The ways in which a gamepad is pushed, as the standard mapping has its parts. @param {Gamepad} pad */
export function waysOf({axes, buttons}) {
  const stick = (/** @type {number} */ axis) => (Math.abs(axes[axis] ?? 0) > DEAD ? Math.sign(axes[axis]) : 0);
  const arrows = (/** @type {number} */ low, /** @type {number} */ high) => Number(buttons[high]?.pressed ?? false) - Number(buttons[low]?.pressed ?? false);
  const named = (/** @type {string} */ axis, /** @type {number} */ sign) => (sign ? [`${axis}${sign > 0 ? "+" : "-"}`] : []);
  const [x, y] = [stick(0) || arrows(14, 15), -stick(1) || arrows(13, 12)];
  const z = -stick(3);
  // X and Y go together; Z goes alone.
  return x || y ? [...named("X", x), ...named("Y", y)] : named("Z", z);
}

/**
 * @param {object} hands
 * @param {(ways: string[]) => boolean} hands.begin jogs until the end; answers whether it could begin
 * @param {() => void} hands.end
 */
export function listenForGamepads({begin, end}) {
  const box = /** @type {HTMLInputElement} */ (by("jog-gamepad"));
  /** What is held, and whether it rested since it was turned on: a stick that is pushed then moves nothing. */
  let [held, hasRested] = ["", false];
  let timer = 0;
  const rest = () => {
    if (held) end();
    held = "";
  };
  const look = () => {
    const pads = document.hasFocus() && !document.hidden && !hasDialog() ? navigator.getGamepads() : null;
    const ways = [...(pads ?? [])].filter((pad) => pad !== null).map(waysOf).find((one) => one.length) ?? [];
    if (!pads) hasRested = false;
    else if (!ways.length) hasRested = true;
    const now = hasRested ? ways.join(" ") : "";
    if (now === held) return;
    if (held) return rest();
    if (begin(ways)) held = now;
  };
  box.addEventListener("change", () => {
    clearInterval(timer);
    rest();
    hasRested = false;
    if (box.checked) timer = setInterval(look, LOOK);
  });
}
