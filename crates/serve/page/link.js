// @ts-check
// The connection to the machine: frames of bytes both ways, the first of them says what the rest is.

/** What the server sends. */
export const FROM = {WIRE: 1, STATE: 2, MOVES: 3, HELLO: 4, ROLE: 5, NOTE: 6, SCENE: 7, CHECK: 8, PROFILE: 9, PROGRESS: 10, SETTINGS: 11};
/** What the page sends. */
export const TO = {WIRE: 1, KEY: 2, JOB: 3, CLEAR: 4};

const FIRST_WAIT = 300;
const LONGEST_WAIT = 3000;

/**
 * @typedef {object} Ears
 * @property {(tag: number, bytes: Uint8Array) => void} frame
 * @property {(open: boolean) => void} opened
 */

/** A WebSocket that comes back. */
export class Link {
  /** @type {WebSocket | null} */
  #socket = null;
  #wait = FIRST_WAIT;

  /**
   * @param {string} address
   * @param {Ears} ears
   */
  constructor(address, ears) {
    this.address = address;
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
    const bytes = typeof content === "string" ? new TextEncoder().encode(content) : content;
    const frame = new Uint8Array(5 + bytes.length);
    frame[0] = tag;
    new DataView(frame.buffer).setUint32(1, bytes.length, true);
    frame.set(bytes, 5);
    if (this.isOpen) this.#socket?.send(frame);
  }

  #open() {
    const socket = new WebSocket(this.address);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#wait = FIRST_WAIT;
      this.ears.opened(true);
    };
    socket.onmessage = (event) => {
      const bytes = new Uint8Array(event.data);
      this.ears.frame(bytes[0], bytes);
    };
    socket.onclose = () => {
      this.ears.opened(false);
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT);
    };
  }
}
