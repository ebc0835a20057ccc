//! Machines with one imperfection alone.

use std::sync::LazyLock;

use crate::rig::{ArmSizes, Base, IMPERFECTIONS, Imperfection, Key, PerJoint, Reality, Rig, Slider, VERIFY};

/// [`IMPERFECTIONS`] as an arm has them.
static ON_ARM: LazyLock<Vec<Imperfection>> =
    LazyLock::new(|| IMPERFECTIONS.iter().map(Imperfection::of_arm).collect());

impl Imperfection {
    /// Every imperfection of machines with this base, in the order of `[verify]`.
    pub fn of_base(base: Base) -> &'static [Self] {
        match base {
            Base::Cart => IMPERFECTIONS,
            Base::Arm => &ON_ARM,
        }
    }

    fn of_arm(&self) -> Self {
        let Key { name, unit, .. } = Base::Arm.key(&VERIFY, self.key);
        let mut row = *self;
        (row.key, row.unit) = (name, unit);
        if let Some(ArmSizes { typical, source, remedy, slider }) = self.on_arm {
            let on_arm = |(slider, (unit, range)): (Slider, _)| Slider { unit, range, ..slider };
            (row.typical, row.source, row.remedy) = (typical, source, remedy);
            row.slider = self.slider.zip(slider).map(on_arm);
        }
        row
    }

    /// The machine of `rig` with this imperfection alone, of this size; a lag is that beyond the stated one.
    pub fn on(&self, rig: &Rig, size: f64) -> Rig {
        self.on_with_bristle(rig, size, None)
    }

    /// The same with this angle over which joint friction builds up (rad), or the default.
    pub fn on_with_bristle(&self, rig: &Rig, size: f64, bristle_rad: Option<f64>) -> Rig {
        // The motor behind the pulses is a part of the drive.
        let none = Reality::default().on(rig.base());
        let mut reality = Reality { step_motor: rig.reality.step_motor.clone(), ..none };
        if let Some(bristle_rad) = bristle_rad {
            reality.friction.presliding_rad = PerJoint::all(bristle_rad);
        }
        (self.set)(&mut reality, size);
        if let (Some(real_s), Some(stated_s)) = (&mut reality.driver.driver_lag_s, rig.actuator.lag_s()) {
            *real_s += stated_s;
        }
        Rig { reality, ..rig.clone() }
    }

    /// The angles over which joint friction may build up (rad); a single none for another imperfection.
    pub fn bristles(&self) -> Vec<Option<f64>> {
        match self.bristles_rad {
            [] => vec![None],
            angles => angles.iter().copied().map(Some).collect(),
        }
    }

    /// One machine for each of these angles.
    pub fn on_each(&self, rig: &Rig, size: f64) -> Vec<Rig> {
        self.bristles().into_iter().map(|bristle_rad| self.on_with_bristle(rig, size, bristle_rad)).collect()
    }

    /// Those that are simulated on the machine of `rig`.
    pub fn all_of(rig: &Rig) -> Vec<&'static Self> {
        Self::of_base(rig.base()).iter().filter(|one| one.not_on(rig).is_none()).collect()
    }

    /// Why this imperfection is not simulated on the machine of `rig`, if it is not.
    pub fn not_on(&self, rig: &Rig) -> Option<&'static str> {
        if !rig.base().has(&VERIFY, self.key) {
            return Some("is of a rail");
        }
        self.not_with(&rig.actuator, &rig.reality)
    }
}
