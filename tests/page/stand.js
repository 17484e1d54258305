// A stand-in for `navigator.serial`, put into the browser before the page: the bytes of its one port come here. The page's own
// code is as it is.

import {connect} from "node:net";
import {readFileSync} from "node:fs";
import {sleep} from "./server.js";

const CONFORMANCE = new URL("../conformance/", import.meta.url);

/** What the browser gets: a port that is chosen, opened, unplugged and plugged in as the standard has it. */
function browserSide() {
  let [isThere, isGranted] = [true, false];
  const gone = () => new DOMException("The device has been lost.", "NetworkError");
  const port = {
    readable: null, writable: null, out: null,
    getInfo: () => ({usbVendorId: 0x2341, usbProductId: 0x43}),
    async open({baudRate}) {
      if (!isThere) throw new DOMException("Failed to open serial port.", "NetworkError");
      if (port.readable) throw new DOMException("The port is already open.", "InvalidStateError");
      port.readable = new ReadableStream({start: (out) => (port.out = out)});
      port.writable = new WritableStream({write: (bytes) => isThere ? globalThis.standWrite([...bytes]) : Promise.reject(gone())});
      await globalThis.standOpen(baudRate);
    },
    async close() {
      if (port.readable?.locked || port.writable?.locked) throw new TypeError("Cannot cancel a locked stream");
      port.readable = port.writable = port.out = null;
    },
  };
  const serial = new EventTarget();
  serial.getPorts = async () => isGranted ? [port] : [];
  serial.requestPort = async () => {
    isGranted = true;
    return port;
  };
  Object.defineProperty(Navigator.prototype, "serial", {configurable: true, get: () => serial});
  globalThis.standSay = (bytes) => isThere && port.out?.enqueue(Uint8Array.from(bytes));
  globalThis.standPlug = (there) => {
    isThere = there;
    if (!there) {
      const out = port.out;
      port.readable = port.writable = port.out = null;
      out?.error(gone());
    }
    const event = new Event(there ? "connect" : "disconnect");
    Object.defineProperty(event, "target", {value: port});
    serial.dispatchEvent(event);
  };
}

/** The port, and what has gone over it. */
export class Stand {
  /** Lines that the page has sent, whole. */
  lines = [];
  /** Bytes that act at once. */
  pressed = [];
  /** How often it was opened, and at which speed. */
  opened = [];
  #begun = "";
  #waiting = [];
  #saying = null;

  /** @param {{hear(bytes: number[]): void, open?(): void}} far the board */
  constructor(far) {
    this.far = far;
    far.say = (bytes) => this.say(bytes);
  }

  async put(page) {
    this.page = page;
    await page.exposeFunction("standWrite", (bytes) => this.#write(bytes));
    await page.exposeFunction("standOpen", (baud) => {
      this.opened.push(baud);
      this.far.open?.();
    });
    await page.addInitScript(browserSide);
  }

  #write(bytes) {
    for (const byte of bytes) {
      if (byte === 0x3f) continue;
      if (byte === 0x18 || byte === 0x21 || byte === 0x7e || byte > 0x7f) this.pressed.push(byte);
      else if (byte === 10) {
        this.lines.push(this.#begun);
        this.#begun = "";
        this.each?.(this.lines.at(-1), this.job.length);
      } else this.#begun += String.fromCharCode(byte);
    }
    this.far.hear(bytes);
  }

  /** The lines of the job: those that are no questions of the page's. */
  get job() {
    return this.lines.filter((line) => !/^\$(I|\$|#|G)$/.test(line));
  }

  say(bytes) {
    this.#waiting.push(...bytes);
    this.#saying ??= this.#tell();
  }

  /** Passes on what waits, as much at a time as has come meanwhile. */
  async #tell() {
    while (this.#waiting.length) {
      const bytes = this.#waiting;
      this.#waiting = [];
      await this.page.evaluate((bytes) => globalThis.standSay(bytes), bytes).catch(() => {});
    }
    this.#saying = null;
  }

  plug(there) {
    return this.page.evaluate((there) => globalThis.standPlug(there), there);
  }

  /** Resolves when the page has sent so many lines of the job. */
  async reached(lines) {
    for (let tries = 0; this.job.length < lines; tries++) {
      if (tries > 1000) throw new Error(`the page has sent ${this.job.length} lines and not ${lines}`);
      await sleep(20);
    }
  }
}

/** A machine of `leadscrew serve`, at its TCP line. */
export class TcpBoard {
  constructor(address) {
    const [host, port] = address.split(":");
    this.socket = connect({host, port: Number(port)});
    this.socket.setNoDelay(true);
    this.socket.on("data", (bytes) => this.say(bytes));
  }

  hear(bytes) {
    this.socket.write(Uint8Array.from(bytes));
  }

  end() {
    this.socket.destroy();
  }
}

/** A board on a bad line: at a line of a job something happens, once. The page's questions ($) do not count. */
export class BadLine {
  #lines = 0;
  #sent = "";
  #oks = 0;
  #begun = "";
  /** What happens when so many lines have come, and the number of the `ok` that is lost; 0 for none. */
  #at = 0;
  #act = () => {};
  #loses = 0;

  constructor(board) {
    this.board = board;
    board.say = (bytes) => this.#pass(bytes);
  }

  /** Loses the `ok` of this number, counted from the next line on. */
  lose(number) {
    [this.#lines, this.#oks, this.#loses] = [0, 0, number];
  }

  /** Does something when the board has got so many lines, counted from the next one on. */
  at(lines, act) {
    [this.#lines, this.#at, this.#act] = [0, lines, act];
  }

  open() {
    this.board.open?.();
  }

  end() {
    this.board.end();
  }

  hear(bytes) {
    for (const byte of bytes) {
      this.board.hear([byte]);
      this.#sent += String.fromCharCode(byte);
      if (byte !== 10) continue;
      if (!/^[?!~]*\$/.test(this.#sent) && ++this.#lines === this.#at) this.#act();
      this.#sent = "";
    }
  }

  #pass(bytes) {
    if (!this.#loses) return this.say(bytes);
    const lines = (this.#begun + Buffer.from(bytes).toString("latin1")).split("\n");
    this.#begun = lines.pop();
    const kept = lines.filter((line) => line.trim() !== "ok" || !this.#lines || ++this.#oks !== this.#loses);
    if (kept.length) this.say(Buffer.from(`${kept.join("\n")}\n`, "latin1"));
  }
}

const recording = (name) => JSON.parse(readFileSync(new URL(name, CONFORMANCE), "utf8"));

/** Grbl 1.1h as it was recorded: what it says of itself, and the places of a job, 20 ms apart. Its buffer of 128 bytes overflows as
 * that of a board does, and 15 moves are planned ahead. */
export class RecordedBoard {
  #trace;
  #speed;
  #answers = new Map();
  #waiting = "";
  #isDeaf = false;
  #taken = 0;
  #begun = null;
  /** The most bytes that ever waited. */
  most = 0;
  overruns = 0;

  /** @param {number} [speed] how many times as fast as it was recorded */
  constructor(trace, speed = 1) {
    this.#speed = speed;
    this.#trace = recording(`traces/${trace}.json`);
    this.program = readFileSync(new URL(`traces/${trace}.nc`, CONFORMANCE), "utf8");
    this.lines = this.program.trimEnd().split("\n");
    for (const {op, recv} of recording("cases/dollar/dollar_rst_all.json").exchanges) if (/^cmd \$(\$|#|I|G)$/.test(op)) this.#answers.set(op.slice(4), recv);
    const settings = this.#trace.settings;
    const listed = this.#answers.get("$$").map((line) => {
      const value = settings[line.split("=")[0]];
      return value === undefined ? line : `${line.split("=")[0]}=${/\./.test(line) ? value.toFixed(3) : value}`;
    });
    this.#answers.set("$$", listed);
    this.banner = recording("cases/boot/boot_default.json").exchanges[0].recv;
    this.#timer = setInterval(() => this.#go(), 5);
  }

  #timer;

  /** Opening the port restarts the board, as it does an Arduino. */
  open() {
    this.restart();
  }

  restart() {
    [this.#waiting, this.#taken, this.#begun, this.#isDeaf] = ["", 0, null, true];
    setTimeout(() => {
      this.#isDeaf = false;
      this.#tell(this.banner);
    }, 300);
  }

  /** How long Grbl moved, s. */
  get took() {
    return this.#trace.first_to_last_step_s;
  }

  end() {
    clearInterval(this.#timer);
  }

  #tell(lines) {
    this.say(Buffer.from(lines.map((line) => `${line}\r\n`).join(""), "latin1"));
  }

  get #seconds() {
    return this.#begun === null ? 0 : ((performance.now() - this.#begun) / 1000) * this.#speed;
  }

  get #moves() {
    return this.#begun !== null && this.#seconds < this.#trace.first_byte_to_idle_s;
  }

  hear(bytes) {
    for (const byte of this.#isDeaf ? [] : bytes) {
      if (byte === 0x3f) this.#report();
      else if (byte === 0x18) this.restart();
      else if (this.#waiting.length >= 128) this.overruns++;
      else this.#waiting += String.fromCharCode(byte);
    }
    this.most = Math.max(this.most, this.#waiting.length);
  }

  /** Takes lines as long as there is room for their moves. */
  #go() {
    for (;;) {
      const end = this.#waiting.indexOf("\n");
      const done = Math.floor((this.#seconds / this.#trace.first_byte_to_idle_s) * this.lines.length);
      if (end < 0 || this.#taken >= done + 15) return;
      const line = this.#waiting.slice(0, end);
      this.#waiting = this.#waiting.slice(end + 1);
      if (this.#answers.has(line)) {
        this.#tell(this.#answers.get(line));
        continue;
      }
      if (line === this.lines[this.#taken]) {
        this.#begun ??= performance.now();
        this.#taken++;
        this.#tell(["ok"]);
      } else this.#tell(["error:20"]);
    }
  }

  #report() {
    const samples = this.#trace.position_samples;
    const {$100: x, $101: y, $102: z} = this.#trace.settings;
    const sample = this.#begun === null ? [0, 0, 0, 0] : samples.findLast(([ms]) => ms <= this.#seconds * 1000) ?? [0, 0, 0, 0];
    const place = this.#moves || this.#begun === null ? sample : samples.at(-1);
    const mm = [place[1] / x, place[2] / y, place[3] / z].map((value) => value.toFixed(3)).join(",");
    this.#tell([`<${this.#moves ? "Run" : "Idle"}|MPos:${mm}|FS:0,0|WCO:0.000,0.000,0.000>`]);
  }
}
