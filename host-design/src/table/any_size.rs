//! From a number of states known at run time to the firmware's types, which have it in the type.

/// The largest number of states a gain table can hold.
pub const MAX_STATES: usize = 32;

/// Something to be done with a number of states in the type.
pub trait WithStates {
    /// What comes out.
    type Output;

    /// Does it.
    fn run<const NX: usize>(self) -> Self::Output;
}

/// Runs `action` with `NX = states`; none unless there are 1 to [`MAX_STATES`] states.
pub fn with_states<A: WithStates>(states: usize, action: A) -> Option<A::Output> {
    macro_rules! dispatch {
        ($($n:literal)*) => {
            match states {
                $($n => Some(action.run::<$n>()),)*
                _ => None,
            }
        };
    }
    dispatch!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
}
