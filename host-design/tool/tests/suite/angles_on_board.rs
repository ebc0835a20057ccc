//! Absolute sensors on the virtual board: the flashed image reads them over their bus, and has the bits of the host.

use upright::boards::parts::PartInterface;
use upright::boards::{DEFAULT_BOARD, named};
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::table::{Law, SensorKind};
use upright_board::{Conditions, Image, Input, RegisterDefect, SensorDefect};
use upright_closed_loop::harness::{Recording, World};
use upright_design::design::design;
use upright_design::rig::{LinkEncoder, Rig};
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_plan::{Stored, hangs, refined, up_and_down, with_motions};
use upright_tool::image::build_for;
use upright_tool::in_the_loop::{Event, VirtualBoard, measure, run_compared};
use upright_trust::verify::at_rest_disturbed;

use crate::equipment::built_for;
use crate::published::{rig_and_table, rig_and_table_with_motions, rig_path};

/// Readings while the links hang: the first link wraps on its way up, and all of them near upright or hanging.
const ZEROS: [u32; 4] = [3, 16_000, 1, 16_382];

/// A rig of `rigs/` with absolute sensors of this many bits, and its table. With four links, the cart has one, too: the
/// fifth.
fn absolute(name: &'static str, bits: u8, noise_rad: f64) -> (Rig, TableValues) {
    let mut rig = rig_and_table(name).0.clone();
    if rig.chain().unwrap().links.len() == ZEROS.len() {
        let cart = &mut rig.chain_mut().unwrap().cart;
        (cart.sensor_bits, cart.sensor_noise_m) = (Some(bits.into()), 2e-5);
    }
    for (link, zero_counts) in rig.chain_mut().unwrap().links.iter_mut().zip(ZEROS) {
        link.encoder = Some(LinkEncoder::Absolute { bits, travel_rad: None, zero_counts, noise_rad });
    }
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    (rig, table)
}

/// The single pendulum with a potentiometer of 340° whose dead band neither balancing nor its motions reach.
fn potentiometer(noise_rad: f64) -> (Rig, TableValues) {
    let mut rig = rig_and_table("single-absolute").0.clone();
    rig.chain_mut().unwrap().links[0].encoder =
        Some(LinkEncoder::Absolute { bits: 12, travel_rad: Some(5.934), zero_counts: 2600, noise_rad });
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    (rig, table)
}

fn image(rig: &Rig, table: &TableValues) -> Option<Image> {
    let elf = built_for(DEFAULT_BOARD, rig, table)?;
    Some(Image::from_elf(&std::fs::read(elf).unwrap()).unwrap())
}

#[test]
fn the_image_balances_with_absolute_sensors_with_the_bits_of_the_host() {
    for (name, noise_rad) in
        [("double-quanser-dbpen", 2e-4), ("triple-glueck-eder-kugi", 1e-4), ("quadruple-paper", 2e-5)]
    {
        let (rig, table) = absolute(name, 14, noise_rad);
        let Some(image) = image(&rig, &table) else { return };
        let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
        let scenario = Scenario { duration_s: 2.0, ..Scenario::at_rest(&rig, Law::Lqr) };
        let (recording, [ticks, messages]): (Recording, _) =
            run_compared(&rig, &table, &scenario, &mut board).unwrap();
        assert!(recording.fault.is_none() && recording.summary.survives(), "{name}: {:?}", recording.fault);
        assert!(messages > 100, "{name}: {ticks} {messages}");

        // Negative control: a sensor that is off by one reading on the board.
        let mut other = table.clone();
        other.sensors[1].kind.reading_mut().unwrap().zero_counts += 1;
        let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
        let error = run_compared(&rig, &other, &scenario, &mut board).unwrap_err().to_string();
        assert!(error.contains("differ"), "{error}");

        // Reading takes the same time in every tick, whatever the sensors say.
        let cycles = measure(&rig, &table, &scenario, &image, &Conditions::f405(1)).unwrap();
        println!("{name}: inputs {:?}, whole {:?}", cycles.all.inputs, cycles.all.whole);
        assert!(cycles.all.inputs.us < 33.0 && cycles.check().is_ok(), "{:?}", cycles.all.inputs);
        let [off, balancing] = [cycles.off, cycles.balancing].map(|ticks| ticks.unwrap().inputs.cycles);
        assert!(off.abs_diff(balancing) < 100, "{off} {balancing}");
    }
}

#[test]
fn the_image_raises_and_lowers_links_with_absolute_sensors() {
    let (rig, table) = potentiometer(1e-3);
    let stored = Stored::beside(&rig_path("single-absolute")).unwrap();
    let table = with_motions(&rig, table, &refined(&rig, &stored).unwrap(), &[]).unwrap();
    let magnets = ["single-absolute", "double-absolute"].map(rig_and_table_with_motions);
    for (rig, table) in magnets.into_iter().chain([&(rig, table)]) {
        let name = &rig.name;
        let Some(image) = image(rig, table) else { return };
        for seed in 1..4 {
            let mut board = VirtualBoard::start(&image, &Conditions::f405(seed), table).unwrap();
            let scenario = Scenario { seed, ..up_and_down(rig, table, 0.5).unwrap() };
            let (recording, _) = run_compared(rig, table, &scenario, &mut board).unwrap();
            assert!(hangs(&recording), "{name} {seed}: {:?}", recording.fault);
        }
    }
}

#[test]
fn noise_of_sensors_and_of_forces_leaves_the_bits_those_of_the_host() {
    for name in ["double-absolute", "single-quanser-ip02"] {
        let (rig, table) = rig_and_table(name);
        let Some(image) = image(rig, table) else { return };
        for seed in 1..8 {
            let mut board = VirtualBoard::start(&image, &Conditions::f405(seed), table).unwrap();
            let scenario = Scenario { duration_s: 0.5, ..at_rest_disturbed(rig, Law::Lqr, seed) };
            let (recording, [_, messages]): (Recording, _) =
                run_compared(rig, table, &scenario, &mut board).unwrap();
            assert!(recording.fault.is_none() && messages > 100, "{name} {seed}: {:?}", recording.fault);
        }
    }
}

/// The fault of a rig that gets this input in its 100th tick of balancing: the fault, its sensor, ticks from the onset
/// to motor off, and measurements rejected; of 1000 ticks.
fn with_defect(
    (rig, table): &(Rig, TableValues),
    image: &Image,
    input: impl Fn(usize) -> Option<Input>,
) -> (Option<(Fault, Option<u8>)>, usize, u32) {
    let mut board = VirtualBoard::start(image, &Conditions::f405(1), table).unwrap();
    let events = board.events();
    let mut world = World::new(rig, table, &at_rest_disturbed(rig, Law::Lqr, 1), &mut board).unwrap();
    let output = world.raise(None).unwrap();
    world.bench.tick(output.drive);
    let mut off = None;
    for tick in 0..1000_usize {
        if let Some(input) = tick.checked_sub(100).and_then(&input) {
            events.borrow_mut().push(Event::Input { after: 0, input });
        }
        let inputs = world.inputs();
        let output = world.session.tick(&inputs).unwrap();
        world.bench.tick(output.drive);
        if tick >= 100 && !output.enable {
            off = off.or(Some(tick - 99));
            if off.is_some() {
                break;
            }
        }
    }
    let inputs = world.inputs();
    let Ok(Answer::Cause(cause)) = world.session.ask(Request::Cause, &inputs) else { panic!("no cause") };
    let Ok(Answer::Statistics(statistics)) = world.session.ask(Request::Statistics, &inputs) else {
        panic!("no statistics")
    };
    (cause.map(|cause| (cause.fault, cause.sensor)), off.unwrap_or(0), statistics.rejected_samples)
}

/// This defect of the sensor in the place of an encoder.
fn of_sensor(encoder: usize, defect: SensorDefect) -> Option<Input> {
    Some(Input::AngleDefect { encoder, defect })
}

#[test]
fn the_image_balances_with_a_potentiometer_with_the_bits_of_the_host() {
    let (rig, table) = potentiometer(1e-3);
    let Some(image) = image(&rig, &table) else { return };
    let start = || VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let scenario = Scenario { duration_s: 4.0, ..Scenario::at_rest(&rig, Law::Lqr) };
    let (recording, _): (Recording, _) = run_compared(&rig, &table, &scenario, &mut start()).unwrap();
    assert!(recording.fault.is_none() && recording.summary.survives(), "{:?}", recording.fault);

    // Negative control: a sensor that is off by one reading on the board.
    let mut other = table.clone();
    other.sensors[1].kind.reading_mut().unwrap().zero_counts += 1;
    let error = run_compared(&rig, &other, &scenario, &mut start()).unwrap_err().to_string();
    assert!(error.contains("differ"), "{error}");

    let cycles = measure(&rig, &table, &scenario, &image, &Conditions::f405(1)).unwrap();
    println!("inputs {:?}, whole {:?}", cycles.all.inputs, cycles.all.whole);
    assert!(cycles.all.inputs.us < 8.0 && cycles.check().is_ok(), "{:?}", cycles.all.inputs);
}

#[test]
fn the_image_balances_with_a_sensor_on_two_wires_with_the_bits_of_the_host() {
    let (rig, table) = rig_and_table("single-as5600");
    let Some(image) = image(rig, table) else { return };
    let scenario = Scenario { duration_s: 2.0, ..Scenario::at_rest(rig, Law::Lqr) };
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), table).unwrap();
    let (recording, [_, messages]): (Recording, _) = run_compared(rig, table, &scenario, &mut board).unwrap();
    assert!(recording.fault.is_none() && recording.summary.survives(), "{:?}", recording.fault);
    assert!(messages > 100, "{messages}");
    // Negative control: a firmware that does not take out the error twice per turn.
    let mut other = table.clone();
    let SensorKind::OfPart(part) = &mut other.sensors[1].kind else { panic!() };
    part.errors = [0.0; 4];
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), table).unwrap();
    let error = run_compared(rig, &other, &scenario, &mut board).unwrap_err().to_string();
    assert!(error.contains("differ"), "{error}");
    let cycles = measure(rig, table, &scenario, &image, &Conditions::f405(1)).unwrap();
    println!("inputs {:?}, whole {:?}", cycles.all.inputs, cycles.all.whole);
    assert!(cycles.all.inputs.us < 130.0 && cycles.check().is_ok(), "{:?}", cycles.all.inputs);
    let [off, balancing] = [cycles.off, cycles.balancing].map(|ticks| ticks.unwrap().inputs.cycles);
    assert!(off.abs_diff(balancing) < 400, "{off} {balancing}");
}

#[test]
fn defects_of_a_sensor_on_two_wires_are_found_or_survived() {
    let rig = rig_and_table("single-as5600");
    let Some(image) = image(&rig.0, &rig.1) else { return };
    let Some(PartInterface::TwoWires(part)) = rig.1.sensors[1].kind.interface() else { panic!() };
    let spoilt = |defect| Some(Input::RegisterDefect { encoder: 1, defect });
    for defect in [RegisterDefect::WireOpen, RegisterDefect::WireGrounded, RegisterDefect::OtherAddress] {
        let found = with_defect(rig, &image, |_| spoilt(defect));
        assert_eq!((found.0, found.1), (Some((Fault::Encoder, Some(1))), 3), "{defect:?}");
    }
    let values = part.registers(None);
    let [address, first] = [part.address, part.register];
    let no_magnet =
        with_defect(rig, &image, |_| Some(Input::Registers { encoder: 1, address, first, values }));
    assert_eq!((no_magnet.0, no_magnet.1), (Some((Fault::Encoder, Some(1))), 3));
    // The clock of the next reading frees a wire that is held: one bad sample in four ticks.
    let held =
        with_defect(rig, &image, |tick| if tick % 4 == 0 { spoilt(RegisterDefect::Holds) } else { None });
    println!("held: {held:?}");
    assert!(held.0.is_none() && held.2 > 200, "{held:?}");
    // Negative control: held in every tick.
    let always = with_defect(rig, &image, |_| spoilt(RegisterDefect::Holds));
    assert_eq!(always.0, Some((Fault::Encoder, Some(1))));
}

#[test]
fn a_wiper_with_an_open_wire_or_a_short_circuit_is_a_fault_in_the_third_tick() {
    let rig = potentiometer(1e-3);
    let Some(image) = image(&rig.0, &rig.1) else { return };
    for share in [0.0, 0.01, 0.99, 1.0] {
        let found = with_defect(&rig, &image, |_| Some(Input::Wiper(share)));
        assert_eq!((found.0, found.1), (Some((Fault::Encoder, Some(1))), 3), "{share}");
    }
    // Two of four, and in the middle of the range, where the observer alone finds it.
    let often = with_defect(&rig, &image, |tick| match tick % 4 {
        0 | 1 => Some(Input::Wiper(0.0)),
        _ => None,
    });
    assert_eq!(often.0, None);
    let found = with_defect(&rig, &image, |_| Some(Input::Wiper(0.5)));
    assert!(found.0.is_some() && found.1 > 1, "{found:?}");
}

#[test]
fn defects_of_an_absolute_sensor_are_found_or_survived() {
    for (name, noise_rad, sensors) in
        [("single-quanser-ip02", 4e-4, [1].as_slice()), ("quadruple-paper", 2e-5, &[1, 0])]
    {
        let rig = absolute(name, 14, noise_rad);
        let Some(image) = image(&rig.0, &rig.1) else { return };
        for &sensor in sensors {
            defects_of(sensor, &rig, &image);
        }
    }
}

/// Defects of a sensor on the bus, which the firmware finds or survives.
fn defects_of(sensor: usize, rig: &(Rig, TableValues), image: &Image) {
    let name = format!("{}, {sensor}", rig.0.name);
    for (what, defect) in [
        ("wire open", SensorDefect::WireOpen),
        ("wire grounded", SensorDefect::WireGrounded),
        ("no magnet", SensorDefect::NoMagnet),
        ("one wrong bit", SensorDefect::FlippedBits(1 << 9)),
        ("error flag", SensorDefect::FlippedBits(3 << 14)),
        ("three wrong bits", SensorDefect::FlippedBits(7 << 5)),
    ] {
        let found = with_defect(rig, image, |_| of_sensor(sensor, defect));
        println!("{name}, {what}: {found:?}");
        assert_eq!((found.0, found.1), (Some((Fault::Encoder, Some(sensor as u8))), 3), "{name} {what}");
    }
    let odd = |tick: usize| match tick % 4 {
        0 | 1 => of_sensor(sensor, SensorDefect::FlippedBits(1 << 9)),
        _ => of_sensor(sensor, SensorDefect::None),
    };
    let survived = with_defect(rig, image, odd);
    println!("{name}, two of four with a wrong bit: {survived:?}");
    assert_eq!(survived.0, None, "{name}");
    // Parity does not find two wrong bits, but the observer does; a sensor that is stuck stands still.
    for (what, defect) in
        [("two wrong bits", SensorDefect::FlippedBits(3 << 9)), ("stuck", SensorDefect::Stuck)]
    {
        let found = with_defect(rig, image, |_| of_sensor(sensor, defect));
        println!("{name}, {what}: {found:?}");
        assert!(found.0.is_some(), "{name} {what}");
    }
}

#[test]
fn an_image_is_refused_for_a_board_or_a_sensor_that_do_not_fit() {
    let refused = |board, bits| {
        let (rig, table) = absolute("single-quanser-ip02", bits, 1e-3);
        build_for(board, &rig, &table).unwrap_err().to_string()
    };
    let bits = refused(DEFAULT_BOARD, 12);
    assert!(bits.contains("link 1") && bits.contains("14 bits") && bits.contains("own-board.md"), "{bits}");
    let (mut rig, _) = potentiometer(1e-3);
    let encoder =
        LinkEncoder::Absolute { bits: 14, travel_rad: Some(5.934), zero_counts: 10_400, noise_rad: 1e-3 };
    rig.chain_mut().unwrap().links[0].encoder = Some(encoder);
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let of_14 = build_for(DEFAULT_BOARD, &rig, &table).unwrap_err().to_string();
    assert!(of_14.contains("one potentiometer, with 12 bits, at link 1"), "{of_14}");
    let feather = refused(named("feather-f405").unwrap(), 14);
    assert!(feather.contains("link 1") && feather.contains("another board"), "{feather}");
}
