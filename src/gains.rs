//! Gains of the rig `quadruple-paper`, written by `upright design`; do not edit.
//!
//! Every gain is the exact answer of its design problem, rounded once to f32.

use crate::control::observer::ObserverGains;
use crate::control::state_feedback::LawGains;
use crate::supervision::detection::{MotorTest, Thresholds};
use crate::table::limits::Limits;
use crate::table::{GainTable, TABLE_FORMAT, columns};

/// Name of the rig.
pub const RIG: &str = "quadruple-paper";

/// Version of the tool that designed the gains.
pub const TOOL_VERSION: &str = "0.1.0";

/// Hash of the rig file's values.
pub const RIG_HASH: u64 = 0x7bac_5da7_a6fc_58e1;

/// Control period (s).
pub const TICK_S: f32 = 0.001;

/// Number of states.
pub const STATES: usize = 10;

/// Number of sensors.
pub const SENSORS: usize = 5;

/// The gain table.
pub static TABLE: GainTable<STATES, SENSORS> = GainTable {
    format: TABLE_FORMAT,
    states: 10,
    sensors: 5,
    // index of the state that follows the set-point
    output: 0,
    rig_hash: RIG_HASH,
    // s: control period
    tick_s: TICK_S,
    // ticks between a measurement and the force computed from it
    delay_ticks: 0,
    // N: largest force on the cart
    force_limit_n: 20.0,
    // linear quadratic regulator
    lqr: Some(LawGains {
        k: columns([[
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
        ]]),
        // 1: gain on the force still on its way (0 without delay)
        k_pending: 0.0,
        // N/(m s): gain on the integrated position error (0 without integral action)
        k_integral: 0.0,
        // N/m: precompensation gain on the set-point
        n: 2.2781084,
        // m: largest change of the governed set-point in one tick
        setpoint_step: 0.00089194486,
    }),
    // pole placement
    pole_placement: Some(LawGains {
        k: columns([[
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
        ]]),
        // 1: gain on the force still on its way (0 without delay)
        k_pending: 0.0,
        // N/(m s): gain on the integrated position error (0 without integral action)
        k_integral: 0.0,
        // N/m: precompensation gain on the set-point
        n: 9.243705,
        // m: largest change of the governed set-point in one tick
        setpoint_step: 0.002020263,
    }),
    // steady-state Kalman filter
    observer: Some(ObserverGains {
        // one column per state now, one entry per state a tick later
        ad: columns([
            // from cart position
            [
                // to cart position
                1.0,
                // to cart speed
                0.0,
                // to angle of link 1
                0.0,
                // to angular rate of link 1
                0.0,
                // to angle of link 2
                0.0,
                // to angular rate of link 2
                0.0,
                // to angle of link 3
                0.0,
                // to angular rate of link 3
                0.0,
                // to angle of link 4
                0.0,
                // to angular rate of link 4
                0.0,
            ],
            // from cart speed
            [
                // to cart position
                0.001,
                // to cart speed
                1.0,
                // to angle of link 1
                0.0,
                // to angular rate of link 1
                0.0,
                // to angle of link 2
                0.0,
                // to angular rate of link 2
                0.0,
                // to angle of link 3
                0.0,
                // to angular rate of link 3
                0.0,
                // to angle of link 4
                0.0,
                // to angular rate of link 4
                0.0,
            ],
            // from angle of link 1
            [
                // to cart position
                1.4128755e-5,
                // to cart speed
                0.02826222,
                // to angle of link 1
                1.0008047,
                // to angular rate of link 1
                1.6098243,
                // to angle of link 2
                -0.00096670556,
                // to angular rate of link 2
                -1.9342524,
                // to angle of link 3
                0.00018730195,
                // to angular rate of link 3
                0.3750265,
                // to angle of link 4
                -3.1157782e-5,
                // to angular rate of link 4
                -0.062407725,
            ],
            // from angular rate of link 1
            [
                // to cart position
                4.7092708e-9,
                // to cart speed
                1.4128755e-5,
                // to angle of link 1
                0.0010002682,
                // to angular rate of link 1
                1.0008047,
                // to angle of link 2
                -3.2217912e-7,
                // to angular rate of link 2
                -0.00096670556,
                // to angle of link 3
                6.240582e-8,
                // to angular rate of link 3
                0.00018730195,
                // to angle of link 4
                -1.0379784e-8,
                // to angular rate of link 4
                -3.1157782e-5,
            ],
            // from angle of link 2
            [
                // to cart position
                -2.7692322e-6,
                // to cart speed
                -0.0055440892,
                // to angle of link 1
                -0.0008302946,
                // to angular rate of link 1
                -1.6613266,
                // to angle of link 2
                1.0016885,
                // to angular rate of link 2
                3.3784606,
                // to angle of link 3
                -0.0009920257,
                // to angular rate of link 3
                -1.9849415,
                // to angle of link 4
                0.00016502404,
                // to angular rate of link 4
                0.33031204,
            ],
            // from angular rate of link 2
            [
                // to cart position
                -9.227024e-10,
                // to cart speed
                -2.7692322e-6,
                // to angle of link 1
                -2.7671572e-7,
                // to angular rate of link 1
                -0.0008302946,
                // to angle of link 2
                0.0010005628,
                // to angular rate of link 2
                1.0016885,
                // to angle of link 3
                -3.306159e-7,
                // to angular rate of link 3
                -0.0009920257,
                // to angle of link 4
                5.499042e-8,
                // to angular rate of link 4
                0.00016502404,
            ],
            // from angle of link 3
            [
                // to cart position
                4.7155805e-7,
                // to cart speed
                0.00094447256,
                // to angle of link 1
                0.00014138655,
                // to angular rate of link 1
                0.28301826,
                // to angle of link 2
                -0.00060065096,
                // to angular rate of link 2
                -1.2018601,
                // to angle of link 3
                1.0008175,
                // to angular rate of link 3
                1.6355397,
                // to angle of link 4
                -0.00044188582,
                // to angular rate of link 4
                -0.8839706,
            ],
            // from angular rate of link 3
            [
                // to cart position
                1.570956e-10,
                // to cart speed
                4.7155805e-7,
                // to angle of link 1
                4.7112508e-8,
                // to angular rate of link 1
                0.00014138655,
                // to angle of link 2
                -2.001798e-7,
                // to angular rate of link 2
                -0.00060065096,
                // to angle of link 3
                0.0010002725,
                // to angular rate of link 3
                1.0008175,
                // to angle of link 4
                -1.4728201e-7,
                // to angular rate of link 4
                -0.00044188582,
            ],
            // from angle of link 4
            [
                // to cart position
                -5.8953347e-8,
                // to cart speed
                -0.00011809344,
                // to angle of link 1
                -1.7675895e-5,
                // to angular rate of link 1
                -0.035387587,
                // to angle of link 2
                7.509232e-5,
                // to angular rate of link 2
                0.1502763,
                // to angle of link 3
                -0.00018104115,
                // to angular rate of link 3
                -0.3621756,
                // to angle of link 4
                1.0002996,
                // to angular rate of link 4
                0.5993166,
            ],
            // from angular rate of link 4
            [
                // to cart position
                -1.9638667e-11,
                // to cart speed
                -5.8953347e-8,
                // to angle of link 1
                -5.8895786e-9,
                // to angular rate of link 1
                -1.7675895e-5,
                // to angle of link 2
                2.5024663e-8,
                // to angular rate of link 2
                7.509232e-5,
                // to angle of link 3
                -6.034083e-8,
                // to angular rate of link 3
                -0.00018104115,
                // to angle of link 4
                0.0010000998,
                // to angular rate of link 4
                1.0002996,
            ],
        ]),
        // per newton held for one tick
        bd: columns([[
            // to cart position
            3.88048e-6,
            // to cart speed
            0.0077619203,
            // to angle of link 1
            0.00016405016,
            // to angular rate of link 1
            0.32820067,
            // to angle of link 2
            -0.00019708574,
            // to angular rate of link 2
            -0.394343,
            // to angle of link 3
            3.8185924e-5,
            // to angular rate of link 3
            0.076458,
            // to angle of link 4
            -6.3522493e-6,
            // to angular rate of link 4
            -0.012723288,
        ]]),
        // one column per sensor: what an innovation adds to each state
        l: columns([
            // from the sensor of cart position
            [
                // to cart position
                0.331619,
                // to cart speed
                83.491486,
                // to angle of link 1
                8.318105,
                // to angular rate of link 1
                3026.575,
                // to angle of link 2
                -6.682098,
                // to angular rate of link 2
                -3180.2903,
                // to angle of link 3
                -1.4950343,
                // to angular rate of link 3
                135.5937,
                // to angle of link 4
                0.0020083564,
                // to angular rate of link 4
                20.28479,
            ],
            // from the sensor of angle of link 1
            [
                // to cart position
                0.0014139842,
                // to cart speed
                0.51311487,
                // to angle of link 1
                0.11710298,
                // to angular rate of link 1
                26.379013,
                // to angle of link 2
                -0.1221828,
                // to angular rate of link 2
                -34.074883,
                // to angle of link 3
                0.011200503,
                // to angular rate of link 3
                8.445939,
                // to angle of link 4
                0.0031852596,
                // to angular rate of link 4
                -0.83744204,
            ],
            // from the sensor of angle of link 2
            [
                // to cart position
                -0.0011358814,
                // to cart speed
                -0.5343166,
                // to angle of link 1
                -0.1221828,
                // to angular rate of link 1
                -33.923145,
                // to angle of link 2
                0.22384317,
                // to angular rate of link 2
                52.212807,
                // to angle of link 3
                -0.09525836,
                // to angular rate of link 3
                -22.485628,
                // to angle of link 4
                0.007694748,
                // to angular rate of link 4
                5.1412654,
            ],
            // from the sensor of angle of link 3
            [
                // to cart position
                -0.00025413898,
                // to cart speed
                0.019720752,
                // to angle of link 1
                0.011200503,
                // to angular rate of link 1
                8.207529,
                // to angle of link 2
                -0.09525836,
                // to angular rate of link 2
                -22.10352,
                // to angle of link 3
                0.15265201,
                // to angular rate of link 3
                21.2384,
                // to angle of link 4
                -0.058351077,
                // to angular rate of link 4
                -9.82073,
            ],
            // from the sensor of angle of link 4
            [
                // to cart position
                3.4139796e-7,
                // to cart speed
                0.0034464304,
                // to angle of link 1
                0.0031852596,
                // to angular rate of link 1
                -0.80105,
                // to angle of link 2
                0.007694748,
                // to angular rate of link 2
                4.998352,
                // to angle of link 3
                -0.058351077,
                // to angular rate of link 3
                -9.568677,
                // to angle of link 4
                0.12238921,
                // to angular rate of link 4
                10.166408,
            ],
        ]),
        // index of the state that each sensor measures
        measured: [0, 2, 4, 6, 8],
        // m or rad per count
        step: columns([[
            // sensor of cart position
            2e-5,
            // sensor of angle of link 1
            0.0015339808,
            // sensor of angle of link 2
            0.0015339808,
            // sensor of angle of link 3
            0.0015339808,
            // sensor of angle of link 4
            0.0015339808,
        ]]),
    }),
    // motor, gear and pulley
    motor: None,
    // what the supervisor enforces
    limits: Limits {
        // m: soft limits of the rail
        rail_m: [-1.9, 1.9],
        // rad: largest angle of a link from the vertical
        angle_rad: 0.35,
        // m/s: largest speed of the cart
        speed_m_per_s: 2.0,
        // V: least supply
        supply_min_v: 0.0,
        // ticks: the supply may be too low for so long
        supply_ticks: 5,
        // ticks: the force may be at its limit for so long
        saturated_ticks: 500,
        // ticks: the host may be silent for so long
        link_ticks: 100,
        // rad: largest angle to begin at
        arm_angle_rad: 0.035,
        // ticks: upright and slow before it begins
        arm_ticks: 300,
        // ticks: still before homing
        still_ticks: 500,
        // counts: between the limit switches, and its tolerance
        travel_counts: [200000, 2000],
        // counts: middle of the rail
        middle_counts: 0,
        // counts: most motion that is slow
        slow_counts: [
            // cart position
            750,
            // angle of link 1
            20,
            // angle of link 2
            20,
            // angle of link 3
            20,
            // angle of link 4
            20,
        ],
        // counts: links hanging at rest
        rest_counts: [
            // cart position
            0,
            // angle of link 1
            2048,
            // angle of link 2
            0,
            // angle of link 3
            0,
            // angle of link 4
            0,
        ],
        // counts: a whole turn
        turn_counts: [
            // cart position
            0,
            // angle of link 1
            4096,
            // angle of link 2
            4096,
            // angle of link 3
            4096,
            // angle of link 4
            4096,
        ],
        // counts: motion that shows the sign
        sign_counts: [
            // cart position
            10000,
            // angle of link 1
            130,
            // angle of link 2
            130,
            // angle of link 3
            130,
            // angle of link 4
            130,
        ],
    },
    // when encoders and motor are at fault
    thresholds: Thresholds {
        // m or rad: largest innovation
        innovation: [
            // cart position
            5.810177e-5,
            // angle of link 1
            0.003990035,
            // angle of link 2
            0.0042185974,
            // angle of link 3
            0.004008325,
            // angle of link 4
            0.0039284667,
        ],
        // m or rad: most predicted motion while the counter stands still
        frozen: [
            // cart position
            0.00010278882,
            // angle of link 1
            0.0052355444,
            // angle of link 2
            0.0066623194,
            // angle of link 3
            0.0053651608,
            // angle of link 4
            0.0047674673,
        ],
        motor: MotorTest {
            // error of the prediction, a tick later
            a: [
                // position from position
                0.58488953,
                // position from speed
                0.001,
                // speed from position
                -83.491486,
                // speed from speed
                1.0,
            ],
            // of a missing newton
            b: [
                // m/N: position
                3.88048e-6,
                // m/(s N): speed
                0.0077619203,
            ],
            // 1: share of the force that may be missing
            ratio: 0.5,
            // m²: least for a verdict
            energy: 9.255121e-9,
        },
    },
    // CRC-32 of all values above
    crc: 0xdde3_c537,
};
