//! Gains of the rig `quadruple-paper`, written by `upright design`; do not edit.
//!
//! Every value is the exact answer of the design problem, rounded once to f32.

use crate::table::{GainTable, LawGains, TABLE_FORMAT, column};

/// Name of the rig.
pub const RIG: &str = "quadruple-paper";

/// Version of the tool that designed the gains.
pub const TOOL_VERSION: &str = "0.1.0";

/// Hash of the rig file's values.
pub const RIG_HASH: u64 = 0x79a2_f825_e0b2_41d0;

/// Control period (s).
pub const TICK_S: f32 = 0.001;

/// Number of states.
pub const STATES: usize = 10;

/// The gain table.
pub static TABLE: GainTable<STATES> = GainTable {
    format: TABLE_FORMAT,
    states: 10,
    rig_hash: RIG_HASH,
    // s: control period
    tick_s: TICK_S,
    // ticks between a measurement and the force computed from it
    delay_ticks: 0,
    // N: largest force on the cart
    force_limit_n: 20.0,
    // linear quadratic regulator
    lqr: Some(LawGains {
        k: column([
            // N/m: cart position
            2.2781084,
            // N s/m: cart speed
            2.6554902,
            // N/rad: angle of link 1
            -9.160463,
            // N s/rad: angular rate of link 1
            -4.1506615,
            // N/rad: angle of link 2
            -126.060455,
            // N s/rad: angular rate of link 2
            -3.9034085,
            // N/rad: angle of link 3
            393.3646,
            // N s/rad: angular rate of link 3
            1.4876164,
            // N/rad: angle of link 4
            -423.12985,
            // N s/rad: angular rate of link 4
            -18.388689,
        ]),
        // 1: gain on the force still on its way (0 without delay)
        k_pending: 0.0,
        // N/m: precompensation gain on the set-point
        n: 2.2781084,
    }),
    // pole placement
    pole_placement: Some(LawGains {
        k: column([
            // N/m: cart position
            9.243705,
            // N s/m: cart speed
            20.633793,
            // N/rad: angle of link 1
            -171.82307,
            // N s/rad: angular rate of link 1
            -32.6107,
            // N/rad: angle of link 2
            -225.30045,
            // N s/rad: angular rate of link 2
            -31.775797,
            // N/rad: angle of link 3
            135.11073,
            // N s/rad: angular rate of link 3
            -29.605173,
            // N/rad: angle of link 4
            -898.03656,
            // N s/rad: angular rate of link 4
            -46.97237,
        ]),
        // 1: gain on the force still on its way (0 without delay)
        k_pending: 0.0,
        // N/m: precompensation gain on the set-point
        n: 9.243705,
    }),
    // CRC-32 of all values above
    crc: 0xfa27_eb51,
};
