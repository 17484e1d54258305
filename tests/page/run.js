// Tries the page of `leadscrew serve` in a real browser: every step is what a user does and sees.
//
//   node run.js [--screenshots FOLDER] [NAME...]
//
// LEADSCREW names the program, CHROMIUM the browser.

import {mkdirSync} from "node:fs";
import {join} from "node:path";
import {chromium} from "playwright-core";
import {cases} from "./cases.js";
import {PATIENCE, Server, sleep} from "./server.js";

const args = process.argv.slice(2);
const at = args.indexOf("--screenshots");
const screenshots = at >= 0 ? args.splice(at, 2)[1] : null;
if (screenshots) mkdirSync(screenshots, {recursive: true});

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell",
  args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--in-process-gpu"],
});
/** Waits until a test passes on a page. Not at its frames, as playwright does: there are none where nothing moves. */
async function seen(page, test, argument) {
  for (const until = Date.now() + PATIENCE; Date.now() < until; await sleep(50)) {
    if (await page.evaluate(test, argument)) return;
  }
  throw new Error(`never seen: ${test} ${argument ?? ""}`);
}

let failed = 0;
for (const one of cases.filter(({name}) => args.length === 0 || args.some((wanted) => name.includes(wanted)))) {
  const server = new Server(one.machine ?? "name = \"test\"", one.lines ?? []);
  const context = await browser.newContext({viewport: {width: 1440, height: 900}, ...one.context});
  const page = await context.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  page.setDefaultTimeout(PATIENCE);
  const begun = Date.now();
  try {
    const shoot = async (name) => screenshots && page.screenshot({path: join(screenshots, `${name}.png`)});
    page.waitForFunction = (test, argument) => seen(page, test, argument);
    if (!one.alone) await page.goto(await server.address());
    await one.run({page, server, context, shoot});
    const unexpected = errors.filter((error) => !one.expected?.test(error));
    if (unexpected.length) throw new Error(`the page complains: ${unexpected.join("; ")}`);
    console.log(`ok     ${one.name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed++;
    if (screenshots) await page.screenshot({path: join(screenshots, `failed-${failed}.png`)}).catch(() => {});
    console.log(`FAILED ${one.name}\n       ${String(error.stack ?? error).replaceAll("\n", "\n       ")}\n       ${errors.join("\n       ")}`);
  }
  await context.close();
  await server.end();
}
await browser.close();
process.exit(failed ? 1 : 0);
