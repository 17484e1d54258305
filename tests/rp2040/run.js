// A Pico: `node run.js IMAGE TRACE`. The serial line is standard input and output; each change of a
// pin goes to the file TRACE as `pin level`.
import { openSync, readFileSync, writeSync } from 'node:fs';
import { RP2040 } from 'rp2040js';
import { load } from './rom.js';

const FLASH = 0x10000000;
const NANOS_PER_CYCLE = 1e9 / 125e6;
// Time of a byte at 115 200 baud.
const NANOS_PER_BYTE = 1e10 / 115200;
// Nobody waits for the emulator so long that it must not look at its input.
const NANOS_PER_TURN = 1e6;

const [image, trace] = process.argv.slice(2);
const chip = new RP2040();
chip.logger = { debug() {}, info() {}, warn() {}, error() {} };
chip.flash.set(readFileSync(image));
const romCycles = load(chip);
// As the ROM leaves the chip: the second stage of the loader runs, with a stack, called by nobody.
Object.assign(chip.core, { SP: 0x20042000, LR: 0, PC: FLASH });

const pins = openSync(trace, 'w');
chip.gpio.forEach((pin, number) => {
  let before = 0; // an input, too, is low before the board makes it an output
  pin.addListener((level) => {
    if (level > 1 || level === before) return;
    before = level;
    writeSync(pins, `${number} ${level}\n`);
  });
});

const [uart] = chip.uart;
uart.onByte = (byte) => process.stdout.write(String.fromCharCode(byte));
const unsent = [];
process.stdin.on('data', (bytes) => unsent.push(...bytes));
process.stdin.on('end', () => process.exit());

let ready = 0;
function turn() {
  const end = chip.clock.nanos + NANOS_PER_TURN;
  while (chip.clock.nanos < end) {
    if (unsent.length > 0 && chip.clock.nanos >= ready) {
      uart.feedByte(unsent.shift());
      ready = chip.clock.nanos + NANOS_PER_BYTE;
    }
    const before = romCycles();
    const cycles = chip.core.waiting ? 1 : chip.core.executeInstruction();
    chip.clock.tick((cycles + romCycles() - before) * NANOS_PER_CYCLE);
  }
  setImmediate(turn);
}
turn();
