// @ts-check
// The way to a machine in the browser itself: one worker is the machine, another looks at jobs.

import {by} from "dom";
import {FROM, contentOf, frameOf} from "frames";

/** @typedef {import("frames").Ears} Ears */

/** What workers tell of beside frames for the page: a job to be looked at, why a worker is of no further use, and the machine's memory. */
const LOOK = 128;
const FAILED = 129;
const KEEP = 130;

export class Link {
  #worker = URL.createObjectURL(new Blob([bytes("worker")], {type: "text/javascript"}));
  /** @type {Uint8Array} */
  #file = bytes("machine");
  /** The machine file before the one that is being tried. @type {Uint8Array | null} */
  #before = null;
  /** @type {WebAssembly.Module | null} */
  #module = null;
  /** @type {Worker | null} */
  #machine = null;
  /** @type {Worker | null} */
  #looker = null;

  /** @param {Ears} ears */
  constructor(ears) {
    this.ears = ears;
    this.#begin().catch((error) => this.#fail(`The simulator cannot begin: ${error}`));
  }

  /** Whether frames go out. */
  get isOpen() {
    return this.#machine !== null;
  }

  /**
   * @param {number} tag
   * @param {Uint8Array | string} [content]
   */
  send(tag, content = new Uint8Array()) {
    const frame = frameOf(tag, content);
    this.#machine?.postMessage(frame, [frame.buffer]);
  }

  /**
   * Changes the machine; answers whether it can be changed.
   * @param {Uint8Array} file
   */
  change(file) {
    this.#before = this.#file;
    this.#file = file;
    this.#restart();
    return true;
  }

  async #begin() {
    const packed = new Blob([bytes("simulator")]).stream();
    const module = await new Response(packed.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
    this.#module = await WebAssembly.compile(module);
    this.#restart();
  }

  #restart() {
    this.#end();
    if (!this.#module) return;
    this.#machine = this.#start();
    this.ears.opened(true, "");
  }

  #end() {
    this.#machine?.terminate();
    this.#looker?.terminate();
    this.#machine = null;
    this.#looker = null;
  }

  /**
   * Starts a worker: the machine, or one that looks at a job.
   * @param {Uint8Array} [job]
   */
  #start(job) {
    const worker = new Worker(this.#worker);
    worker.onmessage = ({data}) => this.#take(data);
    worker.onerror = (event) => this.#fail(`The simulator has failed: ${event.message}`);
    const kept = job ? new Uint8Array() : memoryOf(this.#file);
    worker.postMessage({module: this.#module, file: this.#file, kept, job});
    return worker;
  }

  /** @param {Uint8Array} frame */
  #take(frame) {
    if (frame[0] === LOOK) {
      this.#looker?.terminate();
      this.#looker = this.#start(frame.subarray(1));
      return;
    }
    if (frame[0] === FAILED) {
      const words = frame.subarray(1);
      if (this.#before) this.#goBack(words);
      else this.#fail(`The simulator has failed: ${new TextDecoder().decode(words)}`);
      return;
    }
    if (frame[0] === KEEP) return keep(this.#file, frame.subarray(1));
    if (frame[0] === FROM.HELLO) this.#before = null;
    this.ears.frame(frame[0], contentOf(frame));
  }

  /** Takes the machine of before: the file of the new one is wrong. @param {Uint8Array} words */
  #goBack(words) {
    this.#file = this.#before ?? this.#file;
    this.#before = null;
    this.ears.frame(FROM.NOTE, new TextDecoder().decode(words));
    this.#restart();
  }

  /** @param {string} why */
  #fail(why) {
    this.#end();
    this.ears.opened(false, `${why} Load the page again.`);
  }
}

/** The name under which the browser keeps the memory of a machine with this file. @param {Uint8Array} file */
const nameOf = (file) => `leadscrew ${new TextDecoder().decode(file)}`;

/** Keeps the memory of a machine. Where the browser keeps nothing, settings last as long as the page. @param {Uint8Array} file @param {Uint8Array} memory */
function keep(file, memory) {
  try {
    localStorage.setItem(nameOf(file), btoa(Array.from(memory, (byte) => String.fromCharCode(byte)).join("")));
  } catch {}
}

/** The memory that was kept of a machine, empty where there is none. @param {Uint8Array} file */
function memoryOf(file) {
  try {
    return decoded(localStorage.getItem(nameOf(file)) ?? "");
  } catch {
    return new Uint8Array();
  }
}

/** @param {string} text */
const decoded = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/** The data of an element. @param {string} id */
function bytes(id) {
  return decoded(by(id).textContent ?? "");
}
