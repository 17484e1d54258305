// @ts-check
// The frames between page and machine: the first byte says what the rest is.

/** What the machine sends. */
export const FROM = {WIRE: 1, STATE: 2, MOVES: 3, HELLO: 4, ROLE: 5, NOTE: 6, SCENE: 7, CHECK: 8, PROFILE: 9, PROGRESS: 10, SETTINGS: 11, TAKEN: 12};
/** What the page sends. */
export const TO = {WIRE: 1, KEY: 2, JOB: 3, CLEAR: 4};

/**
 * What a way to the machine tells of.
 * @typedef {object} Ears
 * @property {(tag: number, bytes: Uint8Array) => void} frame
 * @property {(open: boolean, why: string) => void} opened
 */

/**
 * A frame of the page's: tag, length, content.
 * @param {number} tag
 * @param {Uint8Array | string} content
 */
export function frameOf(tag, content) {
  const bytes = typeof content === "string" ? new TextEncoder().encode(content) : content;
  const frame = new Uint8Array(5 + bytes.length);
  frame[0] = tag;
  new DataView(frame.buffer).setUint32(1, bytes.length, true);
  frame.set(bytes, 5);
  return frame;
}
