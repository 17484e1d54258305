// A machine to try the page on, and a sender on one of its lines.

import {execFileSync, spawn} from "node:child_process";
import {mkdtempSync, rmSync, writeFileSync} from "node:fs";
import {connect} from "node:net";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {pathToFileURL} from "node:url";

/** How long anything may take, ms: on a busy computer. */
export const PATIENCE = 60_000;

/** A running `leadscrew serve`. */
export class Server {
  constructor(machine, more) {
    this.folder = mkdtempSync(join(tmpdir(), "leadscrew-page-"));
    writeFileSync(join(this.folder, "machine.toml"), machine);
    this.start(["--ws", "127.0.0.1:0", ...more]);
  }

  start(lines) {
    this.output = "";
    const options = ["serve", ...lines, "--machine", join(this.folder, "machine.toml"), "--state", join(this.folder, "state")];
    this.process = spawn(process.env.LEADSCREW ?? "leadscrew", options, {stdio: ["ignore", "pipe", "inherit"]});
    this.process.stdout.on("data", (text) => (this.output += text));
  }

  async address() {
    return (await this.said(/page: (http:\S+)/))[1];
  }

  async said(words) {
    for (const until = Date.now() + PATIENCE; Date.now() < until; await sleep(20)) {
      const found = this.output.match(words);
      if (found) return found;
    }
    throw new Error(`the server has not said ${words}: ${this.output}`);
  }

  async stop() {
    const gone = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill("SIGINT");
    await gone;
  }

  async end() {
    if (this.process.exitCode === null) await this.stop();
    rmSync(this.folder, {recursive: true, force: true});
  }
}

/** Runs a job; answers the address of its page, which is in `folder`. */
export function playback(folder, name, text) {
  const [job, page] = [join(folder, name), join(folder, `${name}.html`)];
  writeFileSync(job, text);
  execFileSync(process.env.LEADSCREW ?? "leadscrew", ["run", job, "--html", page, "--quiet"]);
  return pathToFileURL(page).href;
}

/** Connects to a TCP line as a sender does. */
export function sender(address) {
  const [host, port] = address.split(":");
  return connect({host, port: Number(port)});
}

export function sleep(time) {
  return new Promise((resolve) => setTimeout(resolve, time));
}
