//! What the host asks for.

use super::Firmware;
use crate::board::Contacts;
use crate::control::controller::Rejected;
use crate::protocol::message::{Answer, Command, Info, PROTOCOL, Request, Statistics};
use crate::supervision::calibration::hang;
use crate::supervision::inhibits::Reasons;
use crate::supervision::supervisor::State;

impl<const NX: usize, const NY: usize> Firmware<'_, NX, NY> {
    pub(super) fn answer(&mut self, command: &Command) -> Answer {
        let done = |result: Result<(), _>| result.map_or_else(Answer::NotNow, |()| Answer::Done);
        let taken = |result: Result<(), _>| result.map_or_else(Answer::Rejected, |()| Answer::Done);
        match command.request {
            Request::Beat => Answer::Done,
            Request::Home => done(self.home_here()),
            Request::HomeRail => done(self.home_rail()),
            Request::CheckSigns => done(self.check_signs()),
            Request::Arm => done(self.arm(command.id)),
            Request::Disarm => {
                self.supervisor.disarm();
                self.calibration.give_up();
                self.commanded = false;
                self.controller.stop();
                Answer::Done
            }
            Request::Clear => {
                let result = self.supervisor.clear(self.against_clearing());
                self.cleared_by = command.id;
                done(result)
            }
            Request::Setpoint(position) => taken(self.setpoint(position)),
            Request::Select(law) => taken(self.controller.select(law)),
            Request::Info => Answer::Info(self.info()),
            Request::Cause => Answer::Cause(self.supervisor.cause()),
            Request::Statistics => Answer::Statistics(self.statistics()),
            Request::ResetStatistics => {
                self.statistics = Statistics::default();
                self.detection.forget_rejected();
                Answer::Done
            }
            Request::Telemetry(every) => {
                (self.every, self.until_telemetry) = (every, 0);
                Answer::Done
            }
        }
    }

    /// Cart at 0, links hanging, as they are.
    fn home_here(&mut self) -> Result<(), Reasons> {
        Reasons::MOVING.when(!self.calibration.is_still(&self.table.limits)).none()?;
        self.supervisor.homed()?;
        self.home(&self.table.limits.rest_counts);
        Ok(())
    }

    fn home_rail(&mut self) -> Result<(), Reasons> {
        let [travel, _] = self.table.limits.travel_counts;
        Reasons::NO_SWITCHES.when(travel == 0).none()?;
        self.supervisor.begin_homing()?;
        self.calibration.begin_rail();
        Ok(())
    }

    fn check_signs(&mut self) -> Result<(), Reasons> {
        let limits = &self.table.limits;
        let hanging = hang(self.controller.encoders_mut().counts(), limits);
        let not_homed = Reasons::NOT_HOMED.when(self.supervisor.state() != State::Calibrated);
        Reasons::NOT_HANGING.when(!hanging).and(self.supervisor.against_arming()).and(not_homed).none()?;
        self.calibration.begin_signs(limits);
        Ok(())
    }

    fn arm(&mut self, id: u64) -> Result<(), Reasons> {
        // A key that is held since the fault sends one command after the other: none of them is a new act.
        if self.supervisor.state() == State::Fault || self.held > 0 {
            self.held = self.table.limits.still_ticks;
        }
        let held = self.supervisor.state() != State::Fault && (self.held > 0 || id <= self.cleared_by);
        let further = self.against_arming().and(Reasons::HELD.when(held));
        let table = Reasons::TABLE.when(self.table.check(&self.build).is_err());
        self.supervisor.arm(further.and(table))?;
        let counts = *self.controller.encoders_mut().counts();
        self.calibration.restart_slow(&counts);
        Ok(())
    }

    /// What would raise the fault again at once.
    fn against_clearing(&self) -> Reasons {
        let Contacts { emergency_stop, driver_fault, .. } = self.contacts;
        Reasons::EMERGENCY_STOP.when(emergency_stop).and(Reasons::DRIVER.when(driver_fault))
    }

    fn setpoint(&mut self, position: f32) -> Result<(), Rejected> {
        let [low, high] = self.table.limits.rail_m;
        if !(low..=high).contains(&position) {
            return Err(Rejected::Setpoint);
        }
        self.controller.set_setpoint(position)?;
        self.commanded = true;
        Ok(())
    }

    fn info(&self) -> Info {
        Info {
            protocol: PROTOCOL,
            version: [0, 1, 0],
            rig_hash: self.table.rig_hash,
            tick_s: self.table.tick_s,
            states: NX as u8,
            sensors: NY as u8,
            reset: self.reset,
        }
    }
}
