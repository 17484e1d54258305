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

export const isState = (page, name) => page.waitForFunction((name) => document.getElementById("state").textContent.startsWith(name), name);

/** The account of the job reads so. */
export async function reads(page, words) {
  try {
    await page.waitForFunction((words) => new RegExp(words).test(document.getElementById("job-time").textContent), words);
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
