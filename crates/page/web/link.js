// @ts-check
// The way to a machine behind a server: a WebSocket that comes back.

import {contentOf, frameOf} from "frames";

/** @typedef {import("frames").Ears} Ears */

const FIRST_WAIT = 300;
const LONGEST_WAIT = 3000;

export class Link {
  /** @type {WebSocket | null} */
  #socket = null;
  #wait = FIRST_WAIT;

  /** @param {Ears} ears */
  constructor(ears) {
    const address = new URL("page", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.search = location.search;
    this.address = address.href;
    this.ears = ears;
    this.#open();
  }

  /** Whether frames go out. */
  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /**
   * @param {number} tag
   * @param {Uint8Array | string} [content]
   */
  send(tag, content = new Uint8Array()) {
    if (this.isOpen) this.#socket?.send(frameOf(tag, content));
  }

  /**
   * Changes the machine; answers whether it can be changed: the machine of a server cannot.
   * @param {Uint8Array} _file
   */
  change(_file) {
    return false;
  }

  #open() {
    const socket = new WebSocket(this.address);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#wait = FIRST_WAIT;
      this.ears.opened(true, "");
    };
    socket.onmessage = (event) => {
      const bytes = new Uint8Array(event.data);
      this.ears.frame(bytes[0], contentOf(bytes));
    };
    socket.onclose = () => {
      this.ears.opened(false, "The connection is lost. Trying again …");
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT);
    };
  }
}
