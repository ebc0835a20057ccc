//! The image: sets the board up, then runs the control task every tick and the serial link in between.

#![no_std]
#![no_main]

mod board;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use own_board::gains::{SWING_UP, TABLE, TICK_S};
use panic_halt as _;
use stm32f4xx_hal::adc::{Adc, config::AdcConfig};
use stm32f4xx_hal::pac::{self, USART1};
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::{self, Serial};
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use stm32f4xx_hal::{prelude::*, qei::Qei};
use upright::board::Board;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::heapless::{Deque, spsc::Queue};
use upright::protocol::message::Reset;
use upright::protocol::serial_link::SerialLink;

use crate::board::OwnBoard;

pub const CLOCK_HZ: u32 = 168_000_000;

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(chip), Some(core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
        loop {}
    };
    let mut rcc = chip.RCC.freeze(Config::hse(8.MHz()).sysclk(CLOCK_HZ.Hz()));
    let (a, b) = (chip.GPIOA.split(&mut rcc), chip.GPIOB.split(&mut rcc));
    let (_, (pwm, ..)) = chip.TIM1.pwm_hz(20.kHz(), &mut rcc);
    let mut board = OwnBoard {
        cart: Qei::new(chip.TIM2, (a.pa0, a.pa1), &mut rcc),
        link: Qei::new(chip.TIM3, (a.pa6, a.pa7), &mut rcc),
        pwm: pwm.with(a.pa8),
        direction: b.pb12.into_push_pull_output(),
        enable: b.pb13.into_push_pull_output(),
        limit_low: b.pb0.into_pull_up_input(),
        limit_high: b.pb1.into_pull_up_input(),
        emergency_stop: b.pb2.into_pull_up_input(),
        driver_fault: b.pb10.into_pull_up_input(),
        supply: (Adc::new(chip.ADC1, true, AdcConfig::default(), &mut rcc), a.pa4.into_analog()),
        watchdog: IndependentWatchdog::new(chip.IWDG),
        overrun: false,
    };
    board.pwm.enable();
    board.watchdog.start(10.millis());
    let line = serial::config::Config::default().baudrate(460_800.bps());
    let Ok(line) = chip.USART1.serial((a.pa9, a.pa10), line, &mut rcc) else { loop {} };
    run(board, core.SYST, line)
}

/// Runs the control task every tick, and the serial link in between.
fn run(board: OwnBoard, mut timer: SYST, line: Serial<USART1>) -> ! {
    let (mut to_host, mut from_host) = line.split();
    let (mut commands, mut messages) = (Queue::<_, COMMANDS>::new(), Queue::<_, MESSAGES>::new());
    let (to_control, from_link) = commands.split();
    let (from_control, to_link) = messages.split();
    let firmware = Firmware::new(&TABLE, &SWING_UP, OwnBoard::WIDTHS, Reset::Power);
    let mut control = ControlTask::new(firmware, board, from_link, from_control);
    let mut link = SerialLink::new(to_control, to_link);

    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload((TICK_S * CLOCK_HZ as f32) as u32 - 1);
    timer.clear_current();
    timer.enable_counter();
    let mut frame = Deque::<u8, 512>::new();
    let mut due = false;
    loop {
        due |= timer.has_wrapped();
        if due {
            control.tick();
            due = timer.has_wrapped();
            control.board().overrun = due;
        }
        if let Ok(byte) = from_host.read() {
            link.receive(byte);
        }
        if frame.is_empty() {
            for &byte in link.transmit().unwrap_or_default() {
                let _ = frame.push_back(byte); // a frame is shorter than the queue
            }
        }
        if let Some(&byte) = frame.front()
            && to_host.write(byte).is_ok()
        {
            frame.pop_front();
        }
    }
}
