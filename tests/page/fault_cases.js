// What goes wrong on the way to a board, at each line of a short job: what the page says, the bytes on the wire, the place.

import assert from "node:assert/strict";
import {connectPort} from "./board_cases.js";
import {drop, isState, reads, text} from "./steps.js";
import {Server, sleep} from "./server.js";
import {BadLine, RecordedBoard, Stand, TcpBoard} from "./stand.js";

const MACHINE = `name = "board"
[settings]
"$110" = 6000
"$111" = 6000
"$120" = 800
"$121" = 800
`;
/** Two of its lines are on the way at a time, and at the rest and at M5 the board waits: each line is a place of its own. */
const JOB = ["G21 G90", "M3 S500", "G1 X3 F1200", "G1 Y2", "G4 P0.1", "G1 X0", "G1 Y0", "M5"].map((line, at) => `${line} (${`line ${at + 1} of the job `.repeat(3)})`);
/** Where the tool is behind each of its lines. */
const PLACES = [[0, 0], [0, 0], [3, 0], [3, 2], [3, 2], [0, 2], [0, 0], [0, 0]];

const isAt = (page, [x, y]) => page.waitForFunction(([x, y]) => {
  const {position, name, quiet} = globalThis.leadscrew.state();
  return name === "Idle" && quiet && Math.abs(position[0] - x) < 0.01 && Math.abs(position[1] - y) < 0.01;
}, [x, y]);

const answered = (words) => words.match(/answered up to line (\d+), sent up to line (\d+)/).slice(1).map(Number);

/** What was sent is the beginning of the job, no line twice, none left out; what is told of it is so. */
function isAccount(words, sent, job) {
  const [last, reached] = answered(words);
  assert.deepEqual(sent, job.slice(0, sent.length));
  assert.equal(reached, sent.length, words);
  assert.ok(last <= reached, words);
}

/** Faults by name: each does its own at line `n`, and sees what comes of it. */
const FAULTS = {
  async "a lost ok"({page, line, job, n, begin, sent, board}) {
    line.lose(n);
    await begin();
    await reads(page, `^stopped by a lost answer at line ${job.length}$`);
    const words = await text(page, "#silent");
    assert.match(words, /^An answer is lost: the board stands still, and 1 line has no answer\./);
    assert.deepEqual(sent(), job);
    isAccount(words, sent(), job);
    assert.ok(await page.locator("#doubt").isHidden(), "its place is known");
    await board.rests(page, job.length);
    line.lose(0);
  },
  async "a reset"({page, line, job, n, begin, sent, board}) {
    line.at(n, () => board.reset());
    await begin();
    await reads(page, "^stopped by (a reset|ALARM:3) at line \\d+$");
    await page.locator("#doubt").waitFor();
    assert.match(await text(page, "#doubt"), /^ ?The place is not known: (the board has started anew|.*reset|.*motion)/i);
    const words = await page.evaluate(() => document.getElementById("log").textContent.match(/The machine was reset\. [^.]*\.nc: answered[^.]*|ALARM:3/g).at(-1));
    if (words !== "ALARM:3") isAccount(words, sent(), job);
    assert.ok(sent().length >= n && sent().length <= job.length);
    const before = sent().length;
    await sleep(300);
    assert.equal(sent().length, before, "nothing more is sent");
  },
  async "a pulled cable"({page, line, job, n, begin, sent, board, stand}) {
    line.at(n, () => stand.plug(false));
    await begin();
    await reads(page, "^stopped by the loss of the connection at line \\d+$");
    const words = await text(page, "#link");
    assert.match(words, /^The board is gone: its cable is unplugged, or it has no power\./);
    assert.match(await text(page, "#state"), /not connected/);
    const before = sent().length;
    isAccount(words, sent(), job);
    await stand.plug(true);
    await page.waitForFunction(() => document.getElementById("link").hidden && /^(Idle|Run)/.test(document.getElementById("state").textContent));
    assert.equal(sent().length, before, "nothing is sent again");
    await board.came(page, before);
  },
};

/** Goes through all lines and faults in one page, which is connected once. */
async function tryAll({page}, {stand, line, board, job}) {
  await isState(page, "Idle");
  await drop(page, "faults.nc", job.join("\n"));
  await page.waitForFunction(() => /^takes/.test(document.getElementById("job-time").textContent));
  await connectPort(page);
  for (const [name, fault] of Object.entries(FAULTS)) {
    for (let n = 1; n <= job.length; n++) {
      try {
        await board.anew(page, stand);
        await sleep(100);
        await page.waitForFunction(() => !document.getElementById("run").disabled && /^(takes|stopped)/.test(document.getElementById("job-time").textContent));
        let before = 0;
        const begin = () => {
          before = stand.job.length;
          return page.getByRole("button", {name: "Run", exact: true}).click();
        };
        await fault({page, line, job, n, begin, board, stand, sent: () => stand.job.slice(before)});
      } catch (error) {
        throw new Error(`${name} at line ${n}: ${error.message}`, {cause: error});
      }
    }
  }
}

/** A person says that the place is right, unlocks, and drives to zero. */
async function trust(page) {
  await page.waitForFunction(() => /^(Idle|Alarm)/.test(document.getElementById("state").textContent));
  if (await page.locator("#doubt").isVisible()) await page.getByRole("button", {name: "The place is right"}).click();
  if (await page.locator("#alarm").isVisible()) await page.getByRole("button", {name: "Unlock"}).click();
  await isState(page, "Idle");
}

export const faultCases = [
  {
    name: "faults at each line of a job, on the simulator's line: each is named, no line is sent twice, the place is known or said to be unknown",
    only: "file",
    async before(page) {
      this.machineServer = new Server(MACHINE, ["--tcp", "127.0.0.1:0"]);
      this.board = new TcpBoard((await this.machineServer.said(/tcp 127.0.0.1:0: ready at (\S+)/))[1]);
      this.line = new BadLine(this.board);
      this.stand = new Stand(this.line);
      await this.stand.put(page);
    },
    async run(tools) {
      const board = {
        reset: () => this.board.hear([0x18]),
        // It goes on with the lines that it has.
        rests: (page, lines) => isAt(page, PLACES[lines - 1]),
        came: async (page, lines) => {
          await isAt(page, PLACES[lines - 1]);
          assert.ok(await page.locator("#doubt").isHidden(), "its place is known");
        },
        async anew(page) {
          await trust(page);
          await page.evaluate(() => document.getElementById("go-zero").click());
          await isAt(page, [0, 0]);
        },
      };
      await tryAll(tools, {stand: this.stand, line: this.line, board, job: JOB});
    },
    async after() {
      this.line?.end();
      await this.machineServer?.end();
    },
  },
  {
    name: "faults at each line of a job, on a recorded Grbl: each is named, no line is sent twice, the place is known or said to be unknown",
    only: "file",
    async before(page) {
      this.board = new RecordedBoard("inch_square", 4);
      this.line = new BadLine(this.board);
      this.stand = new Stand(this.line);
      await this.stand.put(page);
    },
    async run(tools) {
      const {board: recorded} = this;
      const board = {
        reset: () => recorded.restart(),
        rests: (page) => isState(page, "Idle"),
        // Opening its port restarts it.
        async came(page) {
          await page.locator("#doubt").waitFor();
          assert.match(await text(page, "#doubt"), /has started anew/);
        },
        // It takes its recorded lines from the first one on.
        async anew(page, stand) {
          await trust(page);
          const asked = () => stand.lines.filter((line) => line === "$$").length;
          const before = asked();
          recorded.restart();
          // A board that has started anew is asked for its settings.
          for (let tries = 0; asked() === before && tries < 500; tries++) await sleep(20);
          await trust(page);
          assert.equal(stand.job.filter((line) => !recorded.lines.includes(line)).length, 0);
        },
      };
      await tryAll(tools, {stand: this.stand, line: this.line, board, job: recorded.lines});
    },
    async after() {
      this.line?.end();
    },
  },
];
