//! Sums, differences and products in the image (`boards/rp2040/src/board/arithmetic.s`): the host's, bit by bit.

use super::chip::{Chip, uf2_with_motions};
use super::recorded::recorded;
use super::{by_hand, no_defect};
use crate::published::rig_and_table_with_motions;
use upright::boards::named;
use upright_tool::image::{LinkedImage, build_for};

type Operation = fn(f32, f32) -> f32;

const OPERATIONS: [(&str, Operation); 3] =
    [("__aeabi_fadd", |a, b| a + b), ("__aeabi_fsub", |a, b| a - b), ("__aeabi_fmul", |a, b| a * b)];

/// Exponents and fractions at which something changes.
const EXPONENTS: [u32; 18] = [0, 1, 2, 3, 24, 25, 102, 103, 104, 126, 127, 128, 149, 150, 151, 253, 254, 255];
const FRACTIONS: [u32; 7] = [0, 1, 2, 0x3f_ffff, 0x40_0000, 0x40_0001, 0x7f_ffff];

/// Each special number with each other one, with both signs.
fn special_pairs() -> Vec<(f32, f32)> {
    let numbers: Vec<u32> = EXPONENTS
        .iter()
        .flat_map(|exponent| FRACTIONS.iter().map(move |fraction| (exponent << 23) | fraction))
        .flat_map(|number| [number, number | (1 << 31)])
        .collect();
    let with = |&a: &u32| numbers.iter().map(move |&b| (f32::from_bits(a), f32::from_bits(b)));
    numbers.iter().flat_map(with).collect()
}

/// Xorshift.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// Two numbers of one of six kinds.
    fn pair(&mut self) -> (f32, f32) {
        let (a, b, choice) = (self.next(), self.next(), self.next());
        let few_bits = |number: u32, zeros: u32| number & !((1 << (zeros % 24)) - 1);
        let with_exponent = |number: u32, exponent: u32| (number & 0x807f_ffff) | ((exponent & 255) << 23);
        let (exponent, varied) = ((a >> 23) & 255, choice >> 8);
        let near =
            |exponent: u32, most: u32| exponent.wrapping_add(varied % (2 * most + 1)).wrapping_sub(most);
        let (a, b) = match choice % 6 {
            0 => (a, b),
            // Exponents close together: ties and cancellations.
            1 => (a, with_exponent(b, near(exponent, 26))),
            // Nearly equal numbers.
            2 => (a, a ^ (1 << 31) ^ (varied >> (varied % 24))),
            // Products near the smallest number.
            3 => (a, with_exponent(b, near(115_u32.wrapping_sub(exponent), 15))),
            // Small numbers and subnormals.
            4 => (a & 0x81ff_ffff, b & 0x80ff_ffff),
            // Few digits: ties.
            _ => (few_bits(a, varied >> 5), few_bits(with_exponent(b, near(exponent, 15)), varied >> 10)),
        };
        (f32::from_bits(a), f32::from_bits(b))
    }
}

/// The first pair with another result than the host's; a NaN is as good as another.
fn first_difference(pairs: &[(f32, f32)], results: &[f32], operation: Operation) -> Option<(f32, f32)> {
    assert_eq!(pairs.len(), results.len());
    let is_other =
        |wanted: f32, found: f32| wanted.to_bits() != found.to_bits() && !(wanted.is_nan() && found.is_nan());
    let mut both = pairs.iter().zip(results);
    both.find(|((a, b), result)| is_other(operation(*a, *b), **result)).map(|(pair, _)| *pair)
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn sums_and_products_in_the_image_are_the_hosts() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    // The symbols of the code are in the compiled image alone.
    let compiled = build_for(named("pico").unwrap(), rig, table).unwrap();
    let image = LinkedImage::read(&compiled.elf).unwrap();
    let address = |name| image.address_of(name).unwrap();
    let mut chip = Chip::start(&uf2, table.sensors());
    // After the first ticks, the code is in RAM.
    let mut run = recorded(rig, table, &by_hand(rig, 0.1), no_defect());
    run.truncate(2);
    chip.replay(&run);
    let mut random = Random(0x2040_2040);
    let mut pairs = special_pairs();
    pairs.extend((0..200_000).map(|_| random.pair()));
    for (name, operation) in OPERATIONS {
        let (results, most) = chip.call(address(name), &pairs);
        let different = first_difference(&pairs, &results, operation);
        assert_eq!(different, None, "{name}");
        println!("{name}: {} pairs, at most {most} cycles", pairs.len());
    }
    // Negative control: not rounded up (`adcs` becomes `adds`).
    for (name, old, new) in [("__aeabi_fadd", 0x4148, 0x1840), ("__aeabi_fmul", 0x4158, 0x18c0)] {
        chip.replace(address(name), old, new);
        let operation = OPERATIONS.iter().find(|(known, _)| *known == name).unwrap().1;
        let (results, _) = chip.call(address(name), &pairs);
        assert!(first_difference(&pairs, &results, operation).is_some(), "{name}");
    }
}
