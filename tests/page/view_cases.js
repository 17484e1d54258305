// What is shown, and in which unit: inches, and the place of the tool at each time of a job.

import assert from "node:assert/strict";
import {dropAndTime, isState, reads, say, text, violations, WINDOWS} from "./steps.js";

const MACHINE = `name = "view"
[settings]
"$110" = 6000
"$111" = 6000
"$112" = 3000
"$120" = 800
"$121" = 800
"$122" = 800
`;
const near = (found, wanted, by) => assert.ok(Math.abs(found - wanted) <= by, `${found} and not ${wanted}`);

export const viewCases = [
  {
    name: "light or dark is as the system is, then as a person chooses; the browser's own controls go along",
    async run({page}) {
      const seen = () => page.evaluate(() => [document.documentElement.dataset.theme, getComputedStyle(document.documentElement).colorScheme]);
      const choose = page.getByRole("button", {name: "Change between light and dark"});
      for (const scheme of /** @type {("dark" | "light")[]} */ (["dark", "light", "dark"])) {
        await page.emulateMedia({colorScheme: scheme});
        await page.waitForFunction((wanted) => document.documentElement.dataset.theme === wanted, scheme);
        assert.deepEqual(await seen(), [scheme, scheme]);
      }
      await choose.click();
      assert.deepEqual(await seen(), ["light", "light"]);
      await page.emulateMedia({colorScheme: "light"});
      await page.emulateMedia({colorScheme: "dark"});
      assert.deepEqual(await seen(), ["light", "light"]);
      await choose.click();
      assert.deepEqual(await seen(), ["dark", "dark"]);
    },
  },
  {
    name: "the chart's legend has the chart's colours; the state is words with a name, no button; the tabs stand in one row",
    only: "server",
    async run({page}) {
      await isState(page, "Idle");
      assert.deepEqual(await page.locator(".chart .legend span").allTextContents(), ["feed", "power, full at the top"]);
      const colours = await page.evaluate(() => {
        const marks = [...document.querySelectorAll(".chart .legend i")].map((one) => getComputedStyle(one).backgroundColor);
        const wanted = ["--accent", "--chart-power"].map((name) => {
          const probe = document.body.appendChild(document.createElement("i"));
          probe.style.background = `var(${name})`;
          return getComputedStyle(probe).backgroundColor;
        });
        return [marks, wanted];
      });
      assert.deepEqual(colours[0], colours[1]);
      assert.equal(await page.locator(".state").innerText(), "State\nIdle");
      const look = await page.evaluate(() => {
        const {borderTopWidth, borderRadius, backgroundColor} = getComputedStyle(document.querySelector(".state"));
        return [borderTopWidth, borderRadius, backgroundColor];
      });
      assert.deepEqual(look, ["0px", "0px", "rgba(0, 0, 0, 0)"]);
      const rows = await page.evaluate(() => [...document.querySelectorAll('[role="tab"]')].map((one) => one.getBoundingClientRect().top));
      assert.deepEqual(rows.filter((top) => top !== rows[0]), []);
    },
  },
  {
    name: "in inches ($13) readings, feed, jog and the picture are in inches, and the machine goes as far",
    machine: MACHINE,
    async run({page, shoot}) {
      await isState(page, "Idle");
      await dropAndTime(page, "job.nc", "G20 G90\nG1 X2 Y1 F60\n");
      assert.match(await text(page, "#job-facts"), /56\.8 mm cut .* X 0 … 50\.8/);
      await say(page, "$13=1");
      await page.waitForFunction(() => document.getElementById("feed-unit").textContent === "in/min");
      await page.waitForFunction(() => /2\.24 in cut .* X 0 … 2 · Y 0 … 1/.test(document.getElementById("job-facts").textContent));
      assert.deepEqual(await page.locator("#jog-step option").allTextContents(), ["while held", "0.001 in", "0.01 in", "0.1 in", "1 in", "2 in", "own …"]);
      assert.equal(await page.locator("#jog-feed").inputValue(), "39");
      await page.locator("#jog-step").selectOption("1");
      await page.getByRole("button", {name: "Jog X plus"}).click();
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="X"]').textContent === "1.0000");
      near(await page.evaluate(() => globalThis.leadscrew.state().position[0]), 25.4, 0.003);
      await shoot("inches");
      await page.locator("#jog-step").selectOption("own");
      assert.equal(await text(page, "#jog-own"), "in ");
      await page.locator("#jog-mm").fill("0.5");
      await page.getByRole("button", {name: "Jog X minus"}).click();
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="X"]').textContent === "0.5000");
      assert.deepEqual(await violations(page), []);
      await say(page, "$13=0");
      await page.waitForFunction(() => document.querySelector('#axes td[data-axis="X"]').textContent === "12.700");
      await page.waitForFunction(() => /56\.8 mm cut/.test(document.getElementById("job-facts").textContent));
    },
  },
  ...WINDOWS.slice(0, 3).map(([name, context]) => ({
    name: `${name}: the slider goes along the time of a job: where the tool is then, at which line; the machine is shown again at Run`,
    only: name === "light" ? undefined : "file",
    machine: MACHINE,
    context,
    async run({page, shoot}) {
      await isState(page, "Idle");
      assert.ok(await page.locator("#scrub-row").isHidden());
      await say(page, "G10 L2 P1 X5 Y5");
      await page.waitForFunction(() => globalThis.leadscrew.state().offset[0] === 5);
      // 30 mm at 10 mm/s, a rest of 2 s, 20 mm at 20 mm/s; ramps take some hundredths.
      await dropAndTime(page, "job.nc", "G21 G90\nM3 S500\nG1 X30 F600\nG4 P2\nG1 Y20 F1200\n");
      await page.locator("#scrub-row").waitFor();
      const all = await page.evaluate(() => globalThis.leadscrew.job.profile.job_seconds);
      const at = async (seconds) => {
        await page.evaluate((share) => {
          const slider = document.getElementById("scrub");
          slider.value = String(share);
          slider.dispatchEvent(new Event("input"));
        }, seconds / all);
        return {words: await text(page, "#scrub-now"), shown: await page.evaluate(() => globalThis.leadscrew.shown())};
      };
      const half = await at(1.5);
      assert.match(half.words, /^1\.5 s of 6\.\d s, line 3$/);
      // Work zero is at X5 Y5.
      near(half.shown.position[0], 20, 0.3);
      near(half.shown.position[1], 5, 0.001);
      const rest = await at(4);
      near(rest.shown.position[0], 35, 0.001);
      near(rest.shown.position[1], 5, 0.001);
      await shoot(`scrub-${name}`);
      near((await at(all - 0.5)).shown.position[1], 15, 0.6);
      await page.locator("#scrub").focus();
      await page.keyboard.press("End");
      near((await page.evaluate(() => globalThis.leadscrew.shown())).position[1], 25, 0.001);
      assert.match(await text(page, "#scrub-now"), /line 5$/);
      assert.deepEqual(await violations(page), []);
      await page.getByRole("button", {name: "Machine", exact: true}).click();
      near((await page.evaluate(() => globalThis.leadscrew.shown())).position[0], 0, 0.001);
      await at(1);
      await page.getByRole("button", {name: "Run", exact: true}).click();
      await page.waitForFunction(() => document.getElementById("scrub-row").hidden);
      await page.waitForFunction(() => globalThis.leadscrew.shown().position[0] > 10);
      await reads(page, "^done in");
      await page.locator("#scrub-row").waitFor();
      if (name !== "phone") return;
      const small = await page.evaluate(() => [...document.querySelectorAll("button, select, input:not([type=file])")]
        .filter((one) => one.checkVisibility() && Math.min(one.offsetWidth, one.offsetHeight) < 44).map((one) => one.id || one.textContent));
      assert.deepEqual(small, [], "too small for a finger");
    },
  })),
];
