#!/usr/bin/env python3
"""Makes `cases.bin.gz`: single instructions (and IT blocks) executed from random states, with the results of unicorn.

Needs: pip install unicorn (2.1.4 was used), llvm-mc and llvm-objdump (14 was used), an image.
Usage: make_cases.py IMAGE OUTPUT

Every distinct encoding in the image is executed from several states. So are its neighbours: the other instructions of
ARMv7E-M with FPv4-SP, from a list of templates assembled with random registers and constants. Left out: jumps to random
addresses, SVC, BKPT, UDF, WFI, CPS, MSR and MRS (directed programs cover them).

A state is generated from a seed by splitmix64, in the same way here and in `tests/suite/independent_answers.rs`; each
word of memory holds splitmix64 of its address. A case stores code, seed, kind of state and what has changed: registers,
flags, words of memory.

Record, little endian: u8 length of code, code, u8 number of instructions, u8 kind (0 data, 1 addresses, 2 jumps,
3 aligned addresses: unicorn does not model that LDM, LDRD, VLDR and the like fault on unaligned ones),
u8 register that is a small index (255: none), u32 seed, u8 number of changes, changes (u8 register, u32 value;
0-14 R, 15 PC, 16 APSR, 17 FPSCR, 18-49 S), u8 number of writes, writes (u16 offset of a byte in SRAM, u8 value).
The highest bit of the kind is set if the code is in the image.
"""
import gzip
import random
import re
import struct
import subprocess
import sys

import unicorn as u
from unicorn import arm_const as a

SRAM, CODE, DATA, SIZE = 0x20000000, 0x20001000, 0x20001800, 0x3000
MASK = (1 << 64) - 1
EDGES = [0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x8000, 0x7FFF, 0xFFFF8000]
SPECIAL = [0, 0x80000000, 0x7F800000, 0xFF800000, 0x7FC00001, 0x7F800001, 1, 0x00800000,
           0xFFC12345, 0xFFA54321, 0x807FFFFF, 0x7F7FFFFF, 0x3F800000, 0x4F000000, 0xCF000000, 0x4F800000]


class Mix:
    def __init__(self, seed):
        self.state = seed

    def next(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return z ^ (z >> 31)


def state_of(seed, kind, index):
    mix = Mix(seed)
    registers = []
    for i in range(15):
        k = mix.next()
        choice = k & 7
        if kind in (1, 3) or i == 13:
            value = DATA + ((k >> 8) & 0x1FF) * 4
            if kind == 1 and choice == 0 and i != 13:
                value += (k >> 40) & 3
        elif kind == 2:
            value = CODE + ((k >> 8) & 0x7FE) | 1
        elif choice == 0:
            value = (k >> 8) & 0xFF
        elif choice == 1:
            value = -((k >> 8) & 0xFF) & 0xFFFFFFFF
        elif choice == 2:
            value = EDGES[(k >> 8) & 7]
        else:
            value = k >> 32
        if i == index:
            value = (k >> 16) & 0xFF
        registers.append(value)
    flags = mix.next()
    apsr = (flags & 0x1F) << 27 | ((flags >> 8) & 15) << 16
    fpscr = ((flags >> 16) & 15) << 28
    singles = []
    for _ in range(32):
        k = mix.next()
        if k & 3 == 0:
            value = SPECIAL[(k >> 8) & 15]
        elif k & 7 == 1:
            value = k >> 32
        else:
            value = ((k >> 3) & 1) << 31 | (119 + ((k >> 8) & 15)) << 23 | (k >> 40) & 0x7FFFFF
        singles.append(value)
    return registers, apsr, fpscr, singles


MEMORY = b"".join(struct.pack("<I", Mix(SRAM + 4 * i).next() & 0xFFFFFFFF) for i in range(SIZE // 4))
NUMBERS = ([getattr(a, f"UC_ARM_REG_R{i}") for i in range(13)]
           + [a.UC_ARM_REG_SP, a.UC_ARM_REG_LR, a.UC_ARM_REG_FPSCR]
           + [getattr(a, f"UC_ARM_REG_S{i}") for i in range(32)])


class Oracle:
    def __init__(self):
        self.uc = u.Uc(u.UC_ARCH_ARM, u.UC_MODE_THUMB | u.UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(a.UC_CPU_ARM_CORTEX_M4)
        self.uc.mem_map(SRAM, SIZE)
        self.uc.mem_write(SRAM, MEMORY)
        # The first floating-point instruction sets FPSCR to its default; executed here, so that no case is affected.
        self.uc.mem_write(CODE, bytes.fromhex("b0ee400a"))
        self.uc.emu_start(CODE | 1, CODE + 4)
        self.writes = []
        self.uc.hook_add(u.UC_HOOK_MEM_WRITE, lambda uc, kind, at, size, value, data: self.writes.append((at, size)))

    def run(self, code, count, kind, index, seed):
        registers, apsr, fpscr, singles = state_of(seed, kind, index)
        uc = self.uc
        before = registers + [fpscr] + singles
        for number, value in zip(NUMBERS, before):
            uc.reg_write(number, value)
        uc.reg_write(a.UC_ARM_REG_APSR_NZCVQG, apsr)
        self.writes = []
        uc.mem_write(CODE, code)
        uc.ctl_remove_cache(CODE, CODE + 32)
        straight = count > 1
        try:
            if straight:
                uc.emu_start(CODE | 1, CODE + len(code))
            else:
                uc.emu_start(CODE | 1, 0xFFFFFFFF, count=1)
            after = [uc.reg_read(number) for number in NUMBERS]
            flags, pc = uc.reg_read(a.UC_ARM_REG_APSR) & 0xF80F0000, uc.reg_read(a.UC_ARM_REG_PC)
            thumb = uc.reg_read(a.UC_ARM_REG_XPSR) >> 24 & 1
            result = True
        except u.UcError:
            result = False
        spans = sorted({at + i for at, size in self.writes for i in range(size)})
        outside = [at for at in spans if not SRAM <= at < SRAM + SIZE]
        bytes_after = {at: uc.mem_read(at, 1)[0] for at in spans} if not outside and result else {}
        for at in spans:
            if SRAM <= at < SRAM + SIZE:
                uc.mem_write(at, MEMORY[at - SRAM:at - SRAM + 1])
        uc.mem_write(CODE, MEMORY[CODE - SRAM:CODE - SRAM + 32])
        if not result or outside or not thumb:
            return None
        if any(CODE <= at < CODE + len(code) for at in spans):
            return None
        changes = [(i, after[i]) for i in range(15) if after[i] != before[i]]
        changes.append((15, pc))
        if flags != apsr:
            changes.append((16, flags))
        if after[15] != fpscr:
            changes.append((17, after[15]))
        changes += [(18 + i, after[16 + i]) for i in range(32) if after[16 + i] != singles[i]]
        return changes, sorted((at - SRAM, value) for at, value in bytes_after.items())


WORDS = re.compile(r"^(ldm|stm|push|pop|ldr[a-z]{0,2}d|str[a-z]{0,2}d|ldrd|strd|vldr|vstr|vldm|vstm|vpush|vpop)")
ADDRESSES = re.compile(r"^v?(ldr|str|ldm|stm|push|pop|tbb|tbh)")
LEFT_OUT = re.compile(r"^(svc|bkpt|udf|wf[ie]|sev|cps|msr|mrs|it|dsb|dmb|isb|nop|yield|\.|<)")


def small_index(code):
    first = struct.unpack("<H", code[:2])[0]
    if len(code) == 2:
        return first >> 6 & 7 if first >> 12 == 5 else 255
    second = struct.unpack("<H", code[2:4])[0]
    if first & 0xFFF0 == 0xE8D0 and second & 0xFFE0 == 0xF000:
        return second & 15
    if first >> 9 == 0x7C and first & 0x80 == 0 and second & 0xFC0 == 0:
        return second & 15
    return 255


def kind_of(mnemonic):
    if mnemonic.startswith("bx") or mnemonic.startswith("blx"):
        return 2
    return 3 if WORDS.match(mnemonic) else 1 if ADDRESSES.match(mnemonic) else 0


def listing(path):
    text = subprocess.run(["llvm-objdump", "-d", "--mcpu=cortex-m4", path], capture_output=True, text=True).stdout
    for line in text.splitlines():
        match = re.match(r"^\s*[0-9a-f]+: ((?:[0-9a-f]{2} )+)\s*\t(\S+)", line)
        if match:
            yield bytes.fromhex(match[1]), match[2]


TEMPLATES = """
and{s} eor{s} orr{s} bic{s} orn{s} add{s} adc{s} sub{s} sbc{s} rsb{s}|{op}.w {d}, {n}, {m}, {shift}
and{s} eor{s} orr{s} bic{s} orn{s} add{s} adc{s} sub{s} sbc{s} rsb{s}|{op}.w {d}, {n}, #{const}
mov{s} mvn{s}|{op}.w {d}, #{const}
mvn{s}|{op}.w {d}, {m}, {shift}
tst teq cmp cmn|{op}.w {n}, {m}, {shift}
tst teq cmp cmn|{op}.w {n}, #{const}
lsl{s} lsr{s} asr{s} ror{s}|{op}.w {d}, {n}, {m}
lsl{s} lsr{s} asr{s} ror{s}|{op}.w {d}, {n}, #{five}
rrx{s}|{op} {d}, {n}
addw subw|{op} {d}, {n}, #{twelve}
movw movt|{op} {d}, #{sixteen}
ubfx sbfx|{op} {d}, {n}, #{lsb}, #{width}
bfi|{op} {d}, {n}, #{lsb}, #{width}
bfc|{op} {d}, #{lsb}, #{width}
ssat|{op} {d}, #{five1}, {n}, lsl #{five}
usat|{op} {d}, #{five}, {n}, asr #{five1}
ssat16|{op} {d}, #{four1}, {n}
usat16|{op} {d}, #{four}, {n}
sxtb uxtb sxth uxth sxtb16 uxtb16|{op}.w {d}, {m}, ror #{rot}
sxtab uxtab sxtah uxtah sxtab16 uxtab16|{op} {d}, {n}, {m}, ror #{rot}
rev rev16 revsh|{op}.w {d}, {m}
rbit clz|{op} {d}, {m}
sadd16 qadd16 shadd16 uadd16 uqadd16 uhadd16 sasx qasx shasx uasx uqasx uhasx|{op} {d}, {n}, {m}
ssax qsax shsax usax uqsax uhsax ssub16 qsub16 shsub16 usub16 uqsub16 uhsub16|{op} {d}, {n}, {m}
sadd8 qadd8 shadd8 uadd8 uqadd8 uhadd8 ssub8 qsub8 shsub8 usub8 uqsub8 uhsub8|{op} {d}, {n}, {m}
sel usad8 mul sdiv udiv smmul smmulr smuad smuadx smusd smusdx|{op} {d}, {n}, {m}
qadd qsub qdadd qdsub smulbb smulbt smultb smultt smulwb smulwt|{op} {d}, {n}, {m}
usada8 mla mls smmla smmlar smmls smmlsr smlad smladx smlsd smlsdx smlabb smlabt smlatb smlatt smlawb smlawt|{op} {d}, {n}, {m}, {a}
smull umull smlal umlal umaal smlalbb smlalbt smlaltb smlaltt smlald smlaldx smlsld smlsldx|{op} {d}, {a}, {n}, {m}
pkhbt|{op} {d}, {n}, {m}, lsl #{five}
pkhtb|{op} {d}, {n}, {m}, asr #{five1}
ldr ldrb ldrh ldrsb ldrsh str strb strh|{op}.w {d}, [{n}, #{twelve}]
ldr ldrb ldrh ldrsb ldrsh str strb strh|{op} {d}, [{n}, #-{eight}]
ldr ldrb ldrh ldrsb ldrsh str strb strh|{op} {d}, [{n}, #{eight}]!
ldr ldrb ldrh ldrsb ldrsh str strb strh|{op} {d}, [{n}], #-{eight}
ldr ldrb ldrh ldrsb ldrsh str strb strh|{op}.w {d}, [{n}, {m}, lsl #{two}]
ldrd strd|{op} {d}, {a}, [{n}, #{eight4}]
ldrd strd|{op} {d}, {a}, [{n}, #-{eight4}]!
ldrd strd|{op} {d}, {a}, [{n}], #{eight4}
ldm ldmdb stm stmdb|{op} {n}!, {list}
ldm ldmdb stm stmdb|{op} {n}, {list}
tbb|{op} [{n}, {m}]
tbh|{op} [{n}, {m}, lsl #1]
vadd.f32 vsub.f32 vmul.f32 vnmul.f32 vdiv.f32 vmla.f32 vmls.f32 vnmla.f32 vnmls.f32|{op} {sd}, {sn}, {sm}
vfma.f32 vfms.f32 vfnma.f32 vfnms.f32|{op} {sd}, {sn}, {sm}
vmov.f32 vabs.f32 vneg.f32 vsqrt.f32 vcmp.f32 vcmpe.f32|{op} {sd}, {sm}
vcmp.f32 vcmpe.f32|{op} {sd}, #0
vcvt.f32.s32 vcvt.f32.u32 vcvt.s32.f32 vcvt.u32.f32 vcvtr.s32.f32 vcvtr.u32.f32|{op} {sd}, {sm}
vcvtb.f32.f16 vcvtt.f32.f16 vcvtb.f16.f32 vcvtt.f16.f32|{op} {sd}, {sm}
vcvt.f32.s32 vcvt.f32.u32 vcvt.s32.f32 vcvt.u32.f32|{op} {sd}, {sd}, #{five1}
vcvt.f32.s16 vcvt.f32.u16 vcvt.s16.f32 vcvt.u16.f32|{op} {sd}, {sd}, #{four1}
vmov.f32|{op} {sd}, #{float}
vmov|{op} {sd}, {d}
vmov|{op} {d}, {sm}
vmov|{op} {d}, {a}, {pair}
vmov|{op} {pair}, {d}, {a}
vmrs|{op} apsr_nzcv, fpscr
vldr vstr|{op} {sd}, [{n}, #{eight4}]
vldr vstr|{op} {dd}, [{n}, #-{eight4}]
vldmia vstmia|{op} {n}!, {{{four_singles}}}
vldmdb vstmdb|{op} {n}!, {{{four_singles}}}
vpush vpop|{op} {{{four_singles}}}
cbz cbnz|{op} {low}, #{even}
beq bne bcs bcc bmi bpl bvs bvc bhi bls bge blt bgt ble|{op} #{even}
beq.w bne.w bcs.w bcc.w bmi.w bpl.w bhi.w bls.w bge.w blt.w bgt.w ble.w b.w bl|{op} #{even}
adds subs|{op} {low}, {low2}, {low3}
adds subs|{op} {low}, #{eight}
ands eors adcs sbcs orrs bics|{op} {low}, {low}, {low2}
lsls lsrs asrs|{op} {low}, {low2}, #{five1}
muls|{op} {low}, {low2}, {low}
"""
REGISTERS = [f"r{i}" for i in range(13)] + ["lr"]


def fill(template, op, rng):
    d, n, m, r = rng.sample(REGISTERS, 4)
    first = rng.randrange(28)
    lsb = rng.randrange(32)
    low, low2, low3 = (f"r{i}" for i in rng.sample(range(8), 3))
    names = [name for name in REGISTERS if name != n]
    chosen = sorted(rng.sample(names, rng.randrange(2, 8)), key=REGISTERS.index)
    constant = rng.choice([rng.randrange(256), rng.randrange(1, 256) * 0x10001, rng.randrange(1, 256) * 0x1000100,
                           rng.randrange(1, 256) * 0x1010101, (128 + rng.randrange(128)) << rng.randrange(1, 24)])
    shift = rng.choice(["lsl", "lsr", "asr", "ror"]) + f" #{rng.randrange(1, 32)}"
    return template.format(
        op=op, d=d, n=n, m=m, a=r, shift=shift, const=constant, five=rng.randrange(1, 32), five1=rng.randrange(1, 32),
        four=rng.randrange(16), four1=rng.randrange(1, 17), two=rng.randrange(4), twelve=rng.randrange(1, 4096),
        sixteen=rng.randrange(65536), eight=rng.randrange(1, 256), eight4=4 * rng.randrange(1, 256), lsb=lsb,
        width=rng.randrange(1, 33 - lsb), rot=8 * rng.randrange(4), list="{" + ", ".join(chosen) + "}",
        sd=f"s{rng.randrange(32)}", sn=f"s{rng.randrange(32)}", sm=f"s{rng.randrange(32)}",
        dd=f"d{rng.randrange(16)}", pair=f"s{first}, s{first + 1}",
        four_singles=", ".join(f"s{first + i}" for i in range(4)), low=low, low2=low2, low3=low3,
        even=2 * rng.randrange(2, 60), float=rng.choice(["1.0", "-0.5", "2.0", "0.125", "31.0", "-1.9375"]))


def neighbours(rng):
    lines = []
    for row in TEMPLATES.strip().splitlines():
        ops, template = row.split("|")
        for op in ops.split():
            for s in (["", "s"] if "{s}" in op else [""]):
                for _ in range(14):
                    name = op.replace("{s}", s)
                    lines.append((name, fill(template, name, rng)))
    made = []
    text = "\n".join(line for _, line in lines)
    out = subprocess.run(["llvm-mc", "-triple=thumbv7em-none-eabihf", "-mcpu=cortex-m4", "-show-encoding"],
                         input=text, capture_output=True, text=True)
    refused = {int(m) for m in re.findall(r"<stdin>:(\d+):\d+: error", out.stderr)}
    codes = re.findall(r"@ encoding: \[([^\]]*)\]", out.stdout)
    good = [line for i, line in enumerate(lines, 1) if i not in refused]
    print(f"{len(refused)} lines refused by the assembler", out.stderr[:300])
    assert len(codes) == len(good), (len(codes), len(good))
    for (name, _), code in zip(good, codes):
        if "A" in code.split(",")[0] or "'" in code:
            continue
        made.append((bytes(int(byte, 16) for byte in code.split(",")), name))
    return made


def blocks(instructions):
    """IT blocks of the image, whole."""
    for i, (code, mnemonic) in enumerate(instructions):
        if re.fullmatch(r"it[te]{0,3}", mnemonic):
            members = instructions[i + 1:i + 1 + len(mnemonic) - 1]
            names = [name for _, name in members]
            if any(re.match(r"^(b|cb|pop|tb|it|svc|udf|ldm)", name) and not name.startswith("bi") and not
                   name.startswith("bf") for name in names):
                continue
            kind = max(kind_of(name) for name in names)
            index = next((small_index(code) for code, _ in members if small_index(code) != 255), 255)
            yield code + b"".join(code for code, _ in members), len(members) + 1, kind, index


def main():
    rng = random.Random(1)
    oracle, out, made, seed = Oracle(), bytearray(), {"image": 0, "neighbours": 0, "blocks": 0}, 0
    instructions = list(listing(sys.argv[1]))
    single = {code: name for code, name in instructions if not LEFT_OUT.match(name)}
    jobs = [("image", code, 1, kind_of(name), small_index(code), 8) for code, name in sorted(single.items())]
    jobs += [("neighbours", code, 1, kind_of(name), small_index(code), 4) for code, name in neighbours(rng)]
    jobs += [("blocks", *block, 16) for block in sorted(set(blocks(instructions)))]
    for origin, code, count, kind, index, states in jobs:
        tries = good = 0
        while good < states and tries < 3 * states:
            tries += 1
            seed += 1
            answer = oracle.run(code, count, kind, index, seed)
            if answer is None:
                continue
            good += 1
            changes, writes = answer
            image = 0 if origin == "neighbours" else 0x80
            out += struct.pack("<B", len(code)) + code + struct.pack("<BBBIB", count, kind | image, index, seed,
                                                                       len(changes))
            for register, value in changes:
                out += struct.pack("<BI", register, value)
            out += struct.pack("<B", len(writes))
            for at, value in writes:
                out += struct.pack("<HB", at, value)
        made[origin] += good
        if good == 0:
            print("no case for", code.hex(), origin)
    open(sys.argv[2], "wb").write(gzip.compress(bytes(out), 9))
    print(made, sum(made.values()), "cases,", len(single), "distinct encodings of the image")


main()
