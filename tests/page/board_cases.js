// The page and a board at a serial port: what goes over the wire, and what is said when something goes wrong.

import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {drop, isState, reads, say, text, violations, WINDOWS} from "./steps.js";
import {Server, sleep} from "./server.js";
import {RecordedBoard, Stand, TcpBoard} from "./stand.js";

const BOARD = `name = "board"
[settings]
"$110" = 6000
"$111" = 6000
"$112" = 3000
"$120" = 800
"$121" = 800
"$122" = 800
`;
const LONG = ["G21 G90", "M3 S500", ...Array.from({length: 40}, (_, i) => `G1 X${i % 2 ? 0 : 3} Y${i / 5} F2400`), "M5"];

/** Connects the page to the port; waits until the board is greeted. */
export async function connectPort(page) {
  await page.getByRole("button", {name: "Connect…"}).click();
  await page.getByRole("button", {name: "Choose a port…"}).click();
  await page.waitForFunction(() => document.getElementById("where").textContent === "board" && /Idle|Alarm|Run|Hold/.test(document.getElementById("state").textContent));
}

async function dropped(page, name, content) {
  await drop(page, name, content);
  await page.waitForFunction(() => /^takes/.test(document.getElementById("job-time").textContent));
}

const run = (page) => page.getByRole("button", {name: "Run", exact: true}).click();
const log = (page) => page.evaluate(() => document.getElementById("log").textContent);

/** A case with a machine of `leadscrew serve` at the port. */
function withMachine(name, act, more = {}) {
  return {
    name: `a board: ${name}`, machine: undefined, ...more,
    async before(page) {
      this.machineServer = new Server(BOARD + (more.board ?? ""), ["--tcp", "127.0.0.1:0"]);
      const address = (await this.machineServer.said(/tcp 127.0.0.1:0: ready at (\S+)/))[1];
      this.board = new TcpBoard(address);
      this.stand = new Stand(this.board);
      await this.stand.put(page);
    },
    async run(tools) {
      await isState(tools.page, "Idle");
      await act({...tools, stand: this.stand, board: this.board});
    },
    async after() {
      this.board?.end();
      await this.machineServer?.end();
    },
  };
}

/** A case with a recorded Grbl at the port. */
function withRecording(name, trace, act, more = {}) {
  return {
    name: `a recorded Grbl: ${name}`, ...more,
    async before(page) {
      this.board = new RecordedBoard(trace);
      this.stand = new Stand(this.board);
      await this.stand.put(page);
    },
    async run(tools) {
      await isState(tools.page, "Idle");
      await act({...tools, stand: this.stand, board: this.board});
    },
    async after() {
      this.board.end();
    },
  };
}

/** Places and power, as the page shows them, until the machine rests. */
function wayUntilIdle(page) {
  return page.evaluate(async () => {
    const [seen, now] = [[], () => globalThis.leadscrew.state()];
    for (let rested = 0; rested < 40; await new Promise((resolve) => setTimeout(resolve, 20))) {
      const {position: [x, y, z], power, spindle, name} = now();
      seen.push({x, y, z, power: spindle ? power : 0});
      rested = name === "Idle" ? rested + 1 : 0;
    }
    return seen;
  });
}

/** The lines that `leadscrew resume` makes. */
function rest(job, line, clearance) {
  const folder = mkdtempSync(join(tmpdir(), "leadscrew-rest-"));
  writeFileSync(join(folder, "job.nc"), job.join("\n"));
  const made = execFileSync(process.env.LEADSCREW ?? "leadscrew", ["resume", "job.nc", "--line", String(line), "--clearance", String(clearance), "-o", "-", "--quiet"], {cwd: folder});
  rmSync(folder, {recursive: true});
  return made.toString().trimEnd().split("\n");
}

/** What the page has sent of the job is its beginning: no line twice, none left out. */
function isBeginning(sent, job) {
  assert.deepEqual(sent, job.slice(0, sent.length));
}

/** The way to a board is the same code on both pages: what goes wrong on it is tried on the page from a file. */
export const boardCases = [
  withMachine("a job's lines go over the wire once each and in order; position, zero and settings are the board's", async ({page, stand, shoot}) => {
    await connectPort(page);
    assert.deepEqual(stand.opened, [115200]);
    assert.match(await text(page, "#machine-name"), /^Grbl 1\.1h · Arduino 2341:0043$/);
    await page.getByRole("tab", {name: "Settings"}).click();
    assert.equal(await page.locator("#setting-110").inputValue(), "6000.000");
    await dropped(page, "long.nc", LONG.join("\n"));
    await run(page);
    await isState(page, "Run");
    await shoot("board-runs");
    await reads(page, "^done in");
    assert.deepEqual(stand.job, LONG);
    assert.equal(await text(page, '#axes td[data-axis="Y"]'), "7.800");
    await say(page, "$110=777");
    await page.waitForFunction(() => document.getElementById("setting-110").value === "777.000");
    await page.getByRole("button", {name: "Connect…"}).click();
    await page.getByRole("button", {name: "Back to the simulator"}).click();
    await page.waitForFunction(() => document.getElementById("where").textContent === "simulator" && document.getElementById("state").textContent === "Idle");
    assert.notEqual(await page.locator("#setting-110").inputValue(), "777.000");
  }),
  ...[19].map((number) => withMachine(`its cable is pulled at line ${number}, which is said; put in again, its place is known, and nothing is sent again`, async ({page, stand}) => {
    await connectPort(page);
    await dropped(page, "long.nc", LONG.join("\n"));
    await run(page);
    await stand.reached(number);
    await stand.plug(false);
    await reads(page, "^stopped by the loss of the connection at line \\d+$");
    assert.match(await text(page, "#link"), /The board is gone: its cable is unplugged, or it has no power\. long\.nc: answered up to line \d+, sent up to line \d+/);
    assert.match(await text(page, "#state"), /not connected/);
    isBeginning(stand.job, LONG);
    const sent = stand.job.length;
    await stand.plug(true);
    await page.waitForFunction(() => document.getElementById("link").hidden && document.getElementById("state").textContent === "Idle");
    assert.equal(stand.job.length, sent);
    // It has gone on with the lines that it had: its place is what it says.
    assert.ok(await page.locator("#doubt").isHidden());
  })),
  withMachine("what waits for a person is said as on the simulator, and hold, resume and reset go over the wire", async ({page, stand}) => {
    await connectPort(page);
    await dropped(page, "pause.nc", "G21 G90\nG1 X2 F3000\nM0 (turn the work)\nG1 X0\n");
    await run(page);
    await reads(page, "^line 3 of 4: the program pauses, turn the work: Resume goes on$");
    await page.getByRole("button", {name: "Resume"}).click();
    await reads(page, "^done in");
    await dropped(page, "long.nc", LONG.join("\n"));
    await run(page);
    await isState(page, "Run");
    await page.getByRole("button", {name: "Hold", exact: true}).click();
    await reads(page, "^held at line \\d+ of 43: Resume goes on$");
    await isState(page, "Hold:0");
    await page.getByRole("button", {name: "Reset", exact: true}).click();
    await reads(page, "^stopped by a reset at line \\d+$");
    await isState(page, "Idle");
    assert.ok(await page.locator("#doubt").isHidden(), "a reset at rest loses no place");
    assert.deepEqual(stand.pressed.filter((byte) => byte !== 0x85), [0x7e, 0x21, 0x18]);
  }),
  withMachine("a tool change is named, a person jogs in it, and each answer is taken for its own line", async ({page, stand}) => {
    // What is checked is checked for the board: the simulator has no M6.
    await connectPort(page);
    await say(page, "M6 T3 (1 mm drill)");
    await page.locator("#touch").waitFor();
    assert.equal(await text(page, "#touch-title"), "Tool 3: 1 mm drill");
    for (const x of [10, 20]) {
      await page.getByRole("button", {name: "Jog X plus"}).click();
      await page.waitForFunction((x) => globalThis.leadscrew.state().position[0] === x && globalThis.leadscrew.state().name === "Hold:0", x);
    }
    assert.equal(await text(page, "#pause"), "Insert tool 3, 1 mm drill, then Resume.");
    await page.getByRole("button", {name: "The tip touches"}).click();
    await page.waitForFunction(() => globalThis.leadscrew.state().offset[2] === 0);
    await page.getByRole("button", {name: "Resume"}).click();
    await page.locator("#touch").waitFor({state: "hidden"});
    await isState(page, "Idle");
    assert.deepEqual(stand.job, ["M6 T3 (1 mm drill)", "$J=G91G21X10F1000", "$J=G91G21X10F1000", "G21G10L20P0Z0"]);
    await say(page, "G0 X1");
    await page.waitForFunction(() => globalThis.leadscrew.state().position[0] === 1);
  }, {only: "file", board: "[tool_change]\nshown = \"hold\"\n"}),
  withMachine("a job is checked with its settings and at its zero, anew when they change", async ({page}) => {
    await drop(page, "wide.nc", "G21 G90\nG1 X30 F1200\nX0\n");
    await page.waitForFunction(() => /^takes/.test(document.getElementById("job-time").textContent));
    const simulated = await text(page, "#job-time");
    await connectPort(page);
    await page.waitForFunction((before) => /^takes/.test(document.getElementById("job-time").textContent) && document.getElementById("job-time").textContent !== before, simulated);
    const board = await text(page, "#job-time");
    await say(page, "$120=10");
    await page.waitForFunction((before) => /^takes/.test(document.getElementById("job-time").textContent) && document.getElementById("job-time").textContent !== before, board);
  }),
  withMachine("frame goes round the job's box, inside it to the step, with the beam off, and leaves everything else as it is", async ({page, stand}) => {
    await connectPort(page);
    await dropped(page, "box.nc", "G21 G90\nG0 X1.5 Y2\nG1 Z-0.5 F600\nG1 X9 F1200\nY6.25\nG0 Z1\n");
    await page.getByRole("button", {name: "Frame…"}).click();
    assert.match(await text(page, "#framing-text"), /7\.50 × 4\.25 mm, at Z 1\.000, to which it rises first/);
    assert.ok(await page.locator("#framing-beam").isHidden());
    await page.getByRole("button", {name: "Go round"}).click();
    const seen = await wayUntilIdle(page);
    // Steps of the machine are 0.004 mm.
    const inside = seen.filter(({z}) => Math.abs(z - 1) < 0.002);
    for (const {x, y, power} of inside.slice(inside.findIndex(({x, y}) => x > 1.49 && y > 1.99))) {
      assert.ok(x >= 1.496 && x <= 9.004 && y >= 1.996 && y <= 6.254 && power === 0, `${x} ${y} ${power}`);
    }
    assert.ok(Math.max(...seen.map(({x}) => x)) > 8.9 && Math.max(...seen.map(({y}) => y)) > 6.15, "all the way round");
    assert.ok(stand.job.every((line) => line.startsWith("$J=")), stand.job.join());
  }),
  withMachine("frame with a beam: never above the power that was set, dark at the end", async ({page, stand}) => {
    await connectPort(page);
    await say(page, "$32=1");
    await page.waitForFunction(() => document.getElementById("power-name").textContent === "Laser");
    await dropped(page, "sign.nc", "G21 G90\nM4 S0\nG1 X8 F3000 S900\nY5\nX0\nM5\n");
    await page.getByRole("button", {name: "Frame…"}).click();
    await page.locator("#framing-power").fill("40");
    await page.getByRole("button", {name: "Go round"}).click();
    const seen = await wayUntilIdle(page);
    const most = Math.max(...seen.map(({power}) => power));
    assert.ok(most > 0.02 && most <= 0.1, `${most}`);
    assert.equal(seen.at(-1).power, 0);
    assert.deepEqual(stand.job.filter((line) => /S/.test(line)), ["M4S100", "M5S0"]);
  }),
  withMachine("a job that was broken off is begun at a line: the way there is that of `leadscrew resume`, shown before it moves", async ({page, stand, shoot}) => {
    await connectPort(page);
    const job = ["G21 G90", "M3 S500", "G0 Z2", "G0 X1 Y1", "G1 Z-1 F900", ...Array.from({length: 30}, (_, i) => `G1 X${i % 2 ? 1 : 9} Y${1 + i / 4} F2400`), "G0 Z2", "M5"];
    await dropped(page, "pocket.nc", job.join("\n"));
    await run(page);
    await page.waitForFunction(() => globalThis.leadscrew.state().position[1] > 3);
    await page.getByRole("button", {name: "Hold", exact: true}).click();
    await isState(page, "Hold:0");
    await page.getByRole("button", {name: "Reset", exact: true}).click();
    await reads(page, "^stopped by a reset at line \\d+$");
    await isState(page, "Idle");
    const place = await page.evaluate(() => globalThis.leadscrew.state().position);
    const sent = stand.job.length;
    await page.waitForFunction(() => !document.getElementById("from").disabled);
    await page.getByRole("button", {name: "From a line…"}).click();
    const line = Number(await page.locator("#begin-line").inputValue());
    // The line that the tool was on goes through the place where it stopped.
    const [a, b] = [job[line - 2], job[line - 1]].map((text) => Number(text.match(/Y([\d.]+)/)[1]));
    assert.ok(place[1] >= a - 0.01 && place[1] <= b + 0.01, `line ${line} for Y ${place[1]}`);
    for (const wanted of [7, 36, line]) {
      await page.locator("#begin-line").fill(String(wanted));
      await page.locator("#begin-clearance").fill("5");
      await page.waitForFunction((wanted) => document.getElementById("begin-facts").textContent.startsWith(`Before line ${wanted} `), wanted);
      const shown = await page.locator("#begin-lines li").allTextContents();
      assert.deepEqual([...shown, ...job.slice(wanted - 1)], rest(job, wanted, 5));
    }
    assert.equal(stand.job.length, sent, "nothing has moved");
    await shoot("begin");
    assert.deepEqual(await violations(page), []);
    await page.locator("#begin-line").fill("99");
    await page.waitForFunction(() => /The job has 37 lines/.test(document.getElementById("begin-facts").textContent) && document.getElementById("begin-run").disabled);
    await page.locator("#begin-line").fill(String(line));
    await page.waitForFunction(() => !document.getElementById("begin-run").disabled);
    await page.getByRole("button", {name: "Run from there"}).click();
    await reads(page, "^done in");
    assert.deepEqual(stand.job.slice(sent), rest(job, line, 5));
  }),
  withMachine("its outputs are shown and switched, and a gamepad's jog ends with its byte when the stick is let go", async ({page, stand}) => {
    await connectPort(page);
    await page.getByRole("button", {name: "Output 1"}).click();
    await page.waitForFunction(() => document.querySelectorAll("#outputs button")[1].getAttribute("aria-pressed") === "true");
    await page.getByRole("button", {name: "Output 1"}).click();
    await page.waitForFunction(() => document.querySelectorAll("#outputs button")[1].getAttribute("aria-pressed") === "false");
    assert.deepEqual(stand.job, ["M64P1", "M65P1"]);
    await page.evaluate(() => {
      globalThis.pad = {axes: [0, 0, 0, 0], buttons: []};
      Object.defineProperty(Navigator.prototype, "getGamepads", {configurable: true, value: () => [globalThis.pad]});
    });
    await page.getByLabel("gamepad").check();
    await sleep(150);
    await page.evaluate(() => (globalThis.pad.axes = [-1, -1, 0, 0]));
    await page.waitForFunction(() => globalThis.leadscrew.state().position[1] > 0.5);
    assert.deepEqual(stand.pressed, []);
    assert.match(stand.job.at(-1), /^\$J=G91G21X-([\d.]+)Y\1F1000$/);
    // It is gone: as good as let go.
    await page.evaluate(() => (globalThis.pad = null));
    await isState(page, "Idle");
    assert.deepEqual(stand.pressed, [0x85]);
    const [x, y] = await page.evaluate(() => globalThis.leadscrew.state().position);
    assert.ok(Math.abs(x + y) < 0.01 && y < 20, `${x} ${y}`);
  }, {only: "file", board: "[outputs]\ncount = 2\n"}),
  withMachine("its cable is pulled while it touches off: nothing is on the way any more, the modes come back, and it can be done again", async ({page, stand}) => {
    await connectPort(page);
    await page.getByRole("button", {name: "Touch off…"}).click();
    await page.locator("#touch-feed").fill("600");
    await page.getByRole("button", {name: "Probe Z"}).click();
    for (let tries = 0; !stand.lines.includes("G38.2Z-20F600") && tries < 500; tries++) await sleep(20);
    await stand.plug(false);
    await page.locator("#link").waitFor();
    await stand.plug(true);
    await page.locator("#link").waitFor({state: "hidden"});
    await isState(page, "Alarm");
    const before = stand.lines.length;
    await page.getByRole("button", {name: "Unlock"}).click();
    await isState(page, "Idle");
    for (let tries = 0; !stand.lines.slice(before).includes("G0") && tries < 500; tries++) await sleep(20);
    assert.deepEqual(stand.lines.slice(before).filter((line) => line.startsWith("G")), ["G90", "G0"], "it was left in G91");
    await page.waitForFunction(() => globalThis.leadscrew.state().quiet);
    await page.locator("#touch-plate").fill("3");
    // The machine is not free until the modes' lines are answered: a person presses again.
    const isZero = async () => (await page.locator("#axes td[data-axis=Z]").textContent()) === "3.000";
    for (let tries = 0; !(await isZero()) && tries < 50; tries++) {
      await page.getByRole("button", {name: "The tip touches"}).click();
      await sleep(200);
    }
    assert.ok(await isZero(), "the tip touches");
  }, {only: "file"}),
  withMachine("a macro of one's own is kept by the browser, its lines go out one after the other, and an error ends them", async ({page, stand}) => {
    await connectPort(page);
    const keep = async (name, lines) => {
      if (!(await page.locator("#macro-name").isVisible())) await page.getByText("Macros of your own").click();
      await page.locator("#macro-name").fill(name);
      await page.locator("#macro-lines").fill(lines);
      await page.getByRole("button", {name: "Keep"}).click();
    };
    await keep("Park", "G53 G0 X2\n\nG53 G0 Y3");
    await keep("Wrong", "G0 X1\nG1 X\nG0 X5");
    await page.getByRole("button", {name: "Park", exact: true}).click();
    await page.waitForFunction(() => globalThis.leadscrew.state().position[1] === 3);
    await page.waitForFunction(() => globalThis.leadscrew.state().name === "Idle" && globalThis.leadscrew.state().quiet);
    await page.getByRole("button", {name: "Wrong", exact: true}).click();
    await page.getByRole("tab", {name: "Console"}).click();
    await page.waitForFunction(() => /the lines behind it are not sent: G0 X5/.test(document.getElementById("log").textContent));
    assert.deepEqual(stand.job, ["G53 G0 X2", "G53 G0 Y3", "G0 X1", "G1 X"]);
    assert.deepEqual(await violations(page), []);
    await page.reload();
    await page.getByRole("button", {name: "Park", exact: true}).waitFor();
    await page.getByText("Macros of your own").click();
    await page.getByRole("button", {name: "Remove Park"}).click();
    await page.getByRole("button", {name: "Park", exact: true}).waitFor({state: "detached"});
  }, {only: "file"}),
  withMachine("its settings are saved to a file; from one, those that differ are set, homing before soft limits", async ({page, stand}) => {
    await connectPort(page);
    await page.getByRole("tab", {name: "Settings"}).click();
    const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", {name: "Save to a file"}).click()]);
    const text = readFileSync(await saved.path(), "utf8");
    assert.match(text, /^\$0=10\n(.*\n)*\$110=6000\.000\n(.*\n)*\$132=200\.000\n/);
    const wanted = text.replace("$20=0", "$20=1").replace("$22=0", "$22=1").replace("$120=800.000", "$120=500");
    await page.locator("#settings-file").setInputFiles({name: "mine.txt", mimeType: "text/plain", buffer: Buffer.from(`${wanted}$9999=1\n`)});
    await page.waitForFunction(() => document.getElementById("setting-120").value === "500.000" && document.getElementById("setting-20").value === "1");
    assert.deepEqual(stand.job, ["$22=1", "$20=1", "$120=500"]);
    assert.match(await log(page), /3 settings differ from the file, and are set; this machine has no \$9999/);
  }, {only: "file"}),
  withRecording("its laser job of 1217 lines is timed as it took, and streamed without overrun, each line once", "job_laser", async ({page, stand, board, shoot}) => {
    await connectPort(page);
    await dropped(page, "laser.nc", board.program);
    const seconds = Number.parseFloat((await text(page, "#job-time")).match(/takes ([\d.]+) s/)[1]);
    assert.ok(Math.abs(seconds - board.took) <= 0.1, `${seconds} s against ${board.took} s`);
    await run(page);
    await reads(page, "^done in");
    assert.deepEqual(stand.job, board.lines);
    assert.equal(board.overruns, 0);
    assert.ok(board.most > 60 && board.most <= 128, `${board.most} bytes`);
    await shoot("recorded");
  }),
  ...[300].map((number) => withRecording(`it loses power for a moment at line ${number}: it has forgotten its place, which is said`, "spiral", async ({page, stand, board}) => {
    await connectPort(page);
    await dropped(page, "spiral.nc", board.program);
    await run(page);
    await stand.reached(number);
    board.restart();
    await reads(page, "^stopped by a reset at line \\d+$");
    await page.locator("#doubt").waitFor();
    assert.match(await text(page, "#doubt"), /the board has started anew, and has forgotten it/);
    isBeginning(stand.job, board.lines);
    const sent = stand.job.length;
    await page.getByRole("button", {name: "Run", exact: true}).click();
    await page.locator("#ask").waitFor();
    assert.match(await text(page, "#ask-text"), /The place is not known/);
    await page.getByRole("button", {name: "Cancel"}).click();
    assert.equal(stand.job.length, sent);
  }, {only: "file"})),
  withRecording("its cable is pulled, and its power with it: the place is unknown when it comes back", "spiral", async ({page, stand, board}) => {
    await connectPort(page);
    await dropped(page, "spiral.nc", board.program);
    await run(page);
    await stand.reached(100);
    await stand.plug(false);
    await reads(page, "^stopped by the loss of the connection");
    await stand.plug(true);
    await page.locator("#doubt").waitFor();
    assert.match(await text(page, "#doubt"), /has started anew/);
  }, {only: "file"}),
  {
    name: "a port at which nothing answers, and one at which noise comes, are told apart",
    only: "file",
    async before(page) {
      this.far = {hear() {}, open() {}};
      this.stand = new Stand(this.far);
      await this.stand.put(page);
    },
    async run({page}) {
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Connect…"}).click();
      await page.locator("#baud").selectOption("9600");
      await page.getByRole("button", {name: "Choose a port…"}).click();
      await page.waitForFunction(() => /Nothing answers at 9600 baud/.test(document.getElementById("link").textContent));
      this.far.hear = () => this.far.say(Array.from({length: 60}, (_, i) => 0x80 + i));
      await page.getByRole("button", {name: "Connect…"}).click();
      await page.getByRole("button", {name: "Connect Arduino 2341:0043"}).click();
      await page.waitForFunction(() => /no text: another baud rate/.test(document.getElementById("link").textContent));
      assert.ok(await page.locator("#run").isDisabled());
    },
  },
  ...WINDOWS.slice(0, 3).map(([name, context]) => withMachine(
    `${name}: nothing that axe finds, in the dialogue and beside it`, async ({page, shoot}) => {
      await page.getByRole("button", {name: "Connect…"}).click();
      assert.deepEqual(await violations(page), []);
      await shoot(`ports-${name}`);
      await page.getByRole("button", {name: "Choose a port…"}).click();
      await page.waitForFunction(() => document.getElementById("where").textContent === "board");
      // It is still under way when axe has looked.
      await dropped(page, "long.nc", Array(8).fill(LONG.join("\n")).join("\n"));
      await run(page);
      await isState(page, "Run");
      assert.deepEqual(await violations(page), []);
      await page.getByRole("button", {name: "Reset", exact: true}).click();
      await page.locator("#doubt").waitFor();
      await sleep(300);
      assert.deepEqual(await violations(page), []);
      await shoot(`board-${name}`);
      if (name === "phone") {
        const small = await page.evaluate(() => [...document.querySelectorAll("button, select, input:not([type=file])")]
          .filter((one) => one.checkVisibility() && Math.min(one.offsetWidth, one.offsetHeight) < 44).map((one) => one.id || one.textContent));
        assert.deepEqual(small, [], "too small for a finger");
      }
    }, {context, only: name === "light" ? undefined : "file"})),
  {
    name: "a browser without Web Serial says so in the dialogue",
    only: "file",
    async before(page) {
      await page.addInitScript(() => Object.defineProperty(Navigator.prototype, "serial", {configurable: true, get: () => undefined}));
    },
    async run({page}) {
      await isState(page, "Idle");
      await page.getByRole("button", {name: "Connect…"}).click();
      assert.match(await text(page, "#ports-text"), /This browser has no Web Serial/);
      assert.ok(await page.locator("#ports-choose").isHidden());
      await page.getByRole("button", {name: "Close"}).click();
    },
  },
];
