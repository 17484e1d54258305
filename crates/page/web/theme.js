// @ts-check
// Light or dark: as the system is, until a person chooses. The browser keeps it.

import {by} from "dom";

/** Under which name the browser keeps it. */
const KEPT = "theme";

/** @param {() => void} changed */
export function listenForTheme(changed) {
  const root = document.documentElement;
  let kept = null;
  try {
    kept = localStorage.getItem(KEPT);
  } catch {
    // As the system is.
  }
  root.dataset.theme = kept ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  by("theme").addEventListener("click", () => {
    root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem(KEPT, root.dataset.theme);
    } catch {
      // A page without storage forgets it.
    }
    changed();
  });
}
