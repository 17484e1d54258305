// @ts-check
// A worker of a page without a server: the machine in real time, or one that looks at a job. The module does all the work.

/** Time between two steps of the machine, ms. */
const STEP = 10;

/**
 * What the module of `crates/wasm` exports.
 * @typedef {object} Simulator
 * @property {WebAssembly.Memory} memory
 * @property {(length: number) => number} room
 * @property {(kept: number) => void} machine
 * @property {() => void} hear
 * @property {(ms: number) => void} go
 * @property {() => void} look
 */
/** @typedef {{module: WebAssembly.Module, file: Uint8Array, kept: Uint8Array, job?: Uint8Array}} Task */

const page = /** @type {Worker} */ (/** @type {unknown} */ (self));
/** @type {Simulator} */
let simulator;

/** Passes a frame of the simulator's on. @param {number} address @param {number} length */
function tell(address, length) {
  const frame = new Uint8Array(simulator.memory.buffer, address, length).slice();
  page.postMessage(frame, [frame.buffer]);
}

/** Leaves bytes for the next call. @param {Uint8Array} bytes */
function leave(bytes) {
  const address = simulator.room(bytes.length);
  new Uint8Array(simulator.memory.buffer, address, bytes.length).set(bytes);
}

/** @param {Task} task */
function begin({module, file, kept, job}) {
  const {exports} = new WebAssembly.Instance(module, {page: {tell}});
  simulator = /** @type {Simulator} */ (/** @type {unknown} */ (exports));
  leave(Uint8Array.of(...file, ...kept));
  simulator.machine(kept.length);
  if (job) {
    leave(job);
    simulator.look();
    return close();
  }
  page.onmessage = (/** @type {MessageEvent<Uint8Array>} */ {data}) => {
    leave(data);
    simulator.hear();
  };
  const go = () => simulator.go(performance.now());
  go();
  setInterval(go, STEP);
}

page.onmessage = (/** @type {MessageEvent<Task>} */ {data}) => begin(data);
