// @ts-check
// A serial port of this computer (Web Serial): bytes out, bytes in, and the word that it is gone.

/**
 * What is used of the browser's `SerialPort`.
 * @typedef {object} Port
 * @property {(options: {baudRate: number, bufferSize: number}) => Promise<void>} open
 * @property {() => Promise<void>} close
 * @property {() => {usbVendorId?: number, usbProductId?: number}} getInfo
 * @property {ReadableStream<Uint8Array> | null} readable
 * @property {WritableStream<Uint8Array> | null} writable
 */
/**
 * What is used of the browser's `navigator.serial`.
 * @typedef {object} Ports
 * @property {() => Promise<Port[]>} getPorts
 * @property {() => Promise<Port>} requestPort
 * @property {(kind: "connect", listener: (event: Event) => void) => void} addEventListener
 */

/**
 * @typedef {object} Ears
 * @property {(bytes: Uint8Array) => void} bytes
 * @property {() => void} gone
 */

/** Bytes that the browser keeps for the page while it is busy: a second of the fastest board. */
const BUFFER = 65536;

/** The browser's ports; `null` if it has no Web Serial. @returns {Ports | null} */
export function ports() {
  return /** @type {any} */ (navigator).serial ?? null;
}

/** Makers of the chips that boards have. @type {Record<number, string>} */
const MAKERS = {0x2341: "Arduino", 0x2a03: "Arduino", 0x1a86: "CH340", 0x0403: "FTDI", 0x10c4: "CP210x", 0x0483: "STM32", 0x303a: "ESP32", 0x1209: "USB"};

/** What a port is called. @param {Port} port */
export function nameOf(port) {
  const {usbVendorId: maker, usbProductId: product} = port.getInfo();
  if (maker === undefined) return "serial port";
  const hex = (/** @type {number} */ value) => value.toString(16).padStart(4, "0");
  return `${MAKERS[maker] ?? "USB"} ${hex(maker)}:${hex(product ?? 0)}`;
}

export class Serial {
  /** @type {WritableStreamDefaultWriter<Uint8Array> | null} */
  #writer = null;
  /** @type {ReadableStreamDefaultReader<Uint8Array> | null} */
  #reader = null;
  #reading = Promise.resolve();
  #isOpen = false;

  /** @param {Port} port @param {Ears} ears */
  constructor(port, ears) {
    this.port = port;
    this.ears = ears;
  }

  /** @param {number} baudRate */
  async open(baudRate) {
    await this.port.open({baudRate, bufferSize: BUFFER});
    this.#writer = this.port.writable?.getWriter() ?? null;
    this.#isOpen = true;
    this.#reading = this.#read();
  }

  /** @param {Uint8Array} bytes */
  write(bytes) {
    this.#writer?.write(bytes).catch(() => this.#end());
  }

  async close() {
    this.#isOpen = false;
    try {
      await this.#reader?.cancel();
      await this.#reading;
      this.#writer?.releaseLock();
      await this.port.close();
    } catch {
      // A port that is gone needs no closing.
    }
  }

  async #read() {
    // Behind a fault of the line (a break, a frame that is no byte) the port has another stream; behind its loss it has none.
    while (this.#isOpen && this.port.readable) {
      this.#reader = this.port.readable.getReader();
      try {
        for (;;) {
          const {value, done} = await this.#reader.read();
          if (done) break;
          this.ears.bytes(value);
        }
        if (this.#isOpen) break;
      } catch {
        if (!this.port.readable) break;
      } finally {
        this.#reader.releaseLock();
      }
    }
    this.#end();
  }

  #end() {
    if (!this.#isOpen) return;
    this.close();
    this.ears.gone();
  }
}
