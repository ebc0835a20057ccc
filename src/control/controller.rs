//! The controller: one tick from encoder counts to motor duty cycle.

mod motion;
mod prediction;
mod steps;

use crate::control::actuator::Drive;
use crate::control::encoder::{CounterWidth, Encoders};
use crate::control::observer::Observer;
pub use crate::control::rejected::Rejected;
use crate::control::state_feedback::{FeedbackSum, LawState, saturate, state_feedback};
use crate::table::{DriveMap, ForceMap, GainTable, Law, LawGains, MotorMap, Scalar, TableError};
use nalgebra::SVector;

/// Observer, control law and actuator map of one gain table.
///
/// A tick has two halves. [`control`](Self::control) computes the duty cycle from the counts; only this has to happen
/// between reading the encoders and driving the motor. [`predict`](Self::predict) prepares the next tick and may run
/// later.
#[derive(Debug, Clone)]
pub struct Controller<'t, const NX: usize, const NY: usize, T: Scalar = f32> {
    table: &'t GainTable<NX, NY, T>,
    active: ActiveLaw<'t, NX, T>,
    mode: Mode<'t, NX, NY, T>,
    /// The mode to start in, prepared in advance: analysing the structure of the gains takes too long for a tick.
    started: Mode<'t, NX, NY, T>,
    target: T,
    encoders: Encoders<NY>,
    /// Current estimate x̂ within a tick, predicted estimate x̂⁻ between ticks.
    estimate: SVector<T, NX>,
    innovation: SVector<T, NY>,
    state: LawState<T>,
    last_volts: T,
    /// Known friction of each axis in this tick (N or N m).
    friction: [T; NY],
    requested: T,
    applied: T,
    /// Pulses from position 0 that a drive with pulses has been given.
    emitted: i32,
}

/// The law in use.
#[derive(Debug, Clone, Copy)]
struct ActiveLaw<'t, const NX: usize, T: Scalar> {
    law: Law,
    gains: &'t LawGains<NX, T>,
    /// Whether the force depends on earlier ticks by more than the estimate: through a pending force or an integral.
    has_memory: bool,
    /// Whether the law has no such memory, and the table no known friction and no pulses: a tick can skip them.
    is_plain: bool,
}

impl<'t, const NX: usize, T: Scalar> ActiveLaw<'t, NX, T> {
    fn new<const NY: usize>(table: &GainTable<NX, NY, T>, law: Law, gains: &'t LawGains<NX, T>) -> Self {
        let zero = T::default();
        let has_memory =
            table.drive.late().acts != zero || gains.k_pending != zero || gains.k_integral != zero;
        let is_plain = !has_memory && table.friction.is_none() && table.drive.pulses().is_none();
        Self { law, gains, has_memory, is_plain }
    }
}

#[derive(Debug, Clone, Copy)]
enum Mode<'t, const NX: usize, const NY: usize, T: Scalar> {
    Stopped,
    /// Running without an observer: the table holds none.
    WithoutObserver,
    /// Running from encoders.
    Running(Observer<'t, NX, NY, T>),
}

/// Result of the first half of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCommand<T = f32> {
    /// Force requested by the control law (N); acceleration (m/s²) for a drive that imposes it.
    pub requested_n: T,
    /// The same after all limits; 0 if the request is NaN.
    pub applied_n: T,
    /// Command to the power stage.
    pub drive: Drive,
}

impl<'t, const NX: usize, const NY: usize> Controller<'t, NX, NY> {
    /// A stopped controller at set-point 0, for encoder counters of these widths. It uses the first law that the table
    /// holds (LQR before pole placement).
    ///
    /// # Errors
    /// [`TableError`] if the table is damaged.
    pub fn new(table: &'t GainTable<NX, NY>, widths: [CounterWidth; NY]) -> Result<Self, TableError> {
        table.check()?;
        Self::with_checked(table, widths)
    }

    /// A controller that must never be started, for a table that cannot be used.
    #[cfg(feature = "firmware")]
    pub(crate) fn unusable(table: &'t GainTable<NX, NY>, widths: [CounterWidth; NY]) -> Self {
        Self::stopped(table, ActiveLaw::new(table, Law::Lqr, const { &LawGains::NONE }), widths)
    }
}

impl<'t, const NX: usize, const NY: usize, T: Scalar> Controller<'t, NX, NY, T> {
    /// The same as [`new`](Controller::new), but without checking the table: for a table in another precision, which a
    /// host compares with the table of the firmware.
    ///
    /// # Errors
    /// [`TableError::NoLaw`] if the table holds no law.
    pub fn with_checked(
        table: &'t GainTable<NX, NY, T>,
        widths: [CounterWidth; NY],
    ) -> Result<Self, TableError> {
        let (law, gains) = table.laws.present().next().ok_or(TableError::NoLaw)?;
        Ok(Self::stopped(table, ActiveLaw::new(table, law, gains), widths))
    }

    fn stopped(
        table: &'t GainTable<NX, NY, T>,
        active: ActiveLaw<'t, NX, T>,
        widths: [CounterWidth; NY],
    ) -> Self {
        let zero = T::default();
        Self {
            table,
            active,
            mode: Mode::Stopped,
            started: table
                .observer
                .as_ref()
                .map_or(Mode::WithoutObserver, |gains| Mode::Running(Observer::new(gains, &table.sensors))),
            target: zero,
            encoders: Encoders::new(widths),
            estimate: SVector::repeat(zero),
            innovation: SVector::repeat(zero),
            state: LawState::default(),
            last_volts: zero,
            friction: [zero; NY],
            requested: zero,
            applied: zero,
            emitted: 0,
        }
    }

    /// No force, motor off.
    fn off() -> MotorCommand<T> {
        MotorCommand { requested_n: T::default(), applied_n: T::default(), drive: Drive::OFF }
    }

    /// The law in use.
    pub fn law(&self) -> Law {
        self.active.law
    }

    /// Selects another law of the table.
    ///
    /// # Errors
    /// [`Rejected::Running`] between [`start`](Self::start) and [`stop`](Self::stop), because changing gains while
    /// balancing makes the force jump. [`Rejected::NoSuchLaw`] if the table does not hold the law.
    pub fn select(&mut self, law: Law) -> Result<(), Rejected> {
        if !matches!(self.mode, Mode::Stopped) {
            return Err(Rejected::Running);
        }
        let gains = self.table.law(law).ok_or(Rejected::NoSuchLaw)?;
        self.active = ActiveLaw::new(self.table, law, gains);
        Ok(())
    }

    /// Requested cart position (m). The governed set-point that the law follows is in [`law_state`](Self::law_state).
    pub fn setpoint(&self) -> T {
        self.target
    }

    /// Requests a cart position (m). The governor moves the law's set-point there no faster than the limits allow.
    ///
    /// # Errors
    /// [`Rejected::Setpoint`] if the position is not finite.
    pub fn set_setpoint(&mut self, position: T) -> Result<(), Rejected> {
        if !position.is_finite() {
            return Err(Rejected::Setpoint);
        }
        self.target = position;
        Ok(())
    }

    /// Governed set-point, integral and pending force.
    pub fn law_state(&self) -> &LawState<T> {
        &self.state
    }

    /// The estimate: current x̂ after [`control`](Self::control), predicted x̂⁻ after [`predict`](Self::predict).
    pub fn estimate(&self) -> &SVector<T, NX> {
        &self.estimate
    }

    /// Innovation of the last tick: measurement minus prediction (m or rad).
    pub fn innovation(&self) -> &SVector<T, NY> {
        &self.innovation
    }

    /// The encoders, to read their counts.
    pub fn encoders(&self) -> &Encoders<NY> {
        &self.encoders
    }

    /// The encoders, to home them.
    pub fn encoders_mut(&mut self) -> &mut Encoders<NY> {
        &mut self.encoders
    }

    /// Positions from the encoders (m, rad).
    pub fn positions(&self) -> SVector<T, NY> {
        self.encoders.positions(&self.table.sensors)
    }

    /// Starts from rest at the counter readings `raw`: rates 0, governed set-point at the present output, no pending
    /// force.
    ///
    /// # Errors
    /// [`Rejected::NoObserver`] if the table holds no observer.
    pub fn start(&mut self, raw: &[u32; NY]) -> Result<(), Rejected> {
        self.encoders.update(raw);
        self.start_at(&self.positions().data.0[0])
    }

    /// Starts from rest at these positions (m, rad), for sensors that are no incremental encoders.
    ///
    /// # Errors
    /// [`Rejected::NoObserver`] if the table holds no observer.
    pub fn start_at(&mut self, y: &[T; NY]) -> Result<(), Rejected> {
        if self.table.observer.is_none() {
            return Err(Rejected::NoObserver);
        }
        let mut x = SVector::<T, NX>::repeat(T::default());
        for (sensor, &position) in self.table.sensors.iter().zip(y) {
            if let Some(entry) = x.get_mut(sensor.state as usize) {
                *entry = position;
            }
        }
        self.start_in_state(&x);
        Ok(())
    }

    /// Starts from the state `x` (m, m/s, rad, rad/s …).
    pub fn start_in_state(&mut self, x: &SVector<T, NX>) {
        self.estimate = *x;
        self.innovation = SVector::repeat(T::default());
        self.state = LawState { setpoint: self.output(), ..LawState::default() };
        self.last_volts = T::default();
        self.friction = [T::default(); NY];
        (self.requested, self.applied) = (T::default(), T::default());
        self.emitted = self.nearest_step();
        self.mode = self.started;
    }

    /// Stops. The controller must be started again before it drives the motor.
    pub fn stop(&mut self) {
        self.mode = Mode::Stopped;
    }

    /// A tick of a stopped controller: only tracks the encoders.
    pub fn follow(&mut self, raw: &[u32; NY]) {
        self.encoders.update(raw);
    }

    /// First half of a tick: from raw encoder counts to the motor command.
    ///
    /// The command takes effect at once and is held for one tick. With a delay it takes effect at the start of the next
    /// tick and is held for that tick; with a lag the force approaches it. Then the law also feeds back the pending
    /// force.
    ///
    /// ```text
    /// e = y - C x̂⁻,   x̂ = x̂⁻ + L e,   u = sat(N r - K x̂ - k_pending u_pending - k_integral z)
    /// ```
    pub fn control(&mut self, raw: &[u32; NY]) -> MotorCommand<T> {
        self.control_with(raw, |_, _, _| ())
    }

    /// The same as [`control`](Self::control), but calls `judge` with counts, positions and innovation before the
    /// innovation is used. `judge` sets the innovation of a rejected measurement to 0, so that the prediction replaces
    /// the measurement.
    #[inline(always)]
    pub fn control_with(
        &mut self,
        raw: &[u32; NY],
        judge: impl FnOnce(&[i32; NY], &[T; NY], &mut [T; NY]),
    ) -> MotorCommand<T> {
        let Mode::Running(observer) = self.mode else {
            self.encoders.update(raw);
            return Self::off();
        };
        let mut y = self.encoders.measure(raw, observer.sensors);
        if !self.active.is_plain {
            self.subtract_lead(&mut y);
        }
        let requested = self.observe(&observer, &y, judge);
        self.actuate(requested)
    }

    /// The same as [`control`](Self::control) with the positions themselves (m, rad) instead of counts: from absolute
    /// sensors, or from somebody else's driver. The same positions give the same bits.
    pub fn control_at(&mut self, y: &[T; NY]) -> MotorCommand<T> {
        let Mode::Running(observer) = self.mode else { return Self::off() };
        let mut y = *y;
        self.subtract_lead(&mut y);
        let requested = self.observe(&observer, &y, |_, _, _| ());
        self.actuate(requested)
    }

    /// First half of a tick with the whole state measured, as the paper simulates it. A drive with pulses stays off:
    /// what it knows of the cart is what it was given, not what is measured.
    pub fn control_from_state(&mut self, x: &SVector<T, NX>) -> MotorCommand<T> {
        self.estimate = *x;
        if matches!(self.mode, Mode::Stopped) || self.table.drive.pulses().is_some() {
            return Self::off();
        }
        self.state.govern(self.target, self.active.gains.setpoint_step);
        let requested =
            self.request(state_feedback(self.active.gains.n, self.state.setpoint, &self.active.gains.k, x));
        self.actuate(requested)
    }

    #[inline(always)]
    fn observe(
        &mut self,
        observer: &Observer<'t, NX, NY, T>,
        y: &[T; NY],
        judge: impl FnOnce(&[i32; NY], &[T; NY], &mut [T; NY]),
    ) -> T {
        let estimate = &mut self.estimate.data.0[0];
        let e = &mut self.innovation.data.0[0];
        *e = observer.innovation(y, estimate);
        judge(self.encoders.counts(), y, e);
        self.state.govern(self.target, self.active.gains.setpoint_step);
        let mut sum = FeedbackSum::new(self.active.gains.n, self.state.setpoint);
        observer.correct(e, estimate, |joint, x| {
            if let Some(k) = self.active.gains.k.as_slice().chunks(2).nth(joint) {
                sum.feed_back(k, x);
            }
        });
        let estimate = &self.estimate.data.0[0];
        let mut force = sum.force();
        if self.active.is_plain {
            return force;
        }
        if let Some(map) = &self.table.friction {
            force += map.force(self.active.law, estimate, &mut self.friction);
        }
        self.request(force)
    }

    /// The force requested by the law, from its state feedback.
    #[inline(always)]
    fn request(&mut self, feedback: T) -> T {
        let mut requested = feedback;
        if self.active.has_memory {
            requested -= self.active.gains.k_pending * self.state.pending;
            requested -= self.active.gains.k_integral * self.state.integral;
            self.requested = requested;
        }
        requested
    }

    /// Limits the force and converts it for the power stage.
    #[inline(always)]
    fn actuate(&mut self, requested: T) -> MotorCommand<T> {
        match &self.table.drive {
            DriveMap::Force(force) => self.impose(force, requested),
            drive => self.convert(drive, requested),
        }
    }

    // Out of line: a rig that imposes a force does not pay for motors and pulses.
    #[inline(never)]
    fn convert(&mut self, drive: &DriveMap<T>, requested: T) -> MotorCommand<T> {
        match drive {
            DriveMap::Force(force) => self.impose(force, requested),
            DriveMap::Volts(motor) => {
                let (applied, drive) = self.drive_motor(motor, requested);
                self.applied = applied;
                MotorCommand { requested_n: requested, applied_n: applied, drive }
            }
            DriveMap::Pulses(steps) => self.step(steps, requested),
        }
    }

    #[inline(always)]
    fn impose(&mut self, force: &ForceMap<T>, requested: T) -> MotorCommand<T> {
        let limited = saturate(requested, force.limit_n);
        self.applied = limited;
        MotorCommand { requested_n: requested, applied_n: limited, drive: Drive::Force(limited.to_f32()) }
    }

    /// The force that a motor's voltage gives at the cart's speed (N), and its command.
    #[inline(always)]
    fn drive_motor(&mut self, motor: &MotorMap<T>, requested: T) -> (T, Drive) {
        let limited = saturate(requested, motor.force.limit_n);
        let (volts, force) = motor.volts_and_force(limited, self.speed(), self.last_volts);
        self.last_volts = volts;
        (force, Drive::Duty(motor.duty(volts).to_f32()))
    }

    /// Replaces the force of this tick by that of another controller on the same rig: requested and applied (N). Call
    /// it between [`control`](Self::control) and [`predict`](Self::predict). A host uses it to run the law in `f64`
    /// alongside the firmware.
    pub fn take_force(&mut self, requested: T, applied: T) {
        (self.requested, self.applied) = (requested, applied);
    }

    /// Second half of a tick: `x̂⁻ = Ad x̂ + Bd u` with the force actually applied and known friction; also updates
    /// the integral.
    pub fn predict(&mut self) {
        self.predict_with(|_, _, _| ());
    }

    /// The same as [`predict`](Self::predict), but a controller that runs from encoders first calls `finish` with the
    /// counts, the current estimates of the measured positions (m or rad) and the force during this tick (N).
    #[inline(always)]
    pub fn predict_with(&mut self, finish: impl FnOnce(&[i32; NY], &dyn Fn() -> [T; NY], T)) {
        let during_this_tick = if self.active.is_plain { self.applied } else { self.advance() };
        if let Mode::Running(observer) = &self.mode {
            let estimate = &mut self.estimate.data.0[0];
            finish(self.encoders.counts(), &|| observer.measured(estimate), during_this_tick);
            observer.predict(estimate, during_this_tick);
            if !self.active.is_plain
                && let Some(map) = &self.table.friction
            {
                map.add_to(estimate, &self.friction);
            }
        }
    }

    /// Updates the memory of the law at the end of a tick, if it has one; returns the force that acted during the tick
    /// (N).
    // Out of line: a tick of a law without memory does not pay for it.
    #[cold]
    fn advance(&mut self) -> T {
        let during_this_tick = self.respond();
        if self.active.has_memory {
            let (position, tick_s) = (self.output(), self.table.tick_s);
            self.state.advance(self.active.gains.k_integral, position, tick_s, self.requested, self.applied);
        }
        during_this_tick
    }

    /// Ends the tick of the drive; returns the mean force on the cart during it (N).
    // Called in two places: one copy.
    #[inline(never)]
    fn respond(&mut self) -> T {
        if !self.active.has_memory {
            return self.applied;
        }
        self.state.respond(&self.table.drive.late(), self.applied)
    }

    /// The cart's speed (m/s), the state after its position.
    #[inline(always)]
    fn speed(&self) -> T {
        self.estimate.get(1).copied().unwrap_or_default()
    }

    fn output(&self) -> T {
        self.estimate.get(self.table.output as usize).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
