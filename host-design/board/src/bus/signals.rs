//! Signals between pins and peripherals.

use super::{Bus, Driven, Pulse};
use crate::angle_sensor::{AngleBus, AngleSensor};
use crate::clock::Time;
use crate::error::Violation;
use crate::peripherals::encoder_timer::Shaft;
use crate::peripherals::gpio::ExternalLevel;
use crate::peripherals::rcc::Domain;
use crate::register_sensor::{RegisterDefect, RegisterSensor};
use crate::wiring::{BREAK_PINS, COMPLEMENTARY_PINS, ENCODER_INPUTS, PWM_PINS, Pin, SERIAL_PINS};

impl Bus {
    /// The shaft that is connected to a timer, if any, and the period of that timer's clock.
    pub(super) fn encoder_route(&self, timer: usize) -> (Option<Shaft>, Time) {
        let tick = self.rcc.timer_clock(if timer == 4 { Domain::Apb2 } else { Domain::Apb1 });
        let input = |channel: usize| {
            ENCODER_INPUTS
                .iter()
                .filter(|input| input.0 == timer && input.1 == channel)
                .find(|(.., pin, function)| self.is_alternate(*pin, *function))
                .map(|&(.., pin, _)| pin)
        };
        let shaft = input(0).zip(input(1)).and_then(|pins| {
            let index = self.wiring.encoders.iter().position(|&encoder| encoder == pins)?;
            self.shafts.get(index).copied()
        });
        (shaft, tick)
    }

    /// Turns an encoder so that it reaches `position` at `end`; all counters first catch up with the old movement.
    pub(crate) fn turn_encoder(&mut self, encoder: usize, position: i64, end: Time) {
        for timer in 0..self.encoders.len() {
            let (shaft, tick) = self.encoder_route(timer);
            self.encoders[timer].read(0x24, shaft.as_ref(), self.now, tick);
        }
        if let Some(shaft) = self.shafts.get_mut(encoder) {
            shaft.turn(position, self.now, end.max(self.now));
        }
    }

    /// The absolute sensor in the place of an encoder; connected, if it is not yet.
    pub(crate) fn angle_sensor(&mut self, encoder: usize) -> Option<&mut AngleSensor> {
        let data = self.wiring.encoders.get(encoder)?.0;
        let known = self.angle_sensors.iter().position(|sensor| sensor.data == data);
        let place = known.unwrap_or_else(|| {
            self.angle_sensors.push(AngleSensor::new(data));
            self.angle_sensors.len() - 1
        });
        self.angle_sensors.get_mut(place)
    }

    /// Sets the registers of the sensor on two wires in the place of an encoder; connected, if it is not yet.
    pub(crate) fn register_sensor(&mut self, encoder: usize, address: u8, first: u8, values: [u8; 5]) {
        let Some(&(data, _)) = self.wiring.encoders.get(encoder) else { return };
        match self.register_sensors.iter_mut().find(|(at, _)| *at == data) {
            Some((_, sensor)) => sensor.set_values(values),
            None => self.register_sensors.push((data, RegisterSensor::new(address, first, values))),
        }
        self.show_registers();
    }

    /// Begins a defect of that sensor.
    pub(crate) fn spoil_registers(&mut self, encoder: usize, defect: RegisterDefect) {
        let Some(&(data, _)) = self.wiring.encoders.get(encoder) else { return };
        if let Some((_, sensor)) = self.register_sensors.iter_mut().find(|(at, _)| *at == data) {
            sensor.set_defect(defect);
        }
        self.show_registers();
    }

    /// The data wires as their sensors leave them: pulled up outside the chip, as the bus needs.
    fn show_registers(&mut self) {
        for (data, sensor) in &self.register_sensors {
            let level = if sensor.pulls() { ExternalLevel::Low } else { ExternalLevel::High };
            self.ports[data.port].wires[usize::from(data.number)] = level;
        }
    }

    fn register_sensors_hear(&mut self) -> Result<(), Violation> {
        let Some([_, clock, _]) = self.wiring.angle_bus.filter(|_| !self.register_sensors.is_empty()) else {
            return Ok(());
        };
        let clock = self.output_level(clock);
        for (data, sensor) in &mut self.register_sensors {
            let port = &self.ports[data.port];
            let is_pulled = port.mode_of(data.number) == 1 && port.output >> data.number & 1 == 0;
            sensor.hear(clock, !is_pulled, self.now)?;
        }
        self.show_registers();
        Ok(())
    }

    /// The absolute sensors hear the outputs, and drive their data wires.
    pub(super) fn angle_sensors_hear(&mut self) -> Result<(), Violation> {
        self.register_sensors_hear()?;
        let Some(pins) = self.wiring.angle_bus.filter(|_| !self.angle_sensors.is_empty()) else {
            return Ok(());
        };
        let [select, clock, command] = pins.map(|pin| self.output_level(pin));
        for sensor in &mut self.angle_sensors {
            let level = match sensor.hear(AngleBus { select, clock, command }, self.now)? {
                None => ExternalLevel::Open,
                Some(false) => ExternalLevel::Low,
                Some(true) => ExternalLevel::High,
            };
            self.ports[sensor.data.port].wires[usize::from(sensor.data.number)] = level;
        }
        Ok(())
    }

    fn is_alternate(&self, pin: Pin, function: u32) -> bool {
        self.ports[pin.port].is_alternate(pin.number, function)
    }

    /// Whether TX and RX of the USART are routed to pins.
    pub(super) fn serial_connected(&self) -> (bool, bool) {
        let any = |choose: fn(&(u8, Pin, Pin)) -> Pin| {
            let of_usart = |pins: &&(u8, Pin, Pin)| pins.0 == self.wiring.usart;
            SERIAL_PINS.iter().filter(of_usart).any(|pins| self.is_alternate(choose(pins), 7))
        };
        (any(|pins| pins.1), any(|pins| pins.2))
    }

    /// Levels that the PWM timer drives at the pins of a port.
    pub(super) fn alternate_levels(&self, port: usize) -> u32 {
        let pins: &[Pin] = if self.wiring.is_complementary() { &COMPLEMENTARY_PINS } else { &PWM_PINS };
        pins.iter()
            .filter(|pin| pin.port == port && self.is_alternate(**pin, 1) && self.pwm.level())
            .fold(0, |levels, pin| levels | 1 << pin.number)
    }

    /// Level of an output pin as the power stage sees it; a pull-down holds it low while nothing drives it.
    pub(crate) fn output_level(&self, pin: Pin) -> bool {
        let port = &self.ports[pin.port];
        port.mode_of(pin.number) == 1 && port.output >> pin.number & 1 != 0
    }

    /// Accumulates the times of the motor's outputs up to now.
    pub(crate) fn settle_output(&mut self) {
        let before = self.pwm.high;
        let tick = self.rcc.timer_clock(Domain::Apb2);
        if self.rcc.stopped {
            self.pwm.stand_still(self.now);
        } else {
            self.pwm.advance(self.now, tick);
        }
        let high = self.pwm.high - before;
        let span = self.now - self.driven_until;
        // A pin is written only after this: the level that it has now, it has had since then.
        let since = std::mem::replace(&mut self.driven_until, self.now);
        let (pwm, along) = (self.wiring.pwm, self.output_level(self.wiring.direction));
        let high = if self.is_alternate(pwm, 1) {
            high
        } else if self.output_level(pwm) {
            span
        } else {
            0
        };
        let enabled = self.output_level(self.wiring.enable);
        if along != self.direction.0 {
            self.direction = (along, since);
        }
        self.keep_pulses(enabled);
        let Driven { along: plus, against: minus, pwm_high, enabled: enabled_time } = &mut self.driven;
        *pwm_high += high;
        if enabled {
            *enabled_time += span;
            *(if along { plus } else { minus }) += high;
        }
    }

    /// Turns the edges of the motor timer's output into pulses, of a time in which no pin has changed its level.
    fn keep_pulses(&mut self, enabled: bool) {
        let (is_routed, (along, turned_at)) = (self.is_alternate(self.wiring.pwm, 1), self.direction);
        for (at, is_high) in self.pwm.edges.iter_mut().flat_map(|edges| edges.drain(..)) {
            match (is_high, self.pulses.last_mut()) {
                (true, _) if is_routed => {
                    self.pulses.push(Pulse { at, width: None, along, turned_at, enabled });
                }
                (false, Some(pulse)) if pulse.width.is_none() => pulse.width = Some(at - pulse.at),
                _ => {}
            }
        }
    }

    /// Applies an external level to a pin, or removes it.
    pub(crate) fn connect(&mut self, pin: Pin, wire: ExternalLevel) {
        self.settle_output();
        let before = self.ports[pin.port].input(pin.number);
        self.ports[pin.port].wires[usize::from(pin.number)] = wire;
        let after = self.ports[pin.port].input(pin.number);
        if let (true, Some(high)) = (before != after, after) {
            self.exti.pin(pin.port, pin.number, high);
        }
        self.levels_changed();
        self.refresh();
    }

    /// Updates what reacts to pin levels without a clock: the break input.
    pub(crate) fn levels_changed(&mut self) {
        for pin in BREAK_PINS {
            if self.is_alternate(pin, 1) {
                // A floating input counts as high, which is a break.
                let high = self.ports[pin.port].input(pin.number).unwrap_or(true);
                self.pwm.break_input(high);
            }
        }
    }

    /// The chip's supply has changed: the voltage detector is line 16 of EXTI.
    pub(crate) fn supply_changed(&mut self) {
        if let (is_below, true) = self.power.compare() {
            self.exti.line(16, is_below);
        }
    }

    /// The crystal stops; the clock security system may react.
    pub(crate) fn stop_crystal(&mut self) {
        self.settle_output();
        self.rcc.stop_crystal();
        if std::mem::take(&mut self.rcc.security_event) {
            self.pwm.clock_failure();
        }
        let hclk = self.rcc.hclk();
        self.system.change_clock(self.now, self.hclk, hclk);
        self.hclk = hclk;
        self.refresh();
    }
}
