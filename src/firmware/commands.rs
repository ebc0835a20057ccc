//! Answers to the host's requests.

use super::Firmware;
use crate::board::Contacts;
use crate::control::controller::Rejected;
use crate::protocol::message::{Answer, Command, Info, InvalidRequest, PROTOCOL, Request, Statistics};
use crate::supervision::calibration::links_hang;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::supervisor::State;
use crate::table::ChecksumScan;
use crate::table::SwingUp;

/// Version of this crate: major, minor, patch.
const VERSION: [u8; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

/// Parses a decimal number at compile time; a number above 255 does not compile.
const fn number(digits: &str) -> u8 {
    match u8::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a number of the version does not fit into a byte"),
    }
}

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Carries out a command and returns the answer.
    #[inline(never)]
    pub(super) fn answer(&mut self, command: &Command) -> Answer {
        let done = |result: Result<(), _>| result.map_or_else(Answer::NotNow, |()| Answer::Done);
        let rejected = |reason| Answer::Rejected(InvalidRequest::Controller(reason));
        let taken = |result: Result<(), _>| result.map_or_else(rejected, |()| Answer::Done);
        if let Request::Arm | Request::Goto(_) | Request::Shake(_) | Request::Still = command.request {
            self.restart_lockout();
        }
        match command.request {
            Request::KeepAlive => Answer::Done,
            Request::Home => done(self.home_here()),
            Request::HomeRail => done(self.home_rail()),
            Request::CheckSigns => done(self.check_signs()),
            Request::Jog { along } => done(self.hold_jog(along)),
            Request::Arm => done(self.arm(command.id)),
            Request::Goto(to) => done(self.go_to(to, command.id)),
            Request::Disarm => {
                self.supervisor.disarm();
                self.calibration.cancel();
                self.setpoint_commanded = false;
                self.controller.stop();
                self.let_go();
                Answer::Done
            }
            Request::Clear => {
                let result = self.supervisor.clear(self.clearing_inhibits());
                self.last_clear_id = command.id;
                done(result)
            }
            Request::Setpoint(position_m) => taken(self.take_setpoint(position_m)),
            Request::Select(law) => taken(self.controller.select(law)),
            Request::Info => Answer::Info(self.info()),
            Request::Cause => Answer::Cause(self.supervisor.cause()),
            Request::Crash => Answer::Crash(self.start.crash),
            Request::Statistics => Answer::Statistics(self.statistics()),
            Request::ResetStatistics => {
                self.statistics = Statistics::default();
                self.detection.reset_rejected();
                Answer::Done
            }
            Request::Telemetry(period_ticks) => {
                (self.telemetry_period_ticks, self.ticks_to_telemetry) = (period_ticks, 0);
                Answer::Done
            }
            Request::Shake(shaking) => self.begin_shaking(shaking, command.id),
            Request::Forces { first, forces } => self.take_forces(first, &forces),
            Request::Still => done(self.begin_stilling(command.id)),
            Request::Log(is_kept) => {
                self.keep_log(is_kept);
                Answer::Done
            }
        }
    }

    /// Homes at the present position: the cart is at 0, and the links hang still or swing about hanging.
    fn home_here(&mut self) -> Result<(), Inhibits> {
        let position = self.calibration.hanging(
            self.controller.encoders().counts(),
            &self.table.sensors,
            &self.table.limits,
        )?;
        self.home(&position)
    }

    /// Starts homing by the limit switches.
    fn home_rail(&mut self) -> Result<(), Inhibits> {
        let [travel, _] = self.table.limits.travel_counts;
        Inhibits::NO_SWITCHES.when(travel == 0).union(self.homing_inhibits()).err_if_any()?;
        self.supervisor.start_homing()?;
        self.calibration.start_rail_homing();
        Ok(())
    }

    /// Starts the sign check.
    fn check_signs(&mut self) -> Result<(), Inhibits> {
        let sensors = &self.table.sensors;
        let hanging = links_hang(self.controller.encoders().counts(), sensors);
        let not_homed = Inhibits::NOT_HOMED.when(self.supervisor.state() != State::Calibrated);
        Inhibits::NOT_HANGING
            .when(!hanging)
            .union(self.supervisor.arming_inhibits())
            .union(not_homed)
            .err_if_any()?;
        self.calibration.start_sign_check(sensors);
        Ok(())
    }

    /// Arms. `id` is that of the command.
    fn arm(&mut self, id: u64) -> Result<(), Inhibits> {
        let inhibits = self.arming_inhibits().union(self.held_inhibit(id));
        self.supervisor.arm(inhibits)?;
        (self.checksum_scan, self.is_checked) = (ChecksumScan::default(), false);
        let counts = *self.controller.encoders().counts();
        self.calibration.restart_slow(&counts);
        Ok(())
    }

    /// A command that would turn the motor on has come. A key held down since a fault sends one after the other, and
    /// none of them may turn the motor on: each one restarts the lockout, which ends only when the key has been
    /// released for `still_ticks`. The time for which homing wants everything still also serves for this; there is no
    /// need for another setting in the rig file.
    fn restart_lockout(&mut self) {
        let has_fallen = self.supervisor.fault().is_some();
        if has_fallen || self.rearm_lockout_ticks > 0 {
            self.rearm_lockout_ticks = self.table.limits.still_ticks;
        }
    }

    /// [`Inhibits::HELD`] if the command `id`, which would turn the motor on, comes from a key held since a fault.
    #[inline(never)]
    pub(super) fn held_inhibit(&self, id: u64) -> Inhibits {
        let is_held = self.rearm_lockout_ticks > 0 || id <= self.last_clear_id;
        Inhibits::HELD.when(is_held && self.supervisor.fault().is_none())
    }

    /// Inhibits of clearing: conditions that would trip the fault again at once.
    fn clearing_inhibits(&self) -> Inhibits {
        let Contacts { emergency_stop, driver_fault, .. } = self.contacts;
        Inhibits::EMERGENCY_STOP
            .when(emergency_stop)
            .union(Inhibits::DRIVER.when(driver_fault))
            .union(Inhibits::TABLE.when(!self.is_usable))
    }

    /// Takes a commanded cart position (m), which has to be far enough from the soft limits of the rail.
    fn take_setpoint(&mut self, position_m: f32) -> Result<(), Rejected> {
        let [low, high] = self.table.limits.setpoints_m();
        if !(low..=high).contains(&position_m) {
            return Err(Rejected::Setpoint);
        }
        self.controller.set_setpoint(position_m)?;
        self.setpoint_commanded = true;
        Ok(())
    }

    /// Identity of this firmware.
    fn info(&self) -> Info {
        Info {
            protocol: PROTOCOL,
            version: VERSION,
            rig_hash: self.table.rig_hash,
            tick_s: self.timer_tick_s,
            states: NX as u8,
            sensors: NY as u8,
            reset: self.start.reset,
            image: self.start.image,
        }
    }
}
