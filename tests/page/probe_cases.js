// The probe at the sides of a block and in a hole; what is filled in in inches; outputs; a gamepad.

import assert from "node:assert/strict";
import {isState, say, text, violations, withProbe} from "./steps.js";
import {sleep} from "./server.js";

/** A block from X20 to X60 and from Y10 to Y50, 5 mm below the machine's zero, with a hole of 12 mm. Steps: 0.0125 mm, of Z 0.0025 mm. */
const BLOCK = withProbe("block", `plate_height = -5
x = { low = 20, high = 60 }
y = { low = 10, high = 50 }
hole = { x = 40, y = 30, diameter = 12 }
tip = 3
`);
/** A step, and what the axis goes in the time of the input's filter. */
const STEP = [0.0125 + 0.002, 0.0125 + 0.002, 0.0025 + 0.002];

const offset = (page) => page.evaluate(() => globalThis.leadscrew.state().offset);

async function goTo(page, [x, y, z]) {
  await say(page, "G90G21G53G0Z0");
  await say(page, `G53G0X${x}Y${y}`);
  await say(page, `G53G0Z${z}`);
  await page.waitForFunction(([x, y, z]) => {
    const {position, name, quiet} = globalThis.leadscrew.state();
    return name === "Idle" && quiet && [x, y, z].every((place, axis) => Math.abs(position[axis] - place) < 0.01);
  }, [x, y, z]);
}

async function open(page, values = {}) {
  if (!(await page.locator("#touch").isVisible())) await page.getByRole("button", {name: "Touch off…"}).click();
  await page.getByRole("button", {name: "Corner or hole…"}).click();
  for (const [id, value] of Object.entries(values)) {
    const field = page.locator(`#corner-${id}`);
    if (await field.evaluate((one) => one.tagName === "SELECT")) await field.selectOption(value);
    else await field.fill(String(value));
  }
}

const close = (page) => page.locator("#corner").getByRole("button", {name: "Close"}).click();
const found = (page, words) => page.waitForFunction((words) => document.getElementById("corner").open && new RegExp(words).test(document.getElementById("corner-found").textContent), words);
const probe = (page) => page.getByRole("button", {name: "Probe", exact: true}).click();

/** Where the tool begins, what is chosen, and where zero is then; `null`: as it was. */
const WAYS = [
  {from: [24, 14, 0], values: {kind: "outside", which: "1 1"}, zero: [20, 10, -5], words: "Zero is at the corner: machine X 20\\.0\\d+, Y 10\\.0\\d+, Z -5\\.0\\d+"},
  {from: [56, 46, -1], values: {kind: "outside", which: "-1 -1", over: 1.5, beside: 2}, zero: [58, 48, -6.5], words: "Zero is at the corner", only: "file"},
  {from: [24, 46, -1], values: {kind: "outside", which: "1 -1", over: 0, beside: 0}, zero: [20, 50, -5], words: "Zero is at the corner", only: "file"},
  {from: [41.5, 29, -7], values: {kind: "hole"}, zero: [40, 30, null], words: "Zero is in the middle of the hole, which is (11\\.9[89]|12|12\\.0[01])\\d* mm wide", only: "file"},
  // Through its middle a hole is as wide as a pocket.
  {from: [40, 30, -7], values: {kind: "inside", which: "1 1", aside: 10}, zero: [34, 24, null], words: "Zero is at the corner", only: "file"},
  {from: [40, 30, -7], values: {kind: "inside", which: "-1 -1", aside: 10, beside: 0.5}, zero: [46.5, 36.5, null], words: "Zero is at the corner", only: "file"},
];

/** How it fails: before it, and what is said. */
const FAILURES = [
  {from: [90, 70, 0], words: "Nothing is set, zero is where it was: the probe touched nothing", alarm: "ALARM:5"},
  {from: [24, 14, 0], closed: true, words: "Nothing is set, zero is where it was: the probe was closed before it moved", alarm: "ALARM:4"},
  {from: [45, 15, -1], words: "Nothing is set, zero is where it was: beside the work the tool met something on its way down: go farther aside than 15 mm", height: -2},
];

async function unlock(page) {
  await page.getByRole("button", {name: "Unlock"}).click();
  await isState(page, "Idle");
}

/** The modes that the machine tells. */
async function modes(page) {
  const count = () => page.evaluate(() => document.getElementById("log").textContent.match(/\[GC:[^\]]*/g)?.length ?? 0);
  const before = await count();
  await say(page, "$G");
  await page.waitForFunction((before) => (document.getElementById("log").textContent.match(/\[GC:[^\]]*/g)?.length ?? 0) > before, before);
  return page.evaluate(() => document.getElementById("log").textContent.match(/\[GC:[^\]]*/g).at(-1));
}

export const probeCases = [
  ...["server", "file"].map((only) => ({
    name: "corner and hole: the lines are shown before anything moves, and zero is within a step of where the block is",
    only,
    machine: BLOCK,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await say(page, "G10 L2 P1 X3 Y2 Z-1");
      await page.waitForFunction(() => globalThis.leadscrew.state().offset[0] === 3);
      for (const way of WAYS.filter((way) => !way.only || way.only === only)) {
        await goTo(page, way.from);
        const before = await offset(page);
        const moves = await page.evaluate(() => globalThis.leadscrew.state().moves);
        await open(page, {...way.values, feed: 300});
        const lines = await page.locator("#corner-lines li").allTextContents();
        assert.match(lines.at(-1), /^G10L20P0X/);
        assert.match(await text(page, "#corner-facts"), /^Put the tool .* These lines go out/);
        if (way === WAYS[0]) {
          assert.deepEqual(await violations(page), []);
          await shoot("corner");
        }
        assert.equal(await page.evaluate(() => globalThis.leadscrew.state().moves), moves, "nothing has moved");
        await probe(page);
        await found(page, way.words);
        await shoot(`corner-${way.values.kind}`);
        const zero = await offset(page);
        way.zero.forEach((place, axis) => assert.ok(Math.abs(zero[axis] - (place ?? before[axis])) <= (place === null ? 0 : STEP[axis]), `${zero} and not ${way.zero}`));
        await close(page);
      }
    },
  })),
  {
    name: "corner: what fails is said, zero stays, and the modes are as before",
    only: "file",
    machine: BLOCK,
    async run({page}) {
      await isState(page, "Idle");
      await say(page, "G10 L2 P1 X3 Y2 Z-1");
      for (const {from, closed, words, alarm, height} of FAILURES) {
        await goTo(page, from);
        await say(page, "G20 G91");
        const switched = () => page.evaluate(() => [...document.querySelectorAll("#switches button")].find(({textContent}) => textContent === "Probe").click());
        if (closed) await switched();
        await open(page, {kind: "outside", which: "1 1", feed: 600});
        await probe(page);
        await found(page, words);
        assert.deepEqual(await offset(page), [3, 2, -1]);
        // The tool does not stay on the work.
        if (height !== undefined) await page.waitForFunction((height) => Math.abs(globalThis.leadscrew.state().position[2] - height) < 0.01, height);
        await close(page);
        if (closed) await switched();
        if (alarm) {
          assert.match(await text(page, "#alarm"), new RegExp(alarm));
          await unlock(page);
        }
        await page.waitForFunction(() => /the modes as before/.test(document.getElementById("log").textContent));
        await page.waitForFunction(() => globalThis.leadscrew.state().quiet);
        assert.match(await modes(page), /G20 G91/);
      }
      await open(page, {aside: 2});
      assert.match(await text(page, "#corner-facts"), /^The tool goes farther aside than 4\.5 mm/);
      assert.ok(await page.locator("#corner-probe").isDisabled());
    },
  },
  {
    name: "in inches ($13) each dialogue's fields are in inches, what is typed is taken so, and zero is right",
    only: "file",
    machine: BLOCK,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await goTo(page, [24, 14, -1]);
      const fields = () => page.evaluate(() => Object.fromEntries([...document.querySelectorAll("input[data-length]")].map(({id, value}) => [id, value])));
      const before = await fields();
      await say(page, "$13=1");
      await page.waitForFunction(() => document.getElementById("feed-unit").textContent === "in/min");
      const inches = await fields();
      for (const [id, value] of Object.entries(before)) {
        if (value !== "") assert.ok(Math.abs(Number(inches[id]) * 25.4 - Number(value)) <= (/feed/.test(id) ? 0.013 * Number(value) : 0.0013), `${id}: ${value} mm, ${inches[id]} in`);
      }
      assert.deepEqual(await page.evaluate(() => [...document.querySelectorAll("dialog label, .touch label, .jog label")].map(({textContent}) => textContent).filter((words) => /\bmm\b/.test(words))), []);
      await open(page, {kind: "outside", which: "1 1", over: 0.1, feed: 12});
      assert.match(await text(page, "#corner-facts"), /less than 0\.5315 in from the corner/);
      await shoot("corner-inches");
      await probe(page);
      await found(page, "Zero is at the corner: machine X 0\\.787\\d, Y 0\\.39");
      // Reports have 0.0001 in.
      (await offset(page)).forEach((place, axis) => assert.ok(Math.abs(place - [20, 10, -5 - 2.54][axis]) <= STEP[axis] + 0.0026, `${place}`));
      await close(page);
      await page.locator("#touch-plate").fill("0.5");
      await page.getByRole("button", {name: "The tip touches"}).click();
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="Z"]').textContent === "0.5000");
      await say(page, "$13=0");
      await page.waitForFunction(() => document.getElementById("feed-unit").textContent === "mm/min");
      assert.deepEqual(await fields(), {...before, "corner-over": "2.54", "corner-feed": "305", "touch-plate": "12.7"});
    },
  },
  {
    name: "outputs and coolant: each shows whether it is on, and switches",
    machine: `${BLOCK}[outputs]\ncount = 3\n`,
    async run({page}) {
      await isState(page, "Idle");
      const outputs = () => page.locator("#outputs button");
      await page.waitForFunction(() => document.getElementById("outputs").childElementCount === 3);
      const are = (...wanted) => page.waitForFunction((wanted) => [...document.querySelectorAll("#outputs button")].map((one) => one.getAttribute("aria-pressed")).join() === wanted, wanted.join());
      await are(false, false, false);
      await outputs().nth(1).click();
      await are(false, true, false);
      await say(page, "M64 P2");
      await are(false, true, true);
      await outputs().nth(1).click();
      await are(false, false, true);
      await page.getByRole("button", {name: "Flood"}).click();
      await page.waitForFunction(() => document.getElementById("coolant-Flood").getAttribute("aria-pressed") === "true");
      assert.deepEqual(await violations(page), []);
      await page.getByRole("button", {name: "Reset", exact: true}).click();
      await are(false, false, false);
      await page.waitForFunction(() => document.getElementById("coolant-Flood").getAttribute("aria-pressed") === "false");
    },
  },
  {
    name: "a gamepad jogs if it is turned on, as long as it is held, beyond its dead zone; it rests first, and not beside a dialogue",
    only: "file",
    machine: BLOCK,
    async before(page) {
      await page.addInitScript(() => {
        globalThis.pad = {axes: [0, 0, 0, 0], buttons: Array.from({length: 17}, () => ({pressed: false}))};
        Object.defineProperty(Navigator.prototype, "getGamepads", {configurable: true, value: () => [null, globalThis.pad]});
      });
    },
    async run({page}) {
      await isState(page, "Idle");
      const push = (...axes) => page.evaluate((axes) => (globalThis.pad.axes = axes), axes);
      const position = () => page.evaluate(() => globalThis.leadscrew.state().position);
      const rests = async (words) => {
        const before = await position();
        await sleep(400);
        assert.deepEqual(await position(), before, words);
      };
      await push(1, 0, 0, 0);
      await rests("it is off");
      await page.getByLabel("gamepad").check();
      await rests("it was pushed when it was turned on");
      await push(0, 0, 0, 0);
      await sleep(150);
      await push(0.35, -0.35, 0, 0);
      await rests("within its dead zone");
      await push(0.9, 0, 0, 0);
      await isState(page, "Jog");
      await page.waitForFunction(() => globalThis.leadscrew.state().position[0] > 2);
      // Another way: it stops, and goes there. Up is away from a person.
      await push(0.9, -0.9, 0, 0);
      await page.waitForFunction(() => globalThis.leadscrew.state().position[1] > 1);
      await push(0, 0, 0, 0);
      await isState(page, "Idle");
      await rests("let go");
      const [x, y, z] = await position();
      assert.ok(x > 2 && x < 60 && y > 1 && y < 60 && z === 0, `${x} ${y} ${z}`);
      await page.evaluate(() => (globalThis.pad.buttons[14].pressed = true));
      await page.waitForFunction((x) => globalThis.leadscrew.state().position[0] < x - 1, x);
      await page.evaluate(() => (globalThis.pad.buttons[14].pressed = false));
      await isState(page, "Idle");
      await push(0, 0, 0, -1);
      await page.waitForFunction(() => globalThis.leadscrew.state().position[2] > 1);
      await page.getByRole("button", {name: "Connect…"}).click();
      await isState(page, "Idle");
      await rests("a dialogue is open");
      await page.keyboard.press("Escape");
      await rests("it is still pushed");
      await page.getByLabel("gamepad").uncheck();
      await push(0, 0, 0, 0);
      await sleep(150);
      await push(1, 0, 0, 0);
      await rests("it is off again");
    },
  },
];
