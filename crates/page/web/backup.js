// @ts-check
// The settings as a file: lines as `$$` prints them.

import {by, download} from "dom";

/** @typedef {import("state").Settings} Settings */

/**
 * The lines of a file that change a setting of this machine, and the numbers that it has not.
 * @param {string} text
 * @param {Settings} settings
 */
export function changes(text, settings) {
  const lines = [];
  const unknown = [];
  for (const [, number, value] of text.matchAll(/^\s*\$(\d+)\s*=\s*([-+.\d]+)/gm)) {
    const now = settings.byNumber.get(Number(number));
    if (!now) unknown.push(`$${number}`);
    else if (Number(now.value) !== Number(value)) lines.push(`$${number}=${value}`);
  }
  // Soft limits are refused without homing.
  lines.sort((one, other) => Number(other.startsWith("$22=")) - Number(one.startsWith("$22=")));
  return {lines, unknown};
}

/**
 * @param {Settings} settings
 * @param {(lines: string[], words: string) => void} restore sends lines; the words say what they are
 */
export function listenForBackups(settings, restore) {
  by("settings-save").addEventListener("click", () => {
    const text = [...settings.byNumber.values()].map(({number, value}) => `$${number}=${value}\n`).join("");
    download("settings.txt", text);
  });
  const file = /** @type {HTMLInputElement} */ (by("settings-file"));
  file.addEventListener("change", async () => {
    const text = await file.files?.[0]?.text();
    file.value = "";
    if (text === undefined) return;
    const {lines, unknown} = changes(text, settings);
    const words = lines.length ? `${lines.length} settings differ from the file, and are set` : "no setting differs from the file";
    restore(lines, unknown.length ? `${words}; this machine has no ${unknown.join(" ")}` : words);
  });
}
