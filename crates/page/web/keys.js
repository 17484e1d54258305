// @ts-check
// Keys that act wherever a person is on the page: Escape resets what moves, the space bar holds and resumes.

import {hasDialog} from "dom";

const [HOLD, RESUME] = [0x21, 0x7e];

/** @param {{isBusy: () => boolean, reset: () => void, isHeld: () => boolean, press: (byte: number) => void}} machine */
export function listenForKeys({isBusy, reset, isHeld, press}) {
  document.addEventListener("keydown", (event) => {
    // A dialogue that is closed by it is no machine that is stopped.
    if (event.key === "Escape" && isBusy() && !hasDialog()) reset();
    if (event.key !== " " || event.target !== document.body) return;
    event.preventDefault();
    press(isHeld() ? RESUME : HOLD);
  });
}
