//! The firmware with embassy: an example of a [board of your own](../../../docs/own-board.md), for a NUCLEO-G474RE.
//!
//! | task | started by | priority | does |
//! |---|---|---|---|
//! | `control` | a timer, at the table's period | above all interrupts but the timer's | inputs → supervisor → controller → motor, then the prediction |
//! | `main` | bytes, and every millisecond | lowest | bytes → commands, telemetry → bytes |
//!
//! They share two queues and nothing else.

#![no_std]
#![no_main]

mod board;
/// The gain table in the file that UPRIGHT_GAINS names.
#[allow(dead_code, reason = "an image does not need its name")]
mod gains {
    include!(env!("UPRIGHT_GAINS"));
}

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::adc::{Adc, AdcConfig};
use embassy_stm32::gpio::{Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::LPUART1;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{Config, Qei};
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::usart::{self, BufferedInterruptHandler, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peripherals, bind_interrupts, pac, rcc};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use panic_halt as _;
use static_cell::{ConstStaticCell, StaticCell};
use upright::board::Board;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::heapless::spsc::Queue;
use upright::protocol::message::{Command, Message, Reset};
use upright::protocol::serial_link::SerialLink;

use crate::board::Hardware;
use crate::gains::{SENSORS, STATES, SWING_UP, SwingUp, TABLE, TICK_S};

/// The tick. If the table's is no whole number of microseconds, the motor stays off.
pub(crate) const TICK: Duration = Duration::from_micros((TICK_S as f64 * 1e6 + 0.5) as u64);

/// Runs `control` in an interrupt that nothing else uses.
static ABOVE: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
unsafe fn UART5() {
    // SAFETY: the executor has enabled this interrupt, so it has been started.
    unsafe { ABOVE.on_interrupt() }
}

bind_interrupts!(struct Interrupts {
    LPUART1 => BufferedInterruptHandler<LPUART1>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_stm32::init(clocks());
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    let start = if pac::RCC.csr().read().iwdgrstf() { Reset::Watchdog } else { Reset::Power };
    pac::RCC.csr().modify(|flags| flags.set_rmvf(true));

    static TO_CONTROL: StaticCell<Queue<Command, COMMANDS>> = StaticCell::new();
    static TO_LINK: StaticCell<Queue<Message<STATES, SENSORS>, MESSAGES>> = StaticCell::new();
    let (to_control, commands) = TO_CONTROL.init(Queue::new()).split();
    let (messages, to_link) = TO_LINK.init(Queue::new()).split();
    let firmware = Firmware::new(&TABLE, &SWING_UP, Hardware::WIDTHS, start);

    let (hardware, line) = set_up(chip);
    let Ok(task) = control(ControlTask::new(firmware, hardware, commands, messages)) else { return };
    interrupt::LPUART1.set_priority(Priority::P2);
    interrupt::UART5.set_priority(Priority::P1);
    ABOVE.start(interrupt::UART5).spawn(task);
    serve(SerialLink::new(to_control, to_link), line).await
}

/// 170 MHz from the board's crystal.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(rcc::Hse { freq: Hertz::mhz(24), mode: rcc::HseMode::Oscillator });
    config.rcc.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV6,
        mul: rcc::PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(rcc::PllRDiv::DIV2),
    });
    config.rcc.sys = rcc::Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.mux.adc12sel = rcc::mux::Adcsel::SYS;
    config
}

/// Gives each pin its peripheral. The motor is off.
fn set_up(chip: Peripherals) -> (Hardware, BufferedUart<'static>) {
    let encoder = Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..Config::default() };
    let pin = PwmPin::new(chip.PA8, OutputType::PushPull);
    let pwm =
        SimplePwm::new(chip.TIM1, Some(pin), None, None, None, Hertz::khz(20), CountingMode::EdgeAlignedUp);
    let mut pwm = pwm.split().ch1;
    pwm.enable();
    let hardware = Hardware {
        cart: Qei::new(chip.TIM2, chip.PA0, chip.PA1, encoder),
        link: Qei::new(chip.TIM3, chip.PA6, chip.PA7, encoder),
        pwm,
        direction: Output::new(chip.PB12, Level::Low, Speed::Low),
        enable: Output::new(chip.PB13, Level::Low, Speed::Low),
        limit_low: Input::new(chip.PB0, Pull::Up),
        limit_high: Input::new(chip.PB1, Pull::Up),
        emergency_stop: Input::new(chip.PB2, Pull::Up),
        driver_fault: Input::new(chip.PB10, Pull::Up),
        converter: Adc::new(chip.ADC1, AdcConfig::default()),
        supply: chip.PC0,
        // Three ticks, and a quarter for the inaccuracy of its clock.
        watchdog: IndependentWatchdog::new(chip.IWDG, TICK.as_micros() as u32 * 15 / 4),
        next_tick: Instant::now(),
        is_late: false,
    };
    board::note_edges();
    // The ST-Link's serial port.
    static SENT: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);
    static RECEIVED: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);
    let mut speed = usart::Config::default();
    speed.baudrate = 460_800;
    let (sent, received) = (SENT.take(), RECEIVED.take());
    match BufferedUart::new(chip.LPUART1, chip.PA3, chip.PA2, sent, received, Interrupts, speed) {
        Ok(line) => (hardware, line),
        Err(_) => panic!("460 800 Bd can be made from 170 MHz"),
    }
}

/// Runs the control task every tick.
#[embassy_executor::task]
async fn control(mut control: ControlTask<'static, 'static, Hardware, STATES, SENSORS, SwingUp>) {
    control.board().watchdog.unleash();
    let mut due = Instant::now();
    loop {
        due += TICK;
        control.board().next_tick = due + TICK;
        // After a late tick, the next one comes at once.
        Timer::at(due).await;
        control.tick();
    }
}

/// Moves bytes between the link and the line.
async fn serve(mut link: SerialLink<'static, STATES, SENSORS>, line: BufferedUart<'static>) {
    let (mut to_host, mut from_host) = line.split();
    let mut bytes = [0; 64];
    loop {
        // Noise is an error, too; the frame that it has spoilt is refused.
        if let Ok(Ok(length)) = with_timeout(Duration::from_millis(1), from_host.read(&mut bytes)).await {
            for &byte in bytes.iter().take(length) {
                link.receive(byte);
            }
        }
        if let Some(frame) = link.transmit() {
            let _ = to_host.write_all(frame).await; // this line has no errors when it sends
        }
    }
}
