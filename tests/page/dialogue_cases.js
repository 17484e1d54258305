// Every dialogue by the keyboard alone, and in each kind of window: what axe finds, what is too small for a finger.

import assert from "node:assert/strict";
import {dropAndTime, isState, reads, text, violations, withProbe, WINDOWS} from "./steps.js";

const MACHINE = withProbe("keys", `plate_height = -2
tip = 3
x = { low = -5, high = 60 }
y = { low = -5, high = 60 }
`);
const JOB = "G21 G90\nG0 X10 Y10 Z1\nG1 Z-0.1 F600\nG1 X30 Y30 F4800\nG1 X10\nG0 Z1\nX0 Y0\n";

const focused = (page) => page.evaluate(() => document.activeElement?.id ?? "");

/** Goes to an element by Tab, as far as it takes. */
async function reach(page, id, key = "Tab") {
  for (let tries = 0; tries < 150; tries++) {
    if (await focused(page) === id) return;
    await page.keyboard.press(key);
  }
  throw new Error(`the Tab key does not lead to ${id}`);
}

/** Types into a field, or chooses in a list by its first letters. */
async function type(page, id, value) {
  await reach(page, id);
  if (await page.evaluate(() => document.activeElement.tagName) !== "SELECT") await page.keyboard.press("Control+A");
  await page.keyboard.type(value);
}

async function press(page, id) {
  await reach(page, id);
  await page.keyboard.press("Enter");
}

const has = (id, words) => [([id, words]) => new RegExp(words).test(document.getElementById(id).textContent), [id, words]];

/** Each dialogue: what opens it, what is typed, what starts it, and what comes of it. */
const DIALOGUES = [
  {name: "Connect", opener: "connect", id: "ports"},
  {name: "Frame", opener: "frame", id: "framing", fields: {"framing-feed": "6000"}, go: "framing-go", moves: true},
  {
    name: "From a line", opener: "from", id: "begin", fields: {"begin-line": "4", "begin-clearance": "2", "begin-spin": "0"}, ready: "begin-run", go: "begin-run",
    done: (page) => reads(page, "^done in"),
  },
  {
    name: "Height map", opener: "level", id: "heights", fields: {"heights-spacing": "20", "heights-travel": "1", "heights-bottom": "-4", "heights-feed": "1500"}, go: "heights-probe", stays: true,
    done: (page) => page.waitForFunction(...has("heights-map", "^The map has 2 × 2 places")),
  },
  {
    name: "Corner", way: "touch-open", opener: "corner-open", id: "corner", fields: {"corner-kind": "an ins", "corner-which": "front r", "corner-aside": "2", "corner-feed": "600"}, go: "corner-probe", stays: true,
    done: (page) => page.waitForFunction(...has("corner-found", "Nothing is set, zero is where it was: the probe touched nothing")),
  },
];

async function ready(page) {
  await isState(page, "Idle");
  await dropAndTime(page, "job.nc", JOB);
  await page.waitForFunction(() => !document.getElementById("level").disabled && !document.getElementById("from").disabled);
}

const isOpen = (page, id) => page.waitForFunction((id) => document.getElementById(id).open, id);
const isClosed = (page, id) => page.waitForFunction((id) => !document.getElementById(id).open, id);
/** The focus comes back to an element. */
async function comesBack(page, id) {
  try {
    await page.waitForFunction((id) => document.activeElement?.id === id, id);
  } catch (error) {
    const [at, isDisabled] = await page.evaluate((id) => [document.activeElement?.outerHTML.slice(0, 80), document.getElementById(id).disabled], id);
    throw new Error(`the focus is on ${at} and not on ${id}${isDisabled ? ", which is disabled" : ""}`, {cause: error});
  }
}

const small = (page) => page.evaluate(() => [...document.querySelectorAll("button, select, summary, textarea, .file span, input:not([type=file])")]
  .filter((one) => one.checkVisibility() && Math.min(one.offsetWidth, one.offsetHeight) < 44).map((one) => one.id || one.textContent));

export const dialogueCases = [
  {
    name: "by the keyboard alone each dialogue is opened, filled in, started and left, and the focus comes back",
    only: "file",
    machine: MACHINE,
    async run({page}) {
      await ready(page);
      for (const {name, way, opener, id, fields = {}, ready: waits, go, moves, stays, done} of DIALOGUES) {
        try {
          if (way) await press(page, way);
          await press(page, opener);
          await isOpen(page, id);
          await page.keyboard.press("Escape");
          await isClosed(page, id);
          await comesBack(page, opener);
          if (!go) continue;
          await page.keyboard.press("Enter");
          await isOpen(page, id);
          for (const [field, value] of Object.entries(fields)) await type(page, field, value);
          if (waits) await page.waitForFunction((id) => !document.getElementById(id).disabled, waits);
          await press(page, go);
          if (moves) await isState(page, "Jog");
          await done?.(page);
          if (stays) {
            await isOpen(page, id);
            await page.keyboard.press("Escape");
          }
          await isClosed(page, id);
          if (await page.locator("#unlock").isVisible()) {
            await reach(page, "unlock");
            await page.keyboard.press("Enter");
          }
          await isState(page, "Idle");
          if (!(await page.locator("#alarm").isVisible()) && name !== "Corner") await comesBack(page, opener);
        } catch (error) {
          throw new Error(`${name}: ${error.message}`, {cause: error});
        }
      }
      // The touch-off is a part of the page: it is opened, and Escape closes it.
      await type(page, "touch-plate", "1.5");
      await press(page, "touch-here");
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="Z"]').textContent === "1.500");
      await page.waitForFunction(() => globalThis.leadscrew.state().quiet && globalThis.leadscrew.state().name === "Idle");
      await page.keyboard.press("Escape");
      await page.locator("#touch").waitFor({state: "hidden"});
      await comesBack(page, "touch-open");
      // Macros of one's own.
      await press(page, "macros-own");
      await type(page, "macro-name", "Park");
      await type(page, "macro-lines", "G53 G0 X2");
      await page.keyboard.press("Tab");
      await page.keyboard.press("Enter");
      await page.getByRole("button", {name: "Park", exact: true}).waitFor();
      await reach(page, "macros-own", "Shift+Tab");
      await page.keyboard.press("Shift+Tab");
      await page.keyboard.press("Enter");
      await page.waitForFunction(() => globalThis.leadscrew.state().position[0] === 2);
      // Settings to a file and back.
      await reach(page, "tab-program");
      await page.keyboard.press("ArrowRight");
      await page.keyboard.press("ArrowRight");
      assert.equal(await focused(page), "tab-settings");
      await reach(page, "settings-save");
      await Promise.all([page.waitForEvent("download"), page.keyboard.press("Enter")]);
      await reach(page, "settings-file");
      const [chooser] = await Promise.all([page.waitForEvent("filechooser"), page.keyboard.press(" ")]);
      await chooser.setFiles({name: "mine.txt", mimeType: "text/plain", buffer: Buffer.from("$110=7000\n")});
      await page.waitForFunction(() => document.getElementById("setting-110").value === "7000.000");
    },
  },
  {
    name: "Escape closes a dialogue and stops no job; without one it stops the machine",
    only: "file",
    machine: MACHINE,
    async run({page}) {
      await isState(page, "Idle");
      await dropAndTime(page, "job.nc", `G21 G90\nF1200\n${"G1 X20\nX0\n".repeat(60)}`);
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await isState(page, "Run");
      await page.getByRole("button", {name: "Connect…"}).click();
      await isOpen(page, "ports");
      await page.keyboard.press("Escape");
      await isClosed(page, "ports");
      assert.match(await text(page, "#state"), /^Run/);
      await page.keyboard.press("Escape");
      await reads(page, "^stopped by a reset at line \\d+$");
    },
  },
  ...WINDOWS.map(([name, context]) => ({
    name: `${name}: in each dialogue nothing that axe finds, nothing too small or too wide`,
    only: "file",
    machine: `${MACHINE}[outputs]\ncount = 4\n`,
    context,
    async run({page, shoot}) {
      const isFit = async (where) => {
        assert.deepEqual(await violations(page), [], where);
        const [inside, window] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
        assert.ok(inside <= window, `${where}: ${inside} pixels in ${window}`);
        if (name.startsWith("phone")) assert.deepEqual(await small(page), [], `${where}: too small for a finger`);
      };
      await ready(page);
      for (const {way, opener, id} of DIALOGUES) {
        if (way) await page.locator(`#${way}`).click();
        await page.locator(`#${opener}`).click();
        await isOpen(page, id);
        await page.waitForFunction(() => document.getElementById("begin-facts").textContent !== "…");
        if (id === "heights") {
          await page.locator("#heights-file").setInputFiles({name: "map.csv", mimeType: "text/plain", buffer: Buffer.from("0 0 0\n25 0 0.2\n50 0 0.1\n0 50 0.6\n25 50 0.9\n50 50 0.5\n0 25 0.4\n25 25 0.7\n50 25 0.2\n")});
          await page.waitForFunction(...has("heights-map", "^The map has 3 × 3 places"));
        }
        await shoot(`${id}-${name}`);
        await isFit(id);
        const [left, right] = await page.evaluate((id) => [document.getElementById(id).getBoundingClientRect().left, document.getElementById(id).getBoundingClientRect().right], id);
        assert.ok(left >= 0 && right <= page.viewportSize().width, `${id} is wider than the window`);
        await page.keyboard.press("Escape");
        await isClosed(page, id);
      }
      await page.waitForFunction(...has("legend", "plate: Z 0 to Z 0\\.9"));
      await page.locator("#view").scrollIntoViewIfNeeded();
      await shoot(`map-${name}`);
      await page.locator("#touch").scrollIntoViewIfNeeded();
      await page.locator("#macros-own").click();
      await page.locator("#tab-settings").click();
      await shoot(`opened-${name}`);
      await isFit("touch-off, macros, settings");
    },
  })),
];
