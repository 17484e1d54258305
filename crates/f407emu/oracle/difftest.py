"""Random single instructions, bare and inside IT, on the emulator's core and on Unicorn (QEMU's Cortex-M4).

difftest.py VECTORS [SEED [COUNT [all|fp|nan|16]]]: VECTORS is the built example `vectors`. See README.md.
"""
import collections, random, struct, subprocess, sys, tempfile, zlib
from unicorn import *; from unicorn.arm_const import *
from capstone import *
VECTORS = sys.argv[1]
rnd = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
N = int(sys.argv[3]) if len(sys.argv) > 3 else 20000
kind = sys.argv[4] if len(sys.argv) > 4 else "all"
BASE = 0x20000000; CODE = BASE + 0x8000; D = tempfile.mkdtemp() + "/"
cs = Cs(CS_ARCH_ARM, CS_MODE_THUMB | CS_MODE_MCLASS)
def r32():
    k = rnd.random()
    if k < .25: return rnd.choice([0, 1, 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF, 0xFFFF, 0x8000, 0x7FFF, 0x00FF00FF])
    if k < .45: return rnd.getrandbits(rnd.choice([4, 5, 8, 16]))
    return rnd.getrandbits(32)
def rf():
    k = rnd.random()
    if k < .25: return rnd.choice([0, 0x80000000, 0x3F800000, 0xBF800000, 0x7F800000, 0xFF800000, 0x7FC00000, 0x4F000000, 0xCF000000, 0x3F000000, 0x7F7FFFFF, 0x00800000])
    if k < .85: return struct.unpack("<I", struct.pack("<f", rnd.uniform(-1, 1) * 10 ** rnd.randint(-6, 9)))[0]
    return rnd.getrandbits(32) if kind == "nan" else struct.unpack("<I", struct.pack("<f", float(rnd.randint(-70000, 70000))))[0]
FP = [0xEE000A00, 0xEE200A00, 0xEE300A00, 0xEE800A00, 0xEE900A00, 0xEEA00A00, 0xEEB00A40, 0xEEB00A00, 0xEEB40A40, 0xEEB50A40, 0xEEB80A40, 0xEEBC0A40, 0xEEBD0A40, 0xEEBA0A40, 0xEEBE0A40, 0xED900A00, 0xED800A00, 0xEC900A00, 0xEE100A10, 0xEE000A10, 0xEEF10A10, 0xEC500A10, 0xEC400B10, 0xED900B00]
def gen():
    k = rnd.random()
    if kind == "fp" or kind == "nan" or (kind == "all" and k < .2):
        b = rnd.choice(FP)
        x = b | (rnd.getrandbits(32) & 0x004FF0EF if b >> 28 == 0xE and (b >> 24 & 15) == 14 else rnd.getrandbits(32) & 0x00EFF1FF)
        if rnd.random() < .5: x ^= rnd.getrandbits(1) << 6
        return struct.pack("<HH", x >> 16 & 0xFFFF, x & 0xFFFF)
    if kind == "16" or (kind == "all" and k < .45): return struct.pack("<H", rnd.randrange(0, 0xE800))
    h1 = rnd.randrange(0xE800, 0x10000)
    h2 = rnd.getrandbits(16)
    if 0xFA00 <= h1 < 0xFB00: h2 |= 0xF000
    if rnd.random() < .3: h2 &= 0x0FFF | rnd.getrandbits(3) << 12
    return struct.pack("<HH", h1, h2)
cases = []
while len(cases) < N:
    c = gen()
    d = next(cs.disasm(c, CODE, 1), None)
    if d is None: continue
    mn = d.mnemonic.split(".")[0]
    t = d.mnemonic + " " + d.op_str
    if mn.startswith(("svc", "bkpt", "cps", "msr", "mrs", "wf", "isb", "dsb", "dmb", "udf", "sev", "setend", "hvc", "smc", "cdp", "mcr", "mrc", "ldc", "stc", "bxns", "blxns", "sg", "tt", "hint", "csdb", "sel", "fldm", "fstm", "vmrs", "vmsr", "vld1", "vld2", "vld3", "vld4", "vst1", "vst2", "vst3", "vst4", "vrint", "vsel", "vmaxnm", "vminnm", "ldrex", "strex", "clrex", "it", "pld", "pli", "dbg", "lda", "stl", "yield", "vcvtb", "vcvtt", "cps", "esb", "trap")): continue
    if len(c) == 4 and (", pc" in t or " pc" in t or "sp" in t.replace("vcvt.", "")): continue
    if len(c) == 4 and mn.startswith(("ldm", "stm", "ldr", "str")) and "!" in t:
        pass
    if any(x in t for x in ("f64",)) : continue
    inIT = mn not in ("b", "bl", "cbz", "cbnz", "bx", "blx", "tbb", "tbh", "pop", "ldm") and not mn.startswith("b") and rnd.random() < .25
    code = (struct.pack("<H", 0xBF08 | rnd.randrange(0, 14) << 4) if inIT else b"") + c
    regs = []
    for i in range(13):
        regs.append(BASE + 0x2000 + (rnd.randrange(0, 0x3000) & ~3) if rnd.random() < .5 else r32())
    regs += [BASE + 0x4000, r32() | 1]
    cases.append((regs, rnd.getrandbits(5) << 27, [rf() for _ in range(32)], rnd.getrandbits(4) << 28 | (rnd.getrandbits(2) << 22 if mn == 'vcvtr' else 0), (code + b"\x00\xbf" * 4)[:8], 2 if inIT else 1, t, c))
ram = bytes(rnd.getrandbits(8) for _ in range(0x8000))
open(D + "ram.bin", "wb").write(ram)
with open(D + "in.bin", "wb") as f:
    for r, a, s, fs, code, n, t, c in cases: f.write(struct.pack("<15I", *r) + struct.pack("<I", a) + struct.pack("<32I", *s) + struct.pack("<I", fs) + code + struct.pack("<I", n))
subprocess.check_call([VECTORS, D])
res = open(D + "out.bin", "rb").read()
uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, UC_CPU_ARM_CORTEX_M4)
uc.mem_map(BASE, 0x20000)
uc.mem_map(0xE000E000, 0x1000)
uc.reg_write(UC_ARM_REG_FPEXC, 0x40000000)
R = [UC_ARM_REG_R0 + i for i in range(13)] + [UC_ARM_REG_SP, UC_ARM_REG_LR]
S = [UC_ARM_REG_S0 + i for i in range(32)]
def why(c, t, mn, uc, emu, st):
    """Group of a mismatch: encodings ARMv7-M calls UNPREDICTABLE or with non-zero should-be-zero bits, and set-up artefacts."""
    if len(c) == 2: return None
    h1, h2 = struct.unpack("<HH", c)
    if st and mn[0] == "b" and mn[:2] not in ("bi", "bf") and h1 >> 11 == 30: return "branch target outside memory"
    if h1 & 0xFE00 == 0xEA00 and h2 & 0x8000: return "SBZ"
    if h1 & 0xFB40 == 0xF340 or h1 & 0xFB10 == 0xF300 or h1 & 0xFA00 == 0xF200:
        if h1 & 0xFF00 in (0xF300, 0xF700) and (h1 & 0x400 or h2 & 0x20): return "SBZ"
        if mn in ("ubfx", "sbfx") and ((h2 >> 10 & 0x1C) | (h2 >> 6 & 3)) + (h2 & 31) > 31: return "bitfield past bit 31"
    if h1 & 0xFF80 == 0xFA00 and h2 & 0x40: return "SBZ"
    if h1 & 0xFE40 == 0xE800:
        l = bin(h2).count("1"); rn = h1 & 15
        if h2 & 0x2000 or l < 2 or (h1 & 0x20 and h2 >> rn & 1) or (h1 & 16 == 0 and h2 & 0x8000) or h2 & 0xC000 == 0xC000: return "ldm/stm UNPREDICTABLE list"
    if h1 & 0xFE40 == 0xE840:
        rn, rt, rt2 = h1 & 15, h2 >> 12, h2 >> 8 & 15
        if (h1 & 0x20 and (rn == 15 or rn in (rt, rt2))) or (h1 & 16 and rt == rt2): return "ldrd/strd UNPREDICTABLE"
    if h1 & 0xFE00 == 0xF800:
        rn, rt = h1 & 15, h2 >> 12
        if not h1 & 0x80 and h2 & 0x900 == 0x900 and rn == rt: return "writeback to Rt"
    if "[pc" in t: return "literal outside the image"
    if mn.startswith(("vldm", "vstm", "vpop", "vpush")) and h2 & 255 == 0: return "empty vldm/vstm list"
    if h1 & 0xFF00 in (0xFE00, 0xFF00, 0xF900, 0xEF00) or h1 & 0xFF00 == 0xFC00: return "not an ARMv7-M instruction"
    return None
grp = collections.Counter()
bad = collections.Counter(); ok = 0; okm = collections.Counter(); shown = collections.Counter(); both = 0
W = 4 * 52
for k, (r, a, s, fs, code, n, t, c) in enumerate(cases):
    m = struct.unpack("<52I", res[W * k:W * k + W])
    uc.mem_write(BASE, ram); uc.mem_write(CODE, code)
    uc.ctl_remove_cache(CODE, CODE + 16)
    for x, v in zip(R, r): uc.reg_write(x, v)
    uc.reg_write(UC_ARM_REG_XPSR, a | 1 << 24)
    for x, v in zip(S, s): uc.reg_write(x, v)
    uc.reg_write(UC_ARM_REG_FPSCR, fs)
    st = 0
    try: uc.emu_start(CODE | 1, 0xFFFFFFF0, count=n)
    except UcError as e:
        st = 1 if e.errno in (UC_ERR_INSN_INVALID, UC_ERR_EXCEPTION) else 2
    mn = t.split()[0].split(".")[0]
    if st or m[0]:
        if bool(st) != bool(m[0]) and (mn in ('bx', 'blx', 'b', 'bl') or ('pc' in t) or (st == 2 and mn[:2] in ('ld', 'st', 'pu', 'po', 'tb', 'vl', 'vs', 'vp'))): grp['status: not compared (memory map or branch differs)'] += 1; continue
        if bool(st) != bool(m[0]):
            w = why(c, t, mn, st, m[0], True)
            if w: grp["status: " + w] += 1; continue
            bad["status", mn] += 1
            if shown[mn] < 3: shown[mn] += 1; print("STATUS uc", st, "emu", m[0], t, c.hex())
        else: both += 1
        continue
    u = [uc.reg_read(x) for x in R] + [uc.reg_read(UC_ARM_REG_PC) & ~1, uc.reg_read(UC_ARM_REG_XPSR) & 0xF80F0000] + [uc.reg_read(x) for x in S] + [uc.reg_read(UC_ARM_REG_FPSCR) & 0xF7C00000, zlib.crc32(bytes(uc.mem_read(BASE, 0x8000)))]
    g = list(m[1:])
    if n == 2: u[15] = g[15]
    if not (mn[:4] in ('sadd', 'uadd', 'ssub', 'usub', 'sasx', 'uasx', 'ssax', 'usax')) or n == 2: u[16] &= 0xF8000000; g[16] &= 0xF8000000
    u[13] &= ~3 # hardware forces SP[1:0] to zero
    if u != g:
        names = ["r%d" % i for i in range(15)] + ["pc", "apsr"] + ["s%d" % i for i in range(32)] + ["fpscr", "ram"]
        w = why(c, t, mn, u, g, False) or ("literal outside the image" if "[pc" in t else None) or ("FPSCR cleared by new FP context" if u[49] == 0 != g[49] else None)
        if w: grp["state: " + w] += 1; continue
        diff = [(nm, hex(x), hex(y)) for nm, x, y in zip(names, u, g) if x != y]
        bad["state", mn] += 1
        if shown[mn] < 3: shown[mn] += 1; print("DIFF", t, c.hex(), "IT" if n == 2 else "", diff[:4], "apsr", hex(a), "fpscr", hex(fs))
    else: ok += 1; okm[mn] += 1
print("ok", ok, "distinct mnemonics ok", len(okm), "both faulted", both, "bad", sum(bad.values()), bad.most_common(40))

print("explained", sum(grp.values()), dict(grp))
sys.exit(1 if bad else 0)
