// The plate under the probe: a height map, and a job bent by it.

import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {dropAndTime, isState, reads, say, text, violations, withProbe} from "./steps.js";

/** A plate that rises with X, falls with Y, and is bowed over its travel of 100 mm by 80 mm. */
const PLATE = withProbe("plate", `plate_height = -2
tilt_x = 0.01
tilt_y = -0.015
bow = 0.3
`);

/** Its height at a machine position, mm. */
function plate(x, y) {
  const along = (share) => 4 * share * (1 - share);
  return -2 + 0.01 * x - 0.015 * y + 0.3 * along(x / 100) * along(y / 80);
}

const JOB = "G21 G90\nG0 X10 Y10 Z1\nG1 Z-0.1 F600\nG1 X40 Y40 F2400\nG2 X30 Y30 I-10\nG1 X10\nG0 Z1\n";

/** What `leadscrew level` makes. */
function level(job, map) {
  const folder = mkdtempSync(join(tmpdir(), "leadscrew-level-"));
  writeFileSync(join(folder, "job.nc"), job);
  writeFileSync(join(folder, "map.csv"), map);
  const made = execFileSync(process.env.LEADSCREW ?? "leadscrew", ["level", "job.nc", "--map", "map.csv", "-o", "-", "--quiet"], {cwd: folder});
  rmSync(folder, {recursive: true});
  return made.toString();
}

const saved = async (page, name) => {
  const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", {name, exact: true}).click()]);
  return readFileSync(await file.path(), "utf8");
};

const fill = async (page, values) => {
  for (const [id, value] of Object.entries(values)) await page.locator(`#heights-${id}`).fill(String(value));
};

export const plateCases = [
  {
    name: "a height map: probed over the job, drawn, saved, and the job bent by it, checked and run at its depth over the plate",
    machine: PLATE,
    async run({page, shoot}) {
      await isState(page, "Idle");
      // Work zero is beside machine zero, and in inches nothing is lost.
      await say(page, "G10 L2 P1 X5 Y4 Z-1.5");
      await say(page, "G20 G91");
      await page.waitForFunction(() => globalThis.leadscrew.state().offset[0] === 5);
      await dropAndTime(page, "job.nc", JOB);
      await page.waitForFunction(() => !document.getElementById("level").disabled);
      await page.getByRole("button", {name: "Height map…"}).click();
      await fill(page, {spacing: 10, travel: 1.5, bottom: -5, feed: 120});
      assert.match(await text(page, "#heights-facts"), /^4 × 4 = 16 places\. These lines go out/);
      const lines = await page.locator("#heights-lines li").allTextContents();
      assert.equal(lines.length, 1 + 3 * 16);
      assert.ok(await page.locator("#heights-bend").isDisabled());
      const still = await page.evaluate(() => globalThis.leadscrew.state().moves);
      assert.deepEqual(await violations(page), []);
      await shoot("heights");
      assert.equal(await page.evaluate(() => globalThis.leadscrew.state().moves), still, "nothing has moved");
      await page.getByRole("button", {name: "Probe", exact: true}).click();
      // A place takes more than a second.
      await page.waitForFunction(() => document.getElementById("log").textContent.split("[PRB:").length > 8);
      await page.waitForFunction(() => /^The map has 4 × 4 places/.test(document.getElementById("heights-map").textContent));
      await shoot("heights-probed");
      const map = await saved(page, "Save the map");
      const places = map.trimEnd().split("\n").slice(1).map((line) => line.split(",").map(Number));
      assert.equal(places.length, 16);
      // A step of Z, and what it goes in the time of the input's filter.
      for (const [x, y, z] of places) assert.ok(Math.abs(z - 1.5 - plate(x + 5, y + 4)) <= 0.0031, `${x} ${y} ${z}`);
      await page.getByRole("button", {name: "Bend the job"}).click();
      await page.locator("#heights").waitFor({state: "hidden"});
      await page.waitForFunction(() => /^takes/.test(document.getElementById("job-time").textContent));
      const modes = await page.evaluate(() => document.getElementById("log").textContent.match(/\[GC:[^\]]*/g).length);
      await say(page, "$G");
      await page.waitForFunction((modes) => document.getElementById("log").textContent.match(/\[GC:[^\]]*/g).length > modes, modes);
      assert.match(await page.evaluate(() => document.getElementById("log").textContent.match(/\[GC:[^\]]*/g).at(-1)), /G20 G91/, "the modes are as before");
      const note = await text(page, "#findings .note");
      const error = Number(note.match(/^bent by a map, to 0\.005 mm; between its places the surface is within ([\d.]+) mm of it$/)[1]);
      assert.match(await text(page, "#legend"), /plate: Z -?[\d.]+ to Z -?[\d.]+/);
      assert.equal(await saved(page, "Save"), level(JOB, map), "as the command line makes it");
      assert.deepEqual(await violations(page), []);
      await page.getByRole("button", {name: "3D"}).click();
      await shoot("bent");
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await reads(page, "^done in");
      const off = await page.evaluate(() => {
        const {trace} = globalThis.leadscrew;
        return Array.from({length: trace.count}, (_, at) => trace.at(trace.first + at)).map(({x, y, z, line, kind}) => ({x, y, z, line, kind}));
      });
      const cuts = off.filter(({x, y, z}) => z < plate(x, y));
      assert.ok(cuts.length > 20, `${cuts.length}`);
      for (let at = 1; at < cuts.length; at++) {
        for (let part = 0; part <= 1; part += 0.05) {
          const [x, y, z] = ["x", "y", "z"].map((axis) => cuts[at - 1][axis] + part * (cuts[at][axis] - cuts[at - 1][axis]));
          const depth = plate(x, y) - z;
          assert.ok(Math.abs(depth - 0.1) <= 0.5 / 400 + 0.005 + error, `${depth} below the plate at ${x} ${y}, where the error is ${error}`);
        }
      }
    },
  },
  {
    name: "a tool change: the tool is named, a person jogs and touches off, and Resume goes on at the same height above the work",
    machine: `${PLATE.replace("plate", "change").replace(/tilt[^]*/, "")}[tool_change]\nshown = "hold"\n`,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await dropAndTime(page, "board.nc", "G21 G90\nG0 Z2\nM6 T2 (0.8 mm)\nG1 X4 F3000\nG1 X6\nG0 X1\n");
      assert.ok(await page.locator("#touch").isHidden());
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await page.locator("#touch").waitFor();
      assert.equal(await text(page, "#touch-title"), "Tool 2: 0.8 mm");
      for (const x of [10, 20]) {
        await page.getByRole("button", {name: "Jog X plus"}).click();
        await page.waitForFunction((x) => Math.abs(globalThis.leadscrew.state().position[0] - x) < 0.01 && globalThis.leadscrew.state().name === "Hold:0", x);
      }
      assert.equal(await text(page, "#pause"), "Insert tool 2, 0.8 mm, then Resume.");
      await page.locator("#touch-feed").fill("600");
      await page.locator("#touch-plate").fill("1.5");
      await page.getByRole("button", {name: "Probe Z"}).click();
      // The plate is at -2, its clip 1.5 mm above it in work coordinates; the tool is 3 mm above that.
      await page.waitForFunction(() => Math.abs(globalThis.leadscrew.state().position[2] - 1) < 0.01 && globalThis.leadscrew.state().name === "Hold:0");
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="Z"]').textContent === "4.500");
      assert.deepEqual(await violations(page), []);
      await shoot("change");
      await page.getByRole("button", {name: "Resume"}).click();
      await reads(page, "^done in");
      assert.ok(await page.locator("#touch").isHidden());
      assert.equal(await text(page, '#axes td[data-axis="X"]'), "1.000");
      assert.equal(await text(page, '#axes td[data-axis="Z"]'), "2.000");
      // Beside a job it is there too, and leaves the modes as they are.
      await say(page, "G20");
      await page.getByRole("button", {name: "Touch off…"}).click();
      await page.getByRole("button", {name: "The tip touches"}).click();
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="Z"]').textContent === "1.500");
      await page.getByRole("button", {name: "Probe Z"}).click();
      await page.waitForFunction(() => globalThis.leadscrew.state().name === "Idle" && document.querySelector('#axes td[data-axis="Z"]').textContent === "4.500");
    },
  },
  {
    name: "a probe that touches nothing ends the height map in words; a map of a file bends; one that is no grid, or too small, is told",
    only: "file",
    machine: PLATE,
    async run({page}) {
      await isState(page, "Idle");
      await dropAndTime(page, "job.nc", JOB);
      await page.getByRole("button", {name: "Height map…"}).click();
      await fill(page, {spacing: 20, travel: 1, bottom: -1});
      await page.getByRole("button", {name: "Probe", exact: true}).click();
      await page.waitForFunction(() => /ended early/.test(document.getElementById("heights-map").textContent));
      await page.waitForFunction(() => /ALARM:5/.test(document.getElementById("alarm").textContent));
      assert.ok(await page.locator("#heights-bend").isDisabled());
      await fill(page, {travel: -3});
      assert.match(await text(page, "#heights-facts"), /travels higher than it probes/);
      await fill(page, {travel: 1, spacing: 0.5});
      assert.match(await text(page, "#heights-facts"), /900 at most/);
      const open = (content) => page.locator("#heights-file").setInputFiles({name: "map.csv", mimeType: "text/plain", buffer: Buffer.from(content)});
      const says = (words) => page.waitForFunction((words) => new RegExp(words).test(document.getElementById("heights-map").textContent), words);
      await open("0,0,1\n5,5,1\n");
      await says("are no grid");
      await open("x,y,z\n0,0,0\n20,0,0\n0,50,0\n20,50,0\n");
      await says("The map has 2 × 2 places");
      await page.getByRole("button", {name: "Bend the job"}).click();
      await says("The job cannot be bent: line 4 of the job: X40\\.000 Y40\\.000 lies outside the map");
      await open("0 0 0\n50 0 0\n0 50 0.5\n50 50 0.5\n");
      await page.getByRole("button", {name: "Bend the job"}).click();
      await page.locator("#heights").waitFor({state: "hidden"});
      await page.waitForFunction(() => /three columns and rows/.test(document.querySelector("#findings .note")?.textContent));
    },
  },
];
