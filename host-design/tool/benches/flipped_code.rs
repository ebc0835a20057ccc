//! What a changed bit of the tick's code does until the image has found it:
//! `cargo bench -p upright-tool --bench flipped_code`. A bit flips while the quadruple balances on the virtual board.
//! Fails if the motor is on for more than a quarter of a second after it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::boards::DEFAULT_BOARD;
use upright::control::actuator::Drive;
use upright::table::Law;
use upright_board::{Conditions, Image, Input};
use upright_closed_loop::harness::{HarnessError, World};
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};
use upright_design::table::{Gains, TableValues};
use upright_tool::image::build_for;
use upright_tool::in_the_loop::{Event, VirtualBoard};

/// Number of bits, each in a run of its own.
const RUNS: u32 = 24;
/// Ticks of balancing in which they flip: at any phase of the reader, which needs about 100 ticks for the image.
const FLIPS: std::ops::Range<usize> = 20..120;
/// Longest time from the flip to the motor off (ticks of 1 ms).
const LONGEST: usize = 250;
/// Functions of the tick, by parts of their mangled names.
const OF_THE_TICK: [&str; 3] = ["hot_path3act", "hot_path7predict", "SysTick"];

/// A tick: the force of the power stage (N), and the largest angle of a link (rad).
type Tick = (f32, f64);

/// The ticks of balancing until the motor is off, or until more than `LONGEST` after the last possible flip. The bit
/// flips in tick `at`.
fn balanced(rig: &Rig, table: &TableValues, image: &Image, flip: Option<(usize, u32, u8)>) -> Vec<Tick> {
    let scenario =
        Scenario { sensing: Sensing::Encoders, force_noise_n: 0.1, ..Scenario::at_rest(rig, Law::Lqr) };
    let mut board = VirtualBoard::start(image, &Conditions::f405(1), table).unwrap();
    let events = board.events();
    let mut world = World::new(rig, table, &scenario, &mut board).unwrap();
    let mut output = world.raise(None).unwrap();
    let mut ticks = Vec::new();
    for tick in 0..FLIPS.end + LONGEST + 1 {
        if let Some((at, address, bit)) = flip
            && at == tick
        {
            let input = Input::FlipBit { address, bit };
            events.borrow_mut().push(Event::Input { after: upright_board::seconds(2e-4), input });
        }
        world.bench.tick(output.drive);
        let inputs = world.inputs();
        output = match world.session.tick(&inputs) {
            Ok(output) if output.enable => output,
            // The motor is off, or the board does what the hardware does not allow, which ends the run.
            Ok(_) | Err(HarnessError::Board(_)) => break,
            Err(error) => panic!("{error}"),
        };
        let Drive::Force(force_n) = output.drive else { panic!("{:?}", output.drive) };
        let angles = world.bench.state().iter().skip(2).step_by(2);
        ticks.push((force_n, angles.fold(0.0f64, |most, angle| most.max(angle.abs()))));
    }
    ticks
}

fn main() {
    let rig = Rig::from_path("../../rigs/quadruple-paper.toml".as_ref()).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let built = build_for(DEFAULT_BOARD, &rig, &table).unwrap();
    let image = Image::from_elf(&std::fs::read(built.elf).unwrap()).unwrap();
    let sound = balanced(&rig, &table, &image, None);
    assert_eq!(sound.len(), FLIPS.end + LONGEST + 1, "the rig does not balance");
    let mut random = Pcg64::seed_from_u64(1);
    let (mut wrong, mut slowest) = (0, 0);
    for _ in 0..RUNS {
        let function = image.object(OF_THE_TICK[random.random_range(0..OF_THE_TICK.len())]).unwrap();
        let (address, bit) = (random.random_range(function), random.random_range(0..8));
        let at = random.random_range(FLIPS);
        let changed = balanced(&rig, &table, &image, Some((at, address, bit)));
        let on = changed.len().saturating_sub(at);
        slowest = slowest.max(on);
        if let Some(first) = (0..changed.len()).find(|&tick| changed[tick].0 != sound[tick].0) {
            wrong += 1;
            let differences = changed.iter().zip(&sound).map(|(changed, sound)| (changed.0 - sound.0).abs());
            println!(
                "bit {bit} of {address:#010x} acts wrongly for {} ticks: force {:.1} N off, links up to {:.3} rad",
                changed.len() - first,
                differences.fold(0.0f32, f32::max),
                changed.iter().fold(0.0f64, |most, tick| most.max(tick.1))
            );
        }
        assert!(on <= LONGEST, "bit {bit} of {address:#010x}: the motor is on for {on} ticks");
    }
    println!("{wrong} of {RUNS} bits change a force; the motor is off after {slowest} ticks at most");
}
