// What a user of the page does, and what has to come of it.

import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {get} from "node:http";
import {dropAndTime, drop, isState, number, reads, say, text, violations, WINDOWS} from "./steps.js";
import {playback, sender, sleep} from "./server.js";

const EXAMPLES = new URL("../../examples/", import.meta.url);

const FAST = `name = "bench"
[settings]
"$110" = 6000
"$111" = 6000
"$112" = 3000
"$120" = 800
"$121" = 800
"$122" = 800
`;
const HOMED = `name = "router"
[settings]
"$22" = 1
"$24" = 200
"$25" = 2000
"$110" = 6000
"$111" = 6000
"$112" = 6000
"$120" = 2000
"$121" = 2000
"$122" = 2000
[axes.x]
start = -5
limits = { high = 0 }
[axes.y]
start = -5
limits = { high = 0 }
[axes.z]
start = -5
limits = { high = 0 }
`;
const SQUARE = "G21 G90\nG1 X20 F3000\nY20\nX0\nY0\n";
const LONG = `G21 G90\nM3 S1000\n${"G1 X20 F1500\nX0\n".repeat(30)}`;

const TOOLS = `${FAST}[tool_change]\nshown = "hold"\n`.replace("bench", "drill");
const HEATED = `${FAST}[heaters.nozzle]\nsensor = "ad595"\nmost = 270\nextrusion = 50\nhottest = 300\n`.replace("bench", "warm");
const HARD = FAST.replace("[settings]", "[settings]\n\"$21\" = 1").replace("bench", "hard");

const axis = (letter) => `#axes td[data-axis="${letter}"]`;

/** Waits for the place of an axis to be work zero: a job that was dropped before is checked once more there. */
const isZero = async (page, ...letters) => {
  for (const letter of letters) await page.waitForFunction((cell) => /^-?0\.000$/.test(document.querySelector(cell).textContent), axis(letter));
};

const start = (page) => page.getByRole("button", {name: "Run", exact: true}).click();
const reset = (page) => page.getByRole("button", {name: "Reset", exact: true}).click();
const unlock = (page) => page.getByRole("button", {name: "Unlock"}).click();
async function press(page, name) {
  await page.getByRole("tab", {name: "Switches"}).click();
  await page.getByRole("button", {name}).click();
}

/** How a job ends: what is done to it, and its account. */
const ENDS = Object.entries({
  "the end of the file": {job: SQUARE, act: () => {}, ends: "^done in"},
  "M2": {job: `${SQUARE}M2\n`, act: () => {}, ends: "^done in"},
  "M30, and lines after it": {job: `${SQUARE}M30\nG0 X1\n`, act: () => {}, ends: "^done in"},
  "a pause of the program": {
    job: "G21 G90\nG1 X5 F3000\nM0 (turn the work)\nG1 X0\n", ends: "^done in",
    act: async ({page}) => {
      await reads(page, "^line 3 of 4: the program pauses, turn the work: Resume goes on$");
      await page.getByRole("button", {name: "Resume"}).click();
    },
  },
  "a hold": {
    job: LONG, ends: "^line \\d+ of 62, .* left$",
    act: async ({page}) => {
      await isState(page, "Run");
      await page.getByRole("button", {name: "Hold", exact: true}).click();
      await reads(page, "^held at line \\d+ of 62: Resume goes on$");
      await page.getByRole("button", {name: "Resume"}).click();
    },
  },
  "a door": {
    machine: `${FAST}[door]\nfitted = true\n`, job: LONG, ends: "^line \\d+ of 62, .* left$",
    act: async ({page}) => {
      await isState(page, "Run");
      await press(page, "Door");
      await reads(page, "^line \\d+ of 62: the door is open: close it, then Resume$");
      await press(page, "Door");
      await reads(page, "^line \\d+ of 62: the door is closed: Resume goes on$");
      await page.getByRole("button", {name: "Resume"}).click();
    },
  },
  "a reset in motion": {
    job: LONG, ends: "^stopped by a reset at line \\d+$", unlocks: unlock,
    act: async ({page}) => {
      await isState(page, "Run");
      await reset(page);
    },
  },
  "a reset in a hold": {
    job: LONG, ends: "^stopped by a reset at line \\d+$",
    act: async ({page}) => {
      await isState(page, "Run");
      await page.getByRole("button", {name: "Hold", exact: true}).click();
      await isState(page, "Hold:0");
      await reset(page);
    },
  },
  "a tool change that is given up": {
    machine: TOOLS, job: "G21 G90\nM6 T2\nG1 X4 F3000\n", ends: "^stopped by a reset at line 2$",
    act: async ({page}) => {
      await isState(page, "Hold:0");
      await reset(page);
      await isState(page, "Idle");
    },
  },
  "a limit switch, when only a reset leads out": {
    machine: HARD, job: LONG, ends: "^stopped by ALARM:1 at line \\d+$",
    act: async ({page}) => {
      await isState(page, "Run");
      await press(page, "Limit X");
      await page.locator("#alarm-reset").waitFor();
      assert.match(await text(page, "#alarm"), /^ALARM:1: A limit switch was hit.*Reset it/);
      assert.ok(await page.locator("#unlock").isHidden() && await page.locator("#home").isDisabled());
    },
    unlocks: async (page) => {
      await page.getByRole("button", {name: "Limit X"}).click();
      await page.locator("#alarm-reset").click();
      await unlock(page);
    },
  },
  "a probe that touches nothing": {job: "G21 G90\nG1 X5 F3000\nG38.2 Z-1 F600\n", act: () => {}, ends: "^stopped by ALARM:5 at line 3$", unlocks: unlock},
  "a probe that touches too early": {
    job: "G21 G90\nG1 X80 F400\nG38.2 Z-1 F600\n", ends: "^stopped by ALARM:4 at line 3$", unlocks: unlock,
    act: ({page}) => press(page, "Probe"),
  },
  "sleep": {job: "G21 G90\nG1 X5 F3000\nG4 P0\n$SLP\n", act: () => {}, ends: "^stopped by Sleep at line 4$"},
  "check mode": {job: "G21 G90\n$C\nG1 X5 F3000\n", act: () => {}, ends: "^done in"},
  "a line that is refused": {
    job: `G21 G90\nG1 X1 F3000\n${"G4 P0.02\nG1 X0\nG4 P0.02\nG1 X1\n".repeat(400)}`, ends: "^stopped by error:22 \\(.*\\) at line \\d+$",
    act: async ({page}) => {
      await isState(page, "Run");
      await say(page, "G93");
    },
  },
  "the loss of the connection": {
    only: "server", job: LONG, ends: "^stopped by the loss of the connection at line \\d+$",
    act: async ({page, server}) => {
      await isState(page, "Run");
      await server.stop();
    },
  },
});

const MACHINES = new URL("machines/", EXAMPLES);

/** What each owner does with the machine that `machine new --like` makes: a job of the owner's own. */
const OWNERS = Object.entries({
  laser: {
    home: true, file: ["sign.nc", "G21 G90\nM4 S0\nG0 X5 Y5\nG1 X45 F3000 S10\nY10 S400\nX5 S1000\nM5\nG0 X0 Y0\nM2\n"],
    facts: "85 mm cut.*X 5 … 45", legend: "laser: off to full power", at: {X: 0, Y: 0},
  },
  router: {
    home: true, file: ["slot.nc", "(cutter 3 mm)\nG21 G90\nM3 S9000\nG0 X10 Y10 Z-1\nG1 Z-3 F600\nG1 X30 F1500\nG0 Z-1\nM5\nM2\n"],
    facts: "22 mm cut.*Z -3 … -1", legend: "tool 3 mm", at: {X: 30, Z: -1},
  },
  drill: {
    home: true, lower: true, file: ["board.drl", "M48\nMETRIC\nT1C0.8\nT2C1.2\n%\nT1\nX2.0Y2.0\nX6.0Y2.0\nT2\nX6.0Y6.0\nM30\n"], notes: "Excellon.*import drill",
    facts: "2 pauses", legend: "tool 1.2 mm", at: {},
    during: async (page) => {
      for (const tool of ["1, .*0\\.8 mm", "2, .*1\\.2 mm"]) {
        await reads(page, `insert tool ${tool}.*, then Resume$`);
        await page.getByRole("button", {name: "Resume"}).click();
      }
    },
  },
  engraver: {
    file: ["rows.csv", "row,dx,dy,engrave\n1,4,0,1\n2,0,2,0\n3,-4,0,1\n"], notes: "engraver's rows.*import rows",
    facts: "mm cut.*X 0 … 4", legend: "cut: Z", at: {X: 0, Y: 2},
  },
  plotter: {
    home: true, file: ["letter.nc", "G21 G90\nG0 X10 Y10 Z-2\nG1 Z-5 F1200\nG1 X40 F6000\nY30\nX10 Y10\nG0 Z-2\nM2\n"],
    facts: "89.06 mm cut.*X 10 … 40 · Y 10 … 30", legend: "cut: Z", isFlat: true, at: {X: 10, Y: 10},
  },
  printer: {
    file: ["part.gcode", "; generated by PrusaSlicer 2.6.0\nG21\nG90\nM82\nM104 S35\nG28\nM109 S35\nG92 E0\nG1 Z0.3 F600\nG1 X20 Y20 F6000\nG1 X40 E2 F1800\nG1 Y40 E4\nM104 S0\n"],
    notes: "slicer's file.*import print --home 2,2,2", facts: "40 mm extruded.*X 20 … 40 · Y 20 … 40", legend: "extruded: Z 0.3", at: {X: 40, Y: 40, Z: 0.3},
    during: (page) => reads(page, "heating: nozzle \\d+ of 35 °C"),
  },
});

/** Asks for a document as no browser does. */
function fetched(address, headers = {}) {
  return new Promise((resolve, reject) => {
    get(address, {headers}, (answer) => {
      let body = "";
      answer.on("data", (part) => (body += part));
      answer.on("end", () => resolve({status: answer.statusCode, headers: answer.headers, body}));
    }).on("error", reject);
  });
}

/** Pixels of the paths that are not empty. */
function inked(page) {
  return page.evaluate(async () => {
    const [, ahead, behind] = document.querySelectorAll("#view canvas");
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [ahead.width, ahead.height];
    const pen = copy.getContext("2d");
    globalThis.leadscrew.draw();
    pen.drawImage(ahead, 0, 0);
    pen.drawImage(behind, 0, 0);
    return pen.getImageData(0, 0, copy.width, copy.height).data.filter((value, index) => index % 4 === 3 && value > 40).length;
  });
}

export const cases = [
  {
    name: "the page loads from its address and shows the machine",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      assert.equal(await text(page, axis("X")), "0.000");
      assert.match(await text(page, "#machine-name"), /bench/);
      assert.equal(await page.title(), "bench · leadscrew");
    },
  },
  {
    name: "only the printed address opens the page, and no page from elsewhere its socket",
    only: "server",
    alone: true,
    async run({server}) {
      const address = new URL(await server.address());
      const bare = await fetched(new URL("/", address));
      assert.equal(bare.status, 401);
      assert.ok(!bare.body.includes(address.search));
      assert.equal((await fetched(new URL("/?token=guess", address))).status, 401);
      assert.equal((await fetched(new URL(`/else${address.search}`, address))).status, 404);
      assert.equal((await fetched(address, {host: "attacker.example"})).status, 403);
      assert.equal((await fetched(address, {origin: "https://attacker.example"})).status, 403);
      const good = await fetched(address);
      assert.equal(good.status, 200);
      assert.match(good.headers["content-security-policy"], /default-src 'none'.*frame-ancestors 'none'/);
      assert.equal(good.headers["referrer-policy"], "no-referrer");
      assert.ok(good.body.length < 200_000, `${good.body.length} bytes`);
      const upgrade = {connection: "Upgrade", upgrade: "websocket", "sec-websocket-version": "13", "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ=="};
      assert.equal((await fetched(new URL("/page", address), upgrade)).status, 403);
      assert.equal((await fetched(new URL(`/page${address.search}`, address), {...upgrade, origin: "null"})).status, 403);
    },
  },
  {
    name: "a dropped job is checked, drawn, timed and run to its end",
    machine: FAST,
    async run({page, shoot}) {
      await isState(page, "Idle");
      const before = await inked(page);
      await dropAndTime(page, "square.nc", SQUARE.replaceAll("20", "100"));
      assert.match(await text(page, "#job-facts"), /5 lines.*400 mm cut.*X 0 … 100/);
      assert.match(await text(page, "#binds"), /feed/);
      assert.ok((await inked(page)) > before + 200);
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await isState(page, "Run");
      await page.waitForFunction(() => document.querySelector("#program .now") !== null);
      await page.waitForFunction(() => Number.parseFloat(document.getElementById("feed").textContent) > 2000);
      await shoot("running");
      await page.waitForFunction(() => /^done in/.test(document.getElementById("job-time").textContent));
      assert.equal(await text(page, axis("Y")), "0.000");
      assert.equal(await page.evaluate(() => globalThis.leadscrew.trace.count), 5);
      assert.deepEqual(await page.evaluate(() => ["now", "done"].map((name) => document.querySelectorAll(`#program .${name}`).length)), [0, 5], "no line runs any more");
    },
  },
  {
    name: "a program runs as the plain lines that it comes to, and one that reads the machine is not run",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      await dropAndTime(page, "steps.ngc", "G21 G90\n#1 = 0\no1 repeat [3]\n#1 = [#1 + 5]\nG1 X#1 F600\no1 endrepeat\nG4 P1\nM2\n");
      assert.ok(await page.locator("#from").isDisabled());
      await start(page);
      await reads(page, "^line 5 of 8, ");
      await reads(page, "^done in");
      assert.equal(await text(page, axis("X")), "15.000");
      assert.equal(await page.evaluate(() => globalThis.leadscrew.trace.count), 4);
      // The line that is refused is the file's.
      await dropAndTime(page, "stops.ngc", "o1 repeat [2]\nG1 X0 F60\no1 endrepeat\nG4 P9\n");
      await start(page);
      await isState(page, "Run");
      await reset(page);
      await reads(page, "^stopped by a reset at line [24]$");
      await unlock(page);
      await drop(page, "place.ngc", "G21\nG1 X[#5420 + 1] F600\n");
      await page.waitForFunction(() => /line 2 reads a place/.test(document.getElementById("findings").textContent));
      assert.ok(await page.locator("#run").isDisabled());
    },
  },
  {
    name: "a job with an error is not run, and the error leads to its line",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      await drop(page, "wrong.nc", "G21\nG1 X10\nG77\n");
      await page.locator("#findings button").nth(1).waitFor();
      assert.match(await text(page, "#findings"), /Line 2: .*feed/i);
      assert.ok(await page.locator("#run").isDisabled());
      await page.locator("#findings button").first().click();
      assert.equal(await page.locator("#program .error").count(), 2);
    },
  },
  {
    name: "a job is held, resumed, and overridden",
    machine: FAST,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await dropAndTime(page, "long.nc", LONG);
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await isState(page, "Run");
      await page.getByRole("button", {name: "Hold", exact: true}).click();
      await isState(page, "Hold:0");
      const there = await text(page, axis("X"));
      await sleep(300);
      assert.equal(await text(page, axis("X")), there);
      await shoot("held");
      await page.getByRole("button", {name: "Resume"}).click();
      await isState(page, "Run");
      await page.getByRole("button", {name: "Feed override +10 %"}).click();
      await page.getByRole("button", {name: "Feed override +10 %"}).click();
      await page.waitForFunction(() => document.getElementById("override-feed").textContent === "120 %");
      await page.waitForFunction(() => Math.abs(Number.parseFloat(document.getElementById("feed").textContent) - 1800) < 10);
      await page.getByRole("button", {name: "Reset", exact: true}).click();
      await page.locator("#alarm").waitFor();
      assert.match(await text(page, "#alarm"), /ALARM:3/);
      await page.getByRole("button", {name: "Unlock"}).click();
      await isState(page, "Idle");
    },
  },
  {
    name: "jogging by steps, by holding a button, and by keys",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Jog X plus"}).click();
      await page.waitForFunction((selector) => document.querySelector(selector).textContent === "10.000", axis("X"));
      await isState(page, "Idle");
      await page.locator("#jog-step").selectOption("own");
      await page.locator("#jog-mm").fill("-1");
      await page.getByRole("button", {name: "Jog Z plus"}).click();
      await page.locator("#jog-mm").fill("2.5");
      await page.getByRole("button", {name: "Jog Z plus"}).click();
      await page.waitForFunction((selector) => document.querySelector(selector).textContent === "2.500", axis("Z"));
      await isState(page, "Idle");
      await page.locator("#jog-step").selectOption("hold");
      await page.getByRole("button", {name: "Jog Y plus"}).hover();
      await page.mouse.down();
      await isState(page, "Jog");
      await page.waitForFunction((selector) => Number.parseFloat(document.querySelector(selector).textContent) > 3, axis("Y"));
      await page.mouse.up();
      await isState(page, "Idle");
      const stopped = await number(page, axis("Y"));
      assert.ok(stopped > 3 && stopped < 60, `${stopped}`);
      await page.locator("#jog-keys").check();
      await page.keyboard.down("ArrowLeft");
      await isState(page, "Jog");
      await page.keyboard.up("ArrowLeft");
      await isState(page, "Idle");
      assert.ok((await number(page, axis("X"))) < 10);
    },
  },
  {
    name: "homing, work zero, a limit switch that is pressed, and the alarm that follows",
    machine: HOMED,
    async run({page}) {
      await isState(page, "Alarm");
      await page.getByRole("button", {name: "Home", exact: true}).click();
      await isState(page, "Home");
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Make this X zero"}).click();
      await page.waitForFunction((selector) => document.querySelector(selector).textContent === "0.000", axis("X"));
      await say(page, "$21=1");
      await page.waitForFunction(() => document.getElementById("setting-21").value === "1");
      await page.getByRole("tab", {name: "Switches"}).click();
      const limit = page.getByRole("button", {name: "Limit X"});
      await limit.click();
      await isState(page, "Alarm");
      assert.equal(await limit.getAttribute("aria-pressed"), "true");
      assert.match(await text(page, "#alarm"), /ALARM:1/);
      await limit.click();
      await page.getByRole("button", {name: "Reset", exact: true}).click();
      await page.getByRole("button", {name: "Unlock"}).click();
      await isState(page, "Idle");
    },
  },
  {
    name: "a tool change is named, the job goes on where it was, and nothing else can run meanwhile",
    machine: TOOLS,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await dropAndTime(page, "board.nc", "G21 G90\nG1 X2 F3000\nM6 T2 (0.8 mm)\nG1 X4\n");
      await start(page);
      await isState(page, "Hold:0");
      await page.waitForFunction(() => document.getElementById("pause").textContent === "Insert tool 2, 0.8 mm, then Resume.");
      await reads(page, "^line 3 of 4: insert tool 2, 0.8 mm, then Resume$");
      assert.ok(await page.locator("#run").isDisabled());
      assert.ok(await page.locator("#resume").isEnabled());
      assert.deepEqual(await violations(page), []);
      await shoot("tool-change");
      await page.getByRole("button", {name: "Resume"}).click();
      await reads(page, "^done in");
      assert.equal(await text(page, axis("X")), "4.000");
      assert.ok(await page.locator("#pause").isHidden());
      assert.ok(await page.locator("#run").isEnabled());
    },
  },
  {
    name: "a wait for heat is named with the temperatures",
    machine: HEATED,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await page.waitForFunction(() => /^\d+\.\d °C$/.test(document.querySelector('[data-heater="nozzle"]')?.textContent));
      await drop(page, "warm.nc", "G21 G90\nM109 S60\nG1 X4 F3000\n");
      await page.waitForFunction(() => !document.getElementById("run").disabled);
      await start(page);
      await reads(page, "^line 2 of 3: heating: nozzle \\d+ of 60 °C$");
      assert.match(await text(page, "#pause"), /^Heating: nozzle/);
      await page.waitForFunction(() => / of 60$/.test(document.querySelector('[data-heater="nozzle"]').textContent));
      await shoot("heating");
      await page.getByRole("button", {name: "Reset", exact: true}).click();
      await reads(page, "^stopped by a reset at line 2$");
    },
  },
  {
    name: "a job that homes is timed and drawn",
    machine: HOMED,
    async run({page}) {
      await isState(page, "Alarm");
      await dropAndTime(page, "homes.nc", "$H\nG21 G91\nG1 X-20 F600\n");
      assert.ok((await number(page, "#job-time").catch(() => 0)) !== 0);
      assert.match(await text(page, "#job-time"), /^takes ([2-9]|\d\d)/);
      assert.ok((await page.evaluate(() => globalThis.leadscrew.job.path.count)) > 0);
    },
  },
  {
    name: "when zero moves, the job is drawn and checked anew; what is known to go wrong is asked about",
    machine: HOMED,
    async run({page, shoot}) {
      await isState(page, "Alarm");
      await page.getByRole("button", {name: "Home", exact: true}).click();
      await isState(page, "Home");
      await isState(page, "Idle");
      await dropAndTime(page, "square.nc", SQUARE);
      const drawn = await inked(page);
      assert.match(await text(page, "#findings"), /outside the travel/i);
      await start(page);
      await page.locator("#ask").waitFor();
      assert.match(await text(page, "#ask-text"), /^Line 2: .*travel.*run into its end/i);
      assert.deepEqual(await violations(page), []);
      await shoot("asked");
      await page.getByRole("button", {name: "Cancel"}).click();
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Jog X minus"}).click();
      await page.getByRole("button", {name: "Jog X minus"}).click();
      await page.getByRole("button", {name: "Jog X minus"}).click();
      await page.getByRole("button", {name: "Jog Y minus"}).click();
      await page.getByRole("button", {name: "Jog Y minus"}).click();
      await page.getByRole("button", {name: "Jog Y minus"}).click();
      await page.waitForFunction((selector) => Number.parseFloat(document.querySelector(selector).textContent) < -29, axis("Y"));
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Zero XY"}).click();
      await page.waitForFunction(() => document.getElementById("findings").childElementCount === 0 && /^takes/.test(document.getElementById("job-time").textContent));
      assert.equal(await page.evaluate(() => globalThis.leadscrew.job.path.count), 5);
      await page.getByRole("button", {name: "Fit job"}).click();
      assert.ok((await inked(page)) > drawn / 2);
      await start(page);
      await reads(page, "^done in");
    },
  },
  ...ENDS.map(([name, {machine = FAST, job, act, ends, unlocks, only}]) => ({
    name: `the account of a job: ${name}`,
    machine,
    only,
    expected: only && /WebSocket|ERR_CONNECTION/,
    async run({page, server}) {
      await isState(page, "Idle");
      await drop(page, "job.nc", job);
      await page.waitForFunction(() => !document.getElementById("run").disabled);
      await start(page);
      await act({page, server});
      await reads(page, ends);
      if (!unlocks) return;
      // What has ended stays so, and does not begin to count again.
      await isState(page, "Alarm");
      await unlocks(page);
      await isState(page, "Idle");
      await sleep(300);
      await reads(page, ends);
      assert.ok(await page.locator("#run").isEnabled());
    },
  })),
  {
    name: "a job that is too large for a page is refused in words",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      for (const [bytes, words] of [["new Uint8Array(200e6)", /^big.nc has 200 MB\. A page takes 32 MB and 1 million lines at most/], ["'\\n'.repeat(2e6)", /has 2000001 lines/]]) {
        await page.evaluate((bytes) => {
          const data = new DataTransfer();
          data.items.add(new File([new Function(`return ${bytes}`)()], "big.nc"));
          for (const type of ["dragenter", "drop"]) document.body.dispatchEvent(new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true}));
        }, bytes);
        await page.waitForFunction((words) => new RegExp(words).test(document.getElementById("job-facts").textContent), words.source);
        assert.ok(await page.locator("#run").isDisabled());
      }
      await dropAndTime(page, "square.nc", SQUARE);
    },
  },
  {
    name: "settings are shown with names and limits, changed, and a bad value is taken back",
    machine: FAST,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await page.getByRole("tab", {name: "Settings"}).click();
      const rate = page.getByLabel(/^\$110 X /);
      assert.equal(await rate.inputValue(), "6000.000");
      await shoot("settings");
      await rate.fill("5000");
      await rate.press("Tab");
      await page.waitForFunction(() => document.getElementById("setting-110").value === "5000.000");
      await rate.fill("-5");
      await rate.press("Tab");
      await page.waitForFunction(() => document.getElementById("setting-110").value === "5000.000");
      await page.getByRole("tab", {name: "Console"}).click();
      assert.match(await text(page, "#log"), /error:4/);
    },
  },
  {
    name: "with a sender on TCP the page watches and says so, and can still hold",
    only: "server",
    machine: FAST,
    lines: ["--tcp", "127.0.0.1:0"],
    async run({page, server, shoot}) {
      await isState(page, "Idle");
      const tcp = sender((await server.said(/tcp 127.0.0.1:0: ready at (\S+)/))[1]);
      await page.locator("#watching").waitFor();
      assert.match(await text(page, "#watching"), /sender.*tcp.*watches/i);
      assert.ok(await page.getByRole("button", {name: "Home", exact: true}).isDisabled());
      tcp.write(LONG.split("\n").slice(0, 7).join("\n") + "\n");
      await isState(page, "Run");
      await page.waitForFunction(() => document.querySelector("#program .now") !== null);
      await shoot("watching");
      await page.getByRole("button", {name: "Hold", exact: true}).click();
      await isState(page, "Hold:0");
      tcp.write("~");
      await isState(page, "Idle");
      tcp.end();
      await page.locator("#watching").waitFor({state: "hidden"});
      assert.ok(await page.getByRole("button", {name: "Home", exact: true}).isEnabled());
    },
  },
  {
    name: "a second page watches until the first has gone",
    only: "server",
    machine: FAST,
    async run({page, server, context}) {
      await isState(page, "Idle");
      await page.waitForFunction(() => !document.getElementById("home").disabled);
      const second = await context.newPage();
      await second.goto(await server.address());
      await second.locator("#watching").waitFor();
      assert.match(await text(second, "#watching"), /Another page/);
      await page.close();
      await second.waitForFunction(() => !document.getElementById("home").disabled, undefined, {polling: 50});
    },
  },
  {
    name: "the page comes back when the server does",
    only: "server",
    machine: FAST,
    expected: /WebSocket|ERR_CONNECTION/,
    async run({page, server}) {
      await isState(page, "Idle");
      const address = new URL(await server.address());
      await page.evaluate(() => (globalThis.before = true));
      await server.stop();
      await page.locator("#link").waitFor();
      assert.match(await text(page, "#state"), /not connected/);
      server.start(["--ws", address.host, "--token", address.searchParams.get("token")]);
      await isState(page, "Idle");
      assert.ok(await page.evaluate(() => globalThis.before), "the same page");
    },
  },
  {
    name: "a finished job is played from a file: the tool is where the job has it at each time",
    only: "server",
    alone: true,
    run: async ({page, server, shoot}) => {
      // 12 mm aside at 4 mm/s, 30 mm at 10 mm/s, back at the rate of 500 mm/min; ramps of 10 mm/s².
      const job = "G21 G90\n(cutter 3 mm)\nG1 X12 F240\nG1 Y30 F600\nG0 X0 Y0\n";
      await page.goto(playback(server.folder, "job.nc", job));
      assert.equal(await text(page, "#title"), "job.nc");
      assert.match(await text(page, "#now"), /^0\.00 s .*X 0\.000  Y 0\.000/);
      assert.match(await text(page, "#legend"), /tool 3 mm/);
      await page.locator("#slider").focus();
      await page.keyboard.press("End");
      assert.match(await text(page, "#now"), /done .*X 0\.000  Y 0\.000/);
      await page.getByRole("button", {name: "3D"}).click();
      await shoot("playback");
      await page.locator("#slider").focus();
      await page.keyboard.press("Home");
      assert.match(await text(page, "#now"), /^0\.00 s .*X 0\.000  Y 0\.000/);
      // Half a way of 12 mm: at half the time from its begin to its end, which are alike.
      const seconds = 12 / 4 + 4 / 10;
      await page.evaluate((half) => globalThis.leadscrew.show(half), seconds / 2);
      assert.match(await text(page, "#now"), /line 3 /);
      assert.ok(Math.abs(Number((await text(page, "#now")).match(/X (\S+)/)[1]) - 6) < 0.1, await text(page, "#now"));
      assert.match(await text(page, "#now"), / 240 mm\/min/);
      await page.getByRole("button", {name: "Play"}).click();
      await page.waitForFunction(() => document.getElementById("now").textContent.includes("done"));
      await page.getByRole("button", {name: "Play"}).waitFor();
      assert.deepEqual(await violations(page), []);
    },
  },
  ...OWNERS.map(([name, owner]) => ({
    name: `the owner of a ${name}: homes it, drops a job of the usual kind, sees it and runs it to its end`,
    // A cold nozzle that extrudes saves a minute of heating.
    machine: readFileSync(new URL(`${name}.toml`, MACHINES), "utf8").replace("[heaters.nozzle]", "[heaters.nozzle]\nextrusion = 30"),
    async run({page, shoot}) {
      await page.waitForFunction(() => /Idle|Alarm/.test(document.getElementById("state").textContent));
      if (owner.home) {
        await page.getByRole("button", {name: "Home", exact: true}).click();
        await isState(page, "Home");
        await isState(page, "Idle");
        await page.getByRole("button", {name: "Zero XY"}).click();
        await isZero(page, "X", "Y");
        if (owner.lower) {
          await page.locator("#jog-step").selectOption("10");
          await page.getByRole("button", {name: "Jog Z minus"}).click();
          await isState(page, "Jog");
          await isState(page, "Idle");
          await page.getByRole("button", {name: "Make this Z zero"}).click();
          await isZero(page, "Z");
        }
      } else if (name === "printer") {
        // Its files home it themselves.
        await unlock(page);
        await isState(page, "Idle");
      }
      const before = await inked(page);
      await dropAndTime(page, ...owner.file);
      assert.match(await text(page, "#findings"), new RegExp(`^${owner.notes ? `.*${owner.notes}` : ""}`));
      assert.equal(await page.locator("#findings button").count(), 0, await text(page, "#findings"));
      assert.match(await text(page, "#job-facts"), new RegExp(owner.facts));
      assert.match(await text(page, "#legend"), new RegExp(owner.legend));
      if (owner.isFlat) assert.equal(await page.locator("#legend i.ramp").count(), 0, "one depth, one colour");
      assert.ok((await inked(page)) > before + 50, "a picture");
      await start(page);
      await owner.during?.(page);
      await reads(page, "^done in");
      await shoot(`owner-${name}`);
      for (const [letter, place] of Object.entries(owner.at)) assert.ok(Math.abs((await number(page, axis(letter))) - place) < 0.02, `${letter} ${await text(page, axis(letter))}`);
    },
  })),
  {
    name: "what the machine says on all its lines stands in the console once",
    only: "server",
    machine: FAST,
    lines: ["--tcp", "127.0.0.1:0"],
    async run({page, server}) {
      await isState(page, "Idle");
      const tcp = sender((await server.said(/tcp 127.0.0.1:0: ready at (\S+)/))[1]);
      await page.locator("#watching").waitFor();
      await page.getByRole("tab", {name: "Console"}).click();
      const count = (words) => page.evaluate((words) => document.getElementById("log").textContent.split(words).length - 1, words);
      const before = await count("Grbl 1.1");
      await reset(page);
      await sleep(1500);
      assert.equal((await count("Grbl 1.1")) - before, 1);
      tcp.end();
    },
  },
  {
    name: "a file of another machine that this one cannot make is refused with what the machine file lacks",
    machine: FAST,
    async run({page}) {
      await isState(page, "Idle");
      await drop(page, "board.drl", "M48\nMETRIC\nT1C0.8\n%\nT1\nX2.0Y2.0\nM30\n");
      await page.waitForFunction(() => /depth_mm/.test(document.getElementById("job-facts").textContent));
      assert.ok(await page.locator("#run").isDisabled());
      await dropAndTime(page, "square.nc", SQUARE);
      assert.ok(await page.locator("#run").isEnabled());
    },
  },
  {
    name: "the page from a file is one document that asks for nothing",
    only: "file",
    async run({page}) {
      const asked = [];
      page.on("request", (request) => asked.push(request.url()));
      await page.reload();
      await isState(page, "Idle");
      await dropAndTime(page, "square.nc", SQUARE);
      const outside = asked.filter((address) => !/^(data|blob):/.test(address));
      assert.deepEqual(outside, [page.url()]);
    },
  },
  {
    name: "settings outlast the page, each machine's its own",
    only: "file",
    async run({page}) {
      const set = async (value) => {
        await isState(page, "Idle");
        await page.getByRole("tab", {name: "Settings"}).click();
        await page.locator("#setting-110").fill(value);
        await page.locator("#setting-110").press("Tab");
      };
      const shows = (value) => page.waitForFunction((value) => document.getElementById("setting-110")?.value === value, value);
      await set("777");
      await shows("777.000");
      await page.reload();
      await shows("777.000");
      await drop(page, "machine.toml", FAST);
      await shows("6000.000");
    },
  },
  {
    name: "a machine is dropped as a file; one that is wrong is told with its line, and the machine stays",
    only: "file",
    machine: FAST,
    async run({page}) {
      await dropAndTime(page, "square.nc", SQUARE);
      const fast = await text(page, "#job-time");
      await drop(page, "wrong.toml", "name = \"wrong\"\n[axes.x]\ntravle = 5\n");
      await page.getByRole("tab", {name: "Console"}).click();
      await page.waitForFunction(() => /machine:3.*travle/s.test(document.getElementById("log").textContent));
      assert.match(await text(page, "#machine-name"), /bench/);
      await drop(page, "slow.toml", "name = \"slow\"\n");
      await page.waitForFunction(() => document.getElementById("machine-name").textContent.includes("slow"));
      await page.waitForFunction((fast) => /^takes/.test(document.getElementById("job-time").textContent) && document.getElementById("job-time").textContent !== fast, fast);
    },
  },
  {
    name: "a job of 200 000 lines: first picture, frames, states",
    machine: "name = \"laser\"\n[settings]\n\"$32\" = 1\n\"$110\" = 12000\n\"$111\" = 12000\n\"$120\" = 1000\n\"$121\" = 1000\n\"$130\" = 400\n\"$131\" = 400\n",
    async run({page, shoot}) {
      await isState(page, "Idle");
      await page.evaluate(() => {
        const lines = ["G21 G90", "M4 S0", "G1 F6000"];
        for (let row = 0; row < 500; row++) {
          lines.push(`G0 Y${(row * 0.2).toFixed(2)} X${row % 2 ? 80 : 0}`);
          for (let k = 1; k < 400; k++) {
            const x = row % 2 ? 80 - k * 0.2 : k * 0.2;
            lines.push(`G1 X${x.toFixed(2)} S${Math.round(500 + 499 * Math.sin(row / 20) * Math.cos(x / 5))}`);
          }
        }
        const data = new DataTransfer();
        data.items.add(new File([lines.join("\n")], "raster.nc"));
        globalThis.dropped = performance.now();
        for (const type of ["dragenter", "drop"]) document.body.dispatchEvent(new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true}));
      });
      const first = await page.evaluate(async () => {
        const {job, drawn} = globalThis.leadscrew;
        // The whole path is in the picture, and what was checked is told.
        while (!job.checked || drawn() < 200_000) await new Promise((resolve) => setTimeout(resolve, 10));
        return performance.now() - globalThis.dropped;
      });
      await page.waitForFunction(() => globalThis.leadscrew.job.checked !== null);
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await isState(page, "Run");
      const seen = await page.evaluate(async () => {
        const [costs, states] = [[], new Set()];
        const end = performance.now() + 3000;
        while (performance.now() < end) {
          await new Promise((resolve) => setTimeout(resolve, 10));
          costs.push(globalThis.leadscrew.cost());
          states.add(globalThis.leadscrew.state().seconds);
        }
        return {cost: costs.sort((a, b) => a - b)[Math.floor(costs.length * 0.9)], states: states.size / 3};
      });
      await shoot("raster");
      console.log(`       first picture ${(first / 1000).toFixed(2)} s, script a frame ${seen.cost.toFixed(1)} ms (nine of ten), ${seen.states.toFixed(0)} states a second`);
      // A browser without a graphics card on a machine that does other things too: what is promised (2 s, 8 ms, 20 a second) is measured by hand.
      assert.ok(first < 60_000 && seen.cost < 100 && seen.states > 0.5, "far from what is promised");
    },
  },
  ...WINDOWS.map(([name, context]) => ({
    name: `${name}: nothing that axe finds, nothing wider than the window`,
    machine: HOMED,
    context,
    async run({page, shoot}) {
      await isState(page, "Alarm");
      assert.deepEqual(await violations(page), []);
      await page.getByRole("button", {name: "Home", exact: true}).click();
      await isState(page, "Idle");
      await dropAndTime(page, "pocket.nc", readFileSync(new URL("pocket.nc", EXAMPLES), "utf8"));
      await page.locator("#view-3d").click();
      assert.deepEqual(await violations(page), []);
      const dark = await page.evaluate(() => document.documentElement.dataset.theme);
      assert.equal(dark, name.includes("dark") ? "dark" : "light");
      await shoot(name);
      for (const tab of ["Console", "Settings", "Switches"]) {
        await page.getByRole("tab", {name: tab}).click();
        assert.deepEqual(await violations(page), [], tab);
      }
      const [inside, window] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(inside <= window, `${inside} pixels in ${window}`);
      if (name.startsWith("phone")) {
        const small = await page.evaluate(() => [...document.querySelectorAll("button, select, input:not([type=file])")]
          .filter((one) => one.checkVisibility() && Math.min(one.offsetWidth, one.offsetHeight) < 44).map((one) => one.id || one.textContent));
        assert.deepEqual(small, [], "too small for a finger");
        const below = await page.evaluate(() => {
          scrollTo(0, 0);
          return [".position", "#pad"].filter((part) => document.querySelector(part).getBoundingClientRect().bottom > innerHeight);
        });
        assert.deepEqual(below, [], "not on the first screen");
      }
    },
  })),
];
