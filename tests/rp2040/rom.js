// The functions of the RP2040's ROM that an image calls (RP2040 data sheet, section 2.8.3): the
// emulator has no ROM. Each is an instruction that stops, at which its work is done here.

const view = new DataView(new ArrayBuffer(4));

function toFloat(bits) {
  view.setUint32(0, bits);
  return view.getFloat32(0);
}

function toBits(value) {
  view.setFloat32(0, value); // rounds to nearest, ties to even
  return view.getUint32(0);
}

const floats = (work) => ([a, b]) => toBits(work(toFloat(a), toFloat(b)));

const long = (low, high) => (BigInt(high >>> 0) << 32n) | BigInt(low >>> 0);

// By their offset in the table of single precision. Doubles round twice, with the same result; whole
// numbers are below 2 to the 53rd here.
const SINGLE = {
  0x00: floats((a, b) => a + b),
  0x04: floats((a, b) => a - b),
  0x08: floats((a, b) => a * b),
  0x0c: floats((a, b) => a / b),
  0x18: floats((a) => Math.sqrt(a)),
  0x1c: ([a]) => Math.min(Math.max(Math.floor(toFloat(a)), -(2 ** 31)), 2 ** 31 - 1),
  0x5c: ([low, high]) => toBits(Number(BigInt.asIntN(64, long(low, high)))),
  0x64: ([low, high]) => toBits(Number(long(low, high))),
};

function copy([to, from, count], chip) {
  for (let at = 0; at < count; at += 1) chip.writeUint8(to + at, chip.readUint8(from + at));
  return to;
}

function fill([to, byte, count], chip) {
  for (let at = 0; at < count; at += 1) chip.writeUint8(to + at, byte & 0xff);
  return to;
}

const ones = ([word]) => word.toString(2).replaceAll('0', '').length;

// By their codes in the table of functions.
const NAMED = {
  MC: copy,
  C4: copy,
  MS: fill,
  S4: fill,
  P3: ones,
  L3: ([word]) => Math.clz32(word),
  T3: ([word]) => (word === 0 ? 32 : 31 - Math.clz32(word & -word)),
  R3: ([word]) => parseInt([...word.toString(2).padStart(32, '0')].reverse().join(''), 2),
};

// Cycles of a function; those of floats take some 40 to 80.
const CYCLES = 80;

const LOOKUP = 0x100;
const FLOATS = 0x200;
const CODE = 0x400;

// Puts the ROM into a chip. Returns the cycles that its functions have taken so far.
export function load(chip) {
  const works = [];
  const enter = (work) => {
    const at = CODE + 4 * works.length;
    chip.bootrom[at / 4] = 0x4770be00 | works.length; // BKPT number; BX LR
    works.push(work);
    return at | 1;
  };
  const places = Object.entries(NAMED).map(([name, work]) => [name, enter(work)]);
  for (let offset = 0; offset < 0x80; offset += 4) {
    const missing = () => {
      throw new Error(`the ROM has no function of floats at 0x${offset.toString(16)}: add it to rom.js`);
    };
    chip.bootrom[(FLOATS + offset) / 4] = enter(SINGLE[offset] ?? missing);
  }
  const known = new Map([...places, ['SF', FLOATS]].map(([name, at]) => [String(name), Number(at)]));
  const lookup = enter(([, code]) => {
    const name = String.fromCharCode(code & 0xff, code >> 8);
    const at = known.get(name);
    if (at === undefined) throw new Error(`the ROM has no ${name}: add it to rom.js`);
    return at;
  });
  chip.bootrom[0x10 / 4] = 3 << 24; // the ROM's version
  chip.bootrom[0x14 / 4] = LOOKUP | (LOOKUP << 16); // both tables, which lookup does not read
  chip.bootrom[0x18 / 4] = lookup;
  let cycles = 0;
  chip.onBreak = (number) => {
    const registers = chip.core.registers;
    registers[0] = works[number]([...registers.slice(0, 3)], chip) >>> 0;
    cycles += CYCLES;
  };
  return () => cycles;
}
