//! Gains of the rig `quadruple-paper`, written by `upright design`; do not edit.
//!
//! Every gain is the exact answer of its design problem, rounded once to f32.

use upright::table::{
    GainTable, LawGains, Limits, MotorTest, NoSwingUp, ObserverGains, PerLaw, TABLE_FORMAT, Thresholds,
    columns,
};

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
    // Layout of the table: `TABLE_FORMAT` of the writer.
    format: TABLE_FORMAT,
    // Number of states; equal to `NX` in a sound table.
    states: 10,
    // Number of sensors; equal to `NY` in a sound table.
    sensors: 5,
    // Index of the state that follows the set-point.
    output: 0,
    // Hash of the rig file's values.
    rig_hash: RIG_HASH,
    // Control period (s).
    tick_s: TICK_S,
    // Delay between a measurement and the force computed from it: 0 or 1 (ticks).
    delay_ticks: 0,
    // Largest force on the cart (N).
    force_limit_n: 20.0,
    // Gains of the control laws that are designed, at least one.
    laws: PerLaw {
        // Gains of the linear quadratic regulator, if designed.
        lqr: Some(LawGains {
            // K, one gain per state (N/m, N s/m, N/rad, N s/rad …).
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
            // Gain on the pending force (1); 0 without delay.
            k_pending: 0.0,
            // Gain on the integrated position error (N/(m s)); 0 without integral action.
            k_integral: 0.0,
            // N, the precompensation gain on the set-point (N/m).
            n: 2.2781084,
            // Largest change of the governed set-point in one tick (m).
            setpoint_step: 0.00089194486,
        }),
        // Gains of the pole placement, if designed.
        pole_placement: Some(LawGains {
            // K, one gain per state (N/m, N s/m, N/rad, N s/rad …).
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
            // Gain on the pending force (1); 0 without delay.
            k_pending: 0.0,
            // Gain on the integrated position error (N/(m s)); 0 without integral action.
            k_integral: 0.0,
            // N, the precompensation gain on the set-point (N/m).
            n: 9.243705,
            // Largest change of the governed set-point in one tick (m).
            setpoint_step: 0.002020263,
        }),
    },
    // The observer, if designed: without it the controller needs the whole state.
    observer: Some(ObserverGains {
        // Ad of `x⁺ = Ad x + Bd u` over one tick: a column for each state now, a row for each state a tick later.
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
        // Bd, what one newton held for one tick adds to each state.
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
        // L of `x̂ = x̂⁻ + L e`: a column for each sensor, a row for each state.
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
        // Index of the state that each sensor measures.
        measured: [0, 2, 4, 6, 8],
        // Travel per count of each sensor (m or rad).
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
    // Known Coulomb friction, if there is any: it is compensated.
    friction: None,
    // The motor, if described: without it the controller gives a force.
    motor: None,
    // Limits that the supervisor enforces.
    limits: Limits {
        // Soft limits of the rail, low and high (m).
        rail_m: [-1.9, 1.9],
        // Largest angle of any link from the vertical (rad).
        angle_rad: 0.35,
        // Largest speed of the cart (m/s).
        speed_m_per_s: 2.0,
        // Largest force of the jog (N).
        jog_force_n: 2.0,
        // Least supply voltage of the power stage (V).
        supply_min_v: 0.0,
        // Longest time for which the supply may be too low (ticks).
        supply_ticks: 5,
        // Longest time for which the law may ask for more than the largest force (ticks).
        saturated_ticks: 500,
        // Longest silence of a host that commands the set-point (ticks).
        link_ticks: 100,
        // Largest angle of any link from the vertical at which balancing begins (rad).
        arm_angle_rad: 0.035,
        // Time for which all links have to be upright and slow before balancing begins (ticks).
        arm_ticks: 300,
        // Time for which cart and links have to be still before they are homed (ticks).
        still_ticks: 500,
        // Distance between the limit switches, and its tolerance when homing finds it (counts).
        travel_counts: [200000, 2000],
        // The middle between the limit switches, from position 0 (counts).
        middle_counts: 0,
        // Largest motion of each sensor within `arm_ticks` that is still slow (counts).
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
        // Reading of each sensor while the links hang at rest: half a turn for the first link, else 0 (counts).
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
        // A whole turn of each joint; 0 for the cart (counts).
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
        // Distance that each sensor has to be moved when its sign is checked (counts).
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
    // Thresholds at which the supervisor takes encoders and motor to be at fault.
    thresholds: Thresholds {
        // Largest plausible innovation of each sensor (m or rad).
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
        // Largest predicted motion of each sensor while its counter stands still (m or rad).
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
        // Model and thresholds of the motor test.
        motor: MotorTest {
            // a_pp, a_pv, a_vp, a_vv over one tick, the observer's correction included.
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
            // b_p (m/N), b_v (m/(s N)).
            b: [3.88048e-6, 0.0077619203],
            // Share of the force that may be missing.
            ratio: 0.5,
            // Least sum of p² for a verdict (m²).
            energy: 9.255121e-9,
        },
    },
    // CRC-32 of all values above.
    crc: 0xfe72_841c,
};

/// This table has no swing-up.
pub type SwingUp = NoSwingUp;

/// The swing-up.
pub static SWING_UP: SwingUp = NoSwingUp;
