// What cases do again and again.

import {readFileSync} from "node:fs";
import {createRequire} from "node:module";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** A machine with a probe, over 100 mm by 80 mm. Steps: 0.0125 mm, of Z 0.0025 mm. `probe`: what is under it. */
export const withProbe = (name, probe) => `name = "${name}"
[axes.x]
steps_per_mm = 80
travel = 100
rate_mm_min = 12000
acceleration_mm_s2 = 2000
[axes.y]
steps_per_mm = 80
travel = 80
rate_mm_min = 12000
acceleration_mm_s2 = 2000
[axes.z]
steps_per_mm = 400
rate_mm_min = 6000
acceleration_mm_s2 = 2000
[probe]
${probe}`;

/** The kinds of windows in which a page is seen. */
export const WINDOWS = [
  ["light", {}], ["dark", {colorScheme: "dark"}], ["phone", {viewport: {width: 390, height: 844}, hasTouch: true, isMobile: true}],
  ["phone-dark", {viewport: {width: 360, height: 740}, colorScheme: "dark", hasTouch: true, isMobile: true}],
];

export const text = (page, selector) => page.locator(selector).textContent();

export const number = async (page, selector) => Number.parseFloat(await text(page, selector));

/** In the page, before its own code: keeps all that the state and the account of the job read, one text after the other. */
export function keepsPast() {
  const kept = Object.fromEntries(["state", "job-time"].map((id) => [id, {texts: [], seen: 0}]));
  globalThis.past = kept;
  new MutationObserver(() => {
    for (const [id, {texts}] of Object.entries(kept)) {
      const text = document.getElementById(id)?.textContent ?? "";
      if (text !== texts.at(-1)) texts.push(text);
    }
  }).observe(document, {subtree: true, childList: true, characterData: true});
}

/**
 * Waits until one of these reads so, or has done so since it was last waited for: what goes by while nobody looks counts, unless it
 * lasts.
 */
const hasRead = (page, id, words, lasts = false) => page.waitForFunction(([id, words, lasts]) => {
  const kept = globalThis.past[id];
  const is = new RegExp(words);
  const isNow = is.test(document.getElementById(id).textContent);
  const past = lasts ? -1 : kept.texts.findIndex((text, at) => at > kept.seen && is.test(text));
  const at = isNow ? Math.max(kept.texts.length - 1, 0) : past;
  if (at >= 0) kept.seen = at;
  return at >= 0;
}, [id, words, lasts]);

/** The state is this one. Idle lasts until somebody acts: what the state read between two motions does not count. */
export const isState = (page, name) => hasRead(page, "state", `^${name}`, name === "Idle");

/** The account of the job reads so. */
export async function reads(page, words) {
  try {
    await hasRead(page, "job-time", words);
  } catch (error) {
    throw new Error(`${words} is not what it reads: ${await text(page, "#state")}, ${await text(page, "#job-time")}`, {cause: error});
  }
}

/** Drops a file on the page, as a file manager does. */
export async function drop(page, name, content) {
  await page.evaluate(([name, content]) => {
    const data = new DataTransfer();
    data.items.add(new File([content], name));
    for (const type of ["dragenter", "dragover", "drop"]) {
      document.body.dispatchEvent(new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true}));
    }
  }, [name, content]);
}

export async function dropAndTime(page, name, content) {
  await drop(page, name, content);
  await page.waitForFunction(() => /^takes|without pauses/.test(document.getElementById("job-time").textContent));
}

export async function say(page, line) {
  await page.getByRole("tab", {name: "Console"}).click();
  await page.getByLabel("Line to send").fill(line);
  await page.getByLabel("Line to send").press("Enter");
}

export async function violations(page) {
  await page.evaluate(AXE);
  const result = await page.evaluate(() => globalThis.axe.run());
  return result.violations.map(({id, nodes}) => `${id}: ${nodes.map(({target, failureSummary}) => `${target} ${failureSummary}`).join("; ")}`);
}
