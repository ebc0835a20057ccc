//! Machines with one imperfection alone.

use crate::rig::{IMPERFECTIONS, Imperfection, PerJoint, Reality, Rig, VERIFY};

impl Imperfection {
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
        IMPERFECTIONS.iter().filter(|one| one.not_on(rig).is_none()).collect()
    }

    /// Why this imperfection is not simulated on the machine of `rig`, if it is not.
    pub fn not_on(&self, rig: &Rig) -> Option<&'static str> {
        if !rig.base().has(&VERIFY, self.key) {
            return Some("is of a rail");
        }
        self.not_with(&rig.actuator, &rig.reality)
    }
}
