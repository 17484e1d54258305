// @ts-check
// Light or dark: as the system is, until a person chooses. The browser keeps it.

import {by} from "dom";

/** Under which name the browser keeps it. */
const KEPT = "theme";

/** What a person has chosen; `null` if none has. */
function kept() {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    // As the system is.
    return null;
  }
}

/** @param {() => void} changed */
export function listenForTheme(changed) {
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  let chosen = kept();
  const show = () => {
    root.dataset.theme = chosen ?? (system.matches ? "dark" : "light");
  };
  show();
  system.addEventListener("change", () => {
    show();
    changed();
  });
  by("theme").addEventListener("click", () => {
    chosen = root.dataset.theme === "dark" ? "light" : "dark";
    show();
    try {
      localStorage.setItem(KEPT, chosen);
    } catch {
      // A page without storage forgets it.
    }
    changed();
  });
}
