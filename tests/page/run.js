// Tries the page of `leadscrew serve` in a real browser: every step is what a user does and sees.
//
//   node run.js [--screenshots FOLDER] [--turns] [NAME...]
//
// LEADSCREW names the program, CHROMIUM the browser, PAGE the page without a server (`cargo xtask page`).
//
// A case is tried on a page of a server, and on the page that is opened from its file: nobody may notice a difference. One with
// `only` is tried on that page alone. With `--turns` the others take turns: one is tried on the first page, the next on the other.
// Most of a case is waiting for a machine, so several are tried at the same time. The machine keeps the time of the clock, whatever
// else the computer does: what fails is tried once more, with nothing beside it.

import {mkdirSync} from "node:fs";
import {join} from "node:path";
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";
import {boardCases} from "./board_cases.js";
import {cases} from "./cases.js";
import {dialogueCases} from "./dialogue_cases.js";
import {faultCases} from "./fault_cases.js";
import {plateCases} from "./plate_cases.js";
import {probeCases} from "./probe_cases.js";
import {viewCases} from "./view_cases.js";
import {drop, keepsPast} from "./steps.js";
import {PATIENCE, Server} from "./server.js";

const args = process.argv.slice(2);
const at = args.indexOf("--screenshots");
const screenshots = at >= 0 ? args.splice(at, 2)[1] : null;
if (screenshots) mkdirSync(screenshots, {recursive: true});

const turns = args.indexOf("--turns");
if (turns >= 0) args.splice(turns, 1);

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell",
  args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--in-process-gpu"],
});
/** How many cases are tried at the same time. */
const AT_ONCE = 5;

/**
 * Waits until a test passes on a page. It is tried at each change of the document, so that nothing is missed that is shown for a
 * moment only, and every 50 ms. Not at the page's frames, as playwright does: there are none when nothing moves.
 */
async function seen(page, test, argument) {
  const passes = await page.evaluate(`new Promise((resolve) => {
    const end = (passes) => {
      clearInterval(timer);
      observer.disconnect();
      resolve(passes);
    };
    const until = performance.now() + ${PATIENCE};
    const attempt = () => {
      if ((${test})(${JSON.stringify(argument)})) end(true);
      else if (performance.now() > until) end(false);
    };
    const timer = setInterval(attempt, 50);
    const observer = new MutationObserver(attempt);
    observer.observe(document, {subtree: true, childList: true, characterData: true, attributes: true});
    attempt();
  })`);
  if (!passes) throw new Error(`never seen: ${test} ${argument ?? ""}`);
}

/** A page of `leadscrew serve`. */
async function served(one, page) {
  const server = new Server(one.machine ?? "name = \"test\"", one.lines ?? []);
  if (!one.alone) await page.goto(await server.address());
  return server;
}

/** The page without a server, opened from its file, with the machine dropped on it. */
async function opened(one, page) {
  await page.goto(pathToFileURL(process.env.PAGE).href);
  if (one.machine) {
    await drop(page, "machine.toml", one.machine);
    const name = one.machine.match(/name = "(.*)"/)[1];
    await page.waitForFunction((name) => document.getElementById("machine-name").textContent.includes(name), name);
  }
  return null;
}

let shot = 0;

/** Tries a case; answers if it held. */
async function attempt({one: given, way, open}) {
  // What a case keeps between its steps is this attempt's.
  const one = Object.create(given);
  const context = await browser.newContext({viewport: {width: 1440, height: 900}, ...one.context});
  await context.addInitScript(keepsPast);
  const page = await context.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  page.setDefaultTimeout(PATIENCE);
  page.waitForFunction = (test, argument) => seen(page, test, argument);
  const shoot = async (name) => screenshots && page.screenshot({path: join(screenshots, `${way}-${name}.png`)});
  const begun = Date.now();
  let [server, isHeld] = [null, true];
  try {
    await one.before?.(page);
    server = await open(one, page);
    await one.run({page, server, context, shoot});
    const unexpected = errors.filter((error) => !one.expected?.test(error));
    if (unexpected.length) throw new Error(`the page complains: ${unexpected.join("; ")}`);
    console.log(`ok     ${way}: ${one.name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    isHeld = false;
    if (screenshots) await page.screenshot({path: join(screenshots, `failed-${++shot}.png`)}).catch(() => {});
    console.log(`FAILED ${way}: ${one.name}\n       ${String(error.stack ?? error).replaceAll("\n", "\n       ")}\n       ${errors.join("\n       ")}`);
  }
  await context.close();
  await one.after?.();
  await server?.end();
  return isHeld;
}

/** Tries cases, some at the same time; answers those that did not hold. */
async function attemptAll(attempts, atOnce) {
  const [waiting, failed] = [[...attempts], []];
  await Promise.all(Array.from({length: atOnce}, async () => {
    for (let next = waiting.shift(); next; next = waiting.shift()) if (!await attempt(next)) failed.push(next);
  }));
  return failed;
}

const wanted = [...cases, ...boardCases, ...faultCases, ...plateCases, ...probeCases, ...dialogueCases, ...viewCases]
  .filter(({name}) => args.length === 0 || args.some((wanted) => name.includes(wanted)));
const attempts = wanted.flatMap((one, at) => [["server", served], ["file", opened]]
  .filter(([way], place) => one.only ? one.only === way : turns < 0 || place === at % 2)
  .map(([way, open]) => ({one, way, open})));
const failed = await attemptAll(attempts, AT_ONCE);
if (failed.length) console.log(`did not hold: ${failed.length} of ${attempts.length}; each is tried once more, alone`);
const faulty = await attemptAll(failed, 1);
await browser.close();
process.exit(faulty.length ? 1 : 0);
