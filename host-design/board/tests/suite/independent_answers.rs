//! Single instructions and IT blocks against the answers of an independent emulator (`tests/data/make_cases.py`).

use std::collections::BTreeMap;
use std::io::Read;

use upright_board::single_step::{CoreState, Stepper};

const SRAM: u32 = 0x2000_0000;
const CODE: u32 = 0x2000_1000;
const DATA: u32 = 0x2000_1800;
const SIZE: u32 = 0x3000;
const EDGES: [u32; 8] = [0, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x8000, 0x7fff, 0xffff_8000];
const SPECIAL: [u32; 16] = [
    0,
    0x8000_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0001,
    0x7f80_0001,
    1,
    0x0080_0000,
    0xffc1_2345,
    0xffa5_4321,
    0x807f_ffff,
    0x7f7f_ffff,
    0x3f80_0000,
    0x4f00_0000,
    0xcf00_0000,
    0x4f80_0000,
];

/// Splitmix64.
struct Mix(u64);

impl Mix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
}

/// The state that a seed stands for, as in `make_cases.py`.
fn state_of(seed: u32, kind: u8, index: u8) -> CoreState {
    let mut mix = Mix(seed.into());
    let mut r = [0; 16];
    for (i, register) in r.iter_mut().enumerate().take(15) {
        let k = mix.next();
        let small = (k >> 8 & 0xff) as u32;
        *register = match (kind, k & 7) {
            (kind, choice) if matches!(kind, 1 | 3) || i == 13 => {
                let odd = if kind == 1 && choice == 0 && i != 13 { (k >> 40 & 3) as u32 } else { 0 };
                DATA + (k >> 8 & 0x1ff) as u32 * 4 + odd
            }
            (2, _) => (CODE + (k >> 8 & 0x7fe) as u32) | 1,
            (_, 0) => small,
            (_, 1) => small.wrapping_neg(),
            (_, 2) => EDGES[(k >> 8 & 7) as usize],
            _ => (k >> 32) as u32,
        };
        if i == usize::from(index) {
            *register = (k >> 16 & 0xff) as u32;
        }
    }
    r[15] = CODE;
    let flags = mix.next();
    let apsr = ((flags & 0x1f) << 27 | (flags >> 8 & 15) << 16) as u32;
    let fpscr = ((flags >> 16 & 15) << 28) as u32;
    let s = std::array::from_fn(|_| {
        let k = mix.next();
        if k & 3 == 0 {
            SPECIAL[(k >> 8 & 15) as usize]
        } else if k & 7 == 1 {
            (k >> 32) as u32
        } else {
            ((k >> 3 & 1) << 31 | (119 + (k >> 8 & 15)) << 23 | k >> 40 & 0x7f_ffff) as u32
        }
    });
    CoreState { r, apsr, s, fpscr }
}

/// One case.
struct Case {
    code: Vec<u8>,
    count: u8,
    kind: u8,
    index: u8,
    seed: u32,
    changes: Vec<(u8, u32)>,
    writes: Vec<(u16, u8)>,
    in_image: bool,
}

/// Reads the cases one after the other.
struct Cases<'a>(&'a [u8]);

impl Cases<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_first_chunk().expect("the file is whole");
        self.0 = rest;
        *first
    }

    fn byte(&mut self) -> u8 {
        self.bytes::<1>()[0]
    }
}

impl Iterator for Cases<'_> {
    type Item = Case;

    fn next(&mut self) -> Option<Case> {
        if self.0.is_empty() {
            return None;
        }
        let length = self.byte();
        let code = (0..length).map(|_| self.byte()).collect();
        let (count, kind, index) = (self.byte(), self.byte(), self.byte());
        let seed = u32::from_le_bytes(self.bytes());
        let changes = (0..self.byte()).map(|_| (self.byte(), u32::from_le_bytes(self.bytes()))).collect();
        let writes = (0..self.byte()).map(|_| (u16::from_le_bytes(self.bytes()), self.byte())).collect();
        Some(Case {
            code,
            count,
            kind: kind & 0x7f,
            index,
            seed,
            changes,
            writes,
            in_image: kind & 0x80 != 0,
        })
    }
}

fn all_cases() -> Vec<u8> {
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&include_bytes!("../data/cases.bin.gz")[..])
        .read_to_end(&mut bytes)
        .expect("the file is whole");
    bytes
}

fn memory() -> Vec<u8> {
    (0..SIZE / 4).flat_map(|i| (Mix(u64::from(SRAM + 4 * i)).next() as u32).to_le_bytes()).collect()
}

fn expected(case: &Case, before: &CoreState) -> CoreState {
    let mut after = *before;
    for &(register, value) in &case.changes {
        match register {
            // The lower two bits of a stack pointer do not exist (B1.4.7); the other emulator keeps them.
            13 => after.r[13] = value & !3,
            0..=15 => after.r[usize::from(register)] = value,
            16 => after.apsr = value,
            17 => after.fpscr = value,
            _ => after.s[usize::from(register) - 18] = value,
        }
    }
    after
}

/// What does not agree; `None` if all does.
fn disagreement(stepper: &mut Stepper, memory: &[u8], case: &Case) -> Option<String> {
    let before = state_of(case.seed, case.kind, case.index);
    stepper.write(CODE, &case.code);
    let result = stepper.run(&before, case.count.into());
    let place = (CODE - SRAM) as usize;
    stepper.write(CODE, &memory[place..place + case.code.len()]);
    let wanted: BTreeMap<u16, u8> = case.writes.iter().copied().collect();
    let left = stepper.read(SRAM, SIZE);
    let wrong = (0u16..)
        .zip(left.iter().zip(memory))
        .any(|(at, (&now, &old))| now != *wanted.get(&at).unwrap_or(&old));
    if wrong || !case.writes.is_empty() {
        stepper.write(SRAM, memory);
    }
    match result {
        Err(stopped) => Some(stopped.to_string()),
        Ok(_) if wrong => Some("memory".to_owned()),
        Ok(state) => {
            let wanted = expected(case, &before);
            (state != wanted).then(|| differences(&state, &wanted))
        }
    }
}

fn differences(state: &CoreState, wanted: &CoreState) -> String {
    let mut text = String::new();
    let mut differ = |name: String, got: u32, want: u32| {
        if got != want {
            text += &format!(" {name}: {got:#x}, not {want:#x};");
        }
    };
    for i in 0..16 {
        differ(format!("r{i}"), state.r[i], wanted.r[i]);
    }
    for i in 0..32 {
        differ(format!("s{i}"), state.s[i], wanted.s[i]);
    }
    differ("apsr".to_owned(), state.apsr, wanted.apsr);
    differ("fpscr".to_owned(), state.fpscr, wanted.fpscr);
    text
}

#[test]
fn every_case_agrees_with_the_independent_emulator() {
    let (bytes, memory) = (all_cases(), memory());
    let mut stepper = Stepper::new();
    stepper.write(SRAM, &memory);
    let (mut agreed, mut of_the_image, mut wrong) = (0, 0, Vec::new());
    for case in Cases(&bytes) {
        match disagreement(&mut stepper, &memory, &case) {
            None => {
                agreed += 1;
                of_the_image += u32::from(case.in_image);
            }
            Some(text) => {
                let code: String = case.code.iter().map(|byte| format!("{byte:02x}")).collect();
                wrong.push(format!("{code}, seed {}, kind {}: {text}", case.seed, case.kind));
            }
        }
    }
    let shown = wrong.iter().take(40).cloned().collect::<Vec<_>>().join("\n");
    assert!(wrong.is_empty(), "{} of {} cases disagree:\n{shown}", wrong.len(), wrong.len() + agreed);
    assert!(agreed >= 50_000 && of_the_image >= 35_000, "{agreed} cases, {of_the_image} of the image");
}

#[test]
fn a_wrong_answer_is_noticed() {
    let (bytes, memory) = (all_cases(), memory());
    let mut stepper = Stepper::new();
    stepper.write(SRAM, &memory);
    for mut case in Cases(&bytes).take(1000) {
        case.changes[0].1 ^= 1 << (case.seed & 31);
        assert!(disagreement(&mut stepper, &memory, &case).is_some());
    }
}
