// @ts-check
// Keys that act wherever a person is on the page: Escape resets what moves, the space bar holds and resumes.

const [HOLD, RESUME] = [0x21, 0x7e];

/** @param {{isBusy: () => boolean, reset: () => void, isHeld: () => boolean, press: (byte: number) => void}} machine */
export function listenForKeys({isBusy, reset, isHeld, press}) {
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && isBusy()) reset();
    if (event.key !== " " || event.target !== document.body) return;
    event.preventDefault();
    press(isHeld() ? RESUME : HOLD);
  });
}
