// Gains of the rig `quadruple-paper`, written by `upright design`; do not edit.
//
// Every gain is the exact answer of its design problem, rounded once to f32.
//
// - states: cart position (m), cart speed (m/s), angle of link 1 (rad), angular rate of link 1 (rad/s), angle of link 2 (rad), angular rate of link 2 (rad/s), angle of link 3 (rad), angular rate of link 3 (rad/s), angle of link 4 (rad), angular rate of link 4 (rad/s)
// - sensors: cart position (m), angle of link 1 (rad), angle of link 2 (rad), angle of link 3 (rad), angle of link 4 (rad)

use upright::table::*;

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
#[rustfmt::skip]
pub static TABLE: GainTable<STATES, SENSORS> = GainTable {
    // Layout of the table: `TABLE_FORMAT` of the writer.
    format: upright::table_format!(18),
    // Numbers of states and sensors; equal to `NX` and `NY` in a sound table.
    dimensions: [10, 5],
    // Index of the state that follows the set-point.
    output: 0,
    // Hash of the rig file's values.
    rig_hash: RIG_HASH,
    // Control period (s).
    tick_s: TICK_S,
    // The sensors; the first one is the cart's.
    sensors: [
        // - state: Index of the state that it measures.
        // - kind: How it reads.
        // - step: Travel per count (m or rad).
        // - delay_s: Age of a reading (s): it shows the state as it was, less the next state, the rate, by this time.
        // - turn_counts: A whole turn of the joint; 0 for the cart (counts).
        // - rest_counts: Position while the links hang at rest: half a turn for the first link, else 0 (counts).
        // - sign_counts: Distance that it has to be moved when its sign is checked (counts).
        // - slow_counts: Largest motion within `arm_ticks` that is still slow (counts).
        // - still_counts: Largest motion within `still_ticks` that noise or the edge of a step show (counts).
        SensorRow { state: 0, kind: SensorKind::Counter, step: 2e-5, delay_s: 0.0, turn_counts: 0, rest_counts: 0, sign_counts: 10000, slow_counts: 750, still_counts: 1 },
        SensorRow { state: 2, kind: SensorKind::Counter, step: 0.0015339808, delay_s: 0.0, turn_counts: 4096, rest_counts: 2048, sign_counts: 130, slow_counts: 20, still_counts: 1 },
        SensorRow { state: 4, kind: SensorKind::Counter, step: 0.0015339808, delay_s: 0.0, turn_counts: 4096, rest_counts: 0, sign_counts: 130, slow_counts: 20, still_counts: 1 },
        SensorRow { state: 6, kind: SensorKind::Counter, step: 0.0015339808, delay_s: 0.0, turn_counts: 4096, rest_counts: 0, sign_counts: 130, slow_counts: 20, still_counts: 1 },
        SensorRow { state: 8, kind: SensorKind::Counter, step: 0.0015339808, delay_s: 0.0, turn_counts: 4096, rest_counts: 0, sign_counts: 130, slow_counts: 20, still_counts: 1 },
    ],
    // The drive of the cart.
    drive: DriveMap::Force(ForceMap {
        // Largest force on the cart (N).
        limit_n: 20.0,
        // What a delay or a lag leaves of it for later.
        late: Late {
            // Share of the pending force in the mean force of a tick: 0 for a force that acts at once, 1 if it acts a tick
            // later, `τ/T (1 - e^(-T/τ))` if it follows with the lag τ, and up to 1.2 with both.
            acts: 0.0,
            // Share of the pending force that is still pending after a tick: `e^(-T/τ)` with the lag τ, 0 without.
            stays: 0.0,
        },
    }),
    // Gains of the control laws that are designed, at least one.
    laws: PerLaw {
        // Gains of the linear quadratic regulator, if designed.
        lqr: Some(LawGains {
            // K, one gain per state (N/m, N s/m, N/rad, N s/rad …).
            k: columns([[2.2781084, 2.6554902, -9.160463, -4.1506615, -126.060455, -3.9034085, 393.3646, 1.4876164, -423.12985, -18.388689]]),
            // Gain on the pending force (1); 0 without delay or lag.
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
            k: columns([[9.243705, 20.633793, -171.82307, -32.6107, -225.30045, -31.775797, 135.11073, -29.605173, -898.03656, -46.97237]]),
            // Gain on the pending force (1); 0 without delay or lag.
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
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.001, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1.4128755e-5, 0.02826222, 1.0008047, 1.6098243, -0.00096670556, -1.9342524, 0.00018730195, 0.3750265, -3.1157782e-5, -0.062407725],
            [4.7092708e-9, 1.4128755e-5, 0.0010002682, 1.0008047, -3.2217912e-7, -0.00096670556, 6.240582e-8, 0.00018730195, -1.0379784e-8, -3.1157782e-5],
            [-2.7692322e-6, -0.0055440892, -0.0008302946, -1.6613266, 1.0016885, 3.3784606, -0.0009920257, -1.9849415, 0.00016502404, 0.33031204],
            [-9.227024e-10, -2.7692322e-6, -2.7671572e-7, -0.0008302946, 0.0010005628, 1.0016885, -3.306159e-7, -0.0009920257, 5.499042e-8, 0.00016502404],
            [4.7155805e-7, 0.00094447256, 0.00014138655, 0.28301826, -0.00060065096, -1.2018601, 1.0008175, 1.6355397, -0.00044188582, -0.8839706],
            [1.570956e-10, 4.7155805e-7, 4.7112508e-8, 0.00014138655, -2.001798e-7, -0.00060065096, 0.0010002725, 1.0008175, -1.4728201e-7, -0.00044188582],
            [-5.8953347e-8, -0.00011809344, -1.7675895e-5, -0.035387587, 7.509232e-5, 0.1502763, -0.00018104115, -0.3621756, 1.0002996, 0.5993166],
            [-1.9638667e-11, -5.8953347e-8, -5.8895786e-9, -1.7675895e-5, 2.5024663e-8, 7.509232e-5, -6.034083e-8, -0.00018104115, 0.0010000998, 1.0002996],
        ]),
        // Bd, what one newton held for one tick adds to each state.
        bd: columns([[3.88048e-6, 0.0077619203, 0.00016405016, 0.32820067, -0.00019708574, -0.394343, 3.8185924e-5, 0.076458, -6.3522493e-6, -0.012723288]]),
        // L of `x̂ = x̂⁻ + L e`: a column for each sensor, a row for each state.
        l: columns([
            [0.331619, 83.491486, 8.318105, 3026.575, -6.682098, -3180.2903, -1.4950343, 135.5937, 0.0020083564, 20.28479],
            [0.0014139842, 0.51311487, 0.11710298, 26.379013, -0.1221828, -34.074883, 0.011200503, 8.445939, 0.0031852596, -0.83744204],
            [-0.0011358814, -0.5343166, -0.1221828, -33.923145, 0.22384317, 52.212807, -0.09525836, -22.485628, 0.007694748, 5.1412654],
            [-0.00025413898, 0.019720752, 0.011200503, 8.207529, -0.09525836, -22.10352, 0.15265201, 21.2384, -0.058351077, -9.82073],
            [3.4139796e-7, 0.0034464304, 0.0031852596, -0.80105, 0.007694748, 4.998352, -0.058351077, -9.568677, 0.12238921, 10.166408],
        ]),
    }),
    // Known Coulomb friction, if there is any: it is compensated.
    friction: None,
    // Limits that the supervisor enforces.
    limits: Limits {
        // Soft limits of the rail, low and high (m).
        rail_m: [-1.9, 1.9],
        // Largest angle of any link from the vertical (rad).
        angle_rad: 0.35,
        // Largest speed of the cart (m/s).
        speed_m_per_s: 2.0,
        // Largest force of the jog (N). For a drive with pulses, an acceleration (m/s²) that moves the links while
        // the rig is shaken.
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
    },
    // Thresholds at which the supervisor takes encoders and motor to be at fault.
    thresholds: Thresholds {
        // Largest plausible innovation of each sensor (m or rad).
        innovation: [0.000106374544, 0.010815588, 0.010789008, 0.009300967, 0.0072794915],
        // Largest predicted motion of each sensor while its counter stands still (m or rad).
        frozen: [0.00024372195, 0.013117851, 0.017170524, 0.010777798, 0.007815738],
        // Largest innovation of each sensor under a push that the rig survives (m or rad); [`f32::MAX`] where pushes
        // are not told from defects.
        push: [0.0011392274, 0.04845784, 0.05212735, 0.015855925, 0.009861585],
        // Model and thresholds of the motor test.
        motor: MotorTest {
            // a_pp, a_pv, a_vp, a_vv over one tick, the observer's correction included.
            a: [0.58488953, 0.001, -83.491486, 1.0],
            // b_p (m/N), b_v (m/(s N)).
            b: [3.88048e-6, 0.0077619203],
            // Share of the force that may be missing.
            ratio: 0.5,
            // Least sum of p² for a verdict (m²).
            energy: 1.2662925e-7,
        },
    },
    // How the motor stills the links; none for a `[model]`, and where no sensor measures that they hang.
    stilling: Some(StillingGains {
        // Longest time for which the links are stilled after a fall (ticks); 0: the motor goes off instead.
        after_fall_ticks: 0,
        // Stiffness of the spring that pulls the base to the middle (N/m).
        stiffness: 12.1699705,
        // Constant of the damper on the base (N s/m).
        damping: 3.450251,
        // Largest forces of spring and damper (N).
        most_n: [12.0, 8.0],
        // Dry friction of the base that the motor makes up for (N).
        friction_n: 0.0,
        // The lighter base that the motor imitates; none: it is only spring and damper.
        imitated: Some(ImitatedBase {
            // Mass that the motor takes away (kg), and viscous friction (N s/m); 0 for a drive that imposes the base's
            // acceleration.
            taken: [0.085, 0.0],
            // The links on this base. One link more than there are, of inertia 1 and without weight, is at rest.
            model: ChainModel {
                // 1 / M_t, M_t the mass of cart and links together (1/kg).
                inverse_mass: 2.4096386,
                // a_j = Σ_i m_i r_i h_ij, with r_i = 1 on a cart and the radius of link i on an arm (kg m).
                a: columns([[0.0105, 0.01, 0.0105, 0.005, 0.0]]),
                // g Σ_i m_i h_ij (N m).
                weight: columns([[0.103005, 0.0981, 0.103005, 0.04905, 0.0]]),
                // b_jk = Σ_i m_i h_ij h_ik + δ_jk I_j, symmetric (kg m²).
                b: columns([
                    [0.0003, 0.0003, 0.000315, 0.00015, 0.0],
                    [0.0003, 0.00037333334, 0.00042, 0.0002, 0.0],
                    [0.000315, 0.00042, 0.0006533333, 0.00035, 0.0],
                    [0.00015, 0.0002, 0.00035, 0.00033333333, 0.0],
                    [0.0, 0.0, 0.0, 0.0, 1.0],
                ]),
                // b_jk - a_j a_k / M_t, symmetric (kg m²).
                b_reduced: columns([
                    [3.433735e-5, 4.6987952e-5, 4.9337348e-5, 2.3493976e-5, 0.0],
                    [4.6987952e-5, 0.00013236947, 0.00016698796, 7.9518075e-5, 0.0],
                    [4.9337348e-5, 0.00016698796, 0.00038767068, 0.00022349397, 0.0],
                    [2.3493976e-5, 7.9518075e-5, 0.00022349397, 0.00027309236, 0.0],
                    [0.0, 0.0, 0.0, 0.0, 1.0],
                ]),
                // What the links' accelerations add to the cart's equation: a_j, or 0 where the drive imposes the cart's
                // acceleration (kg m).
                reaction: columns([[0.0105, 0.01, 0.0105, 0.005, 0.0]]),
                // d_0, viscous friction of the cart (N s/m).
                cart_friction: 0.0,
                // d_i, viscous friction of each joint on its relative rate (N m s/rad).
                joint_frictions: columns([[0.0, 0.0, 0.0, 0.0, 0.0]]),
                // What the turning of an arm adds; none on a cart.
                turning: None,
            },
        }),
        // Deceleration of the base by the motor's largest force that is counted on near an end of the rail (m/s²).
        braking_m_per_s2: 26.666666,
        // Largest speed of the base (m/s): no stilling from the energy that it is for is faster.
        speed_m_per_s: 13.724139,
        // Lowest and highest position of the base (m).
        rail_m: [-1.975, 1.975],
    }),
    // CRC-32 of all values above.
    crc: 0xaebd_86fb,
};

/// This table has no swing-up.
pub type SwingUp = NoSwingUp;

/// The swing-up.
pub static SWING_UP: SwingUp = NoSwingUp;
