// @ts-check
// The frames between page and machine: the first byte says what the rest is.

import {readState} from "state";

/** What the machine sends. */
export const FROM = {WIRE: 1, STATE: 2, MOVES: 3, HELLO: 4, ROLE: 5, NOTE: 6, SCENE: 7, CHECK: 8, PROFILE: 9, PROGRESS: 10, SETTINGS: 11, TAKEN: 12, REST: 13, PLAIN: 14};
/** What the page sends. */
export const TO = {WIRE: 1, KEY: 2, JOB: 3, CLEAR: 4};

/**
 * What a way to the machine tells of: a frame by its tag and its content, as `contentOf` reads it.
 * @typedef {object} Ears
 * @property {(tag: number, content: any) => void} frame
 * @property {(open: boolean, why: string) => void} opened
 */

/**
 * Bytes on a line of the machine's.
 * @typedef {{channel: number, fromMachine: boolean, number: number, bytes: Uint8Array}} WireFrame `number`: of answers before them
 */

/** @param {Uint8Array} bytes */
const number = (bytes) => new DataView(bytes.buffer, bytes.byteOffset).getUint32(4, true);
/** @param {Uint8Array} bytes */
const text = (bytes) => new TextDecoder().decode(bytes.subarray(1));

/** Readers of the frames that are no JSON. @type {Record<number, (bytes: Uint8Array) => any>} */
const READERS = {
  [FROM.WIRE]: (bytes) => ({channel: bytes[1], fromMachine: bytes[2] === 1, number: number(bytes), bytes: bytes.subarray(8)}),
  [FROM.STATE]: readState,
  [FROM.MOVES]: (bytes) => ({first: number(bytes), moves: bytes.subarray(8)}),
  [FROM.SCENE]: (bytes) => bytes.subarray(8),
  [FROM.NOTE]: text,
  [FROM.PROGRESS]: text,
};

/** What a frame says. @param {Uint8Array} bytes */
export function contentOf(bytes) {
  return (READERS[bytes[0]] ?? ((bytes) => JSON.parse(text(bytes))))(bytes);
}

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
