//! Bad rig files: for each, the place and key that the message must name, and its exit code.

use std::path::{Path, PathBuf};

use upright_design::rig::{MAX_BYTES, Rig, RigError, RigErrorKind};

/// A rig with every table, one key per line, so that a case changes one line.
const GOOD: &str = r#"name = "bench"
[cart]
mass_kg = 1.0
friction_n_s_per_m = 2
travel_m = [-0.4, 0.4]
encoder_step_m = 2e-5
[[link]]
mass_kg = 0.2
length_m = 0.3
encoder_counts_per_rev = 4096
[[link]]
mass_kg = 0.1
length_m = 0.4
centre_of_mass_m = 0.2
inertia_kg_m2 = 0
friction_n_m_s_per_rad = 0.001
encoder_step_rad = 0.001
[gravity]
m_per_s2 = 9.81
[actuator]
force_limit_n = 10
torque_constant_n_m_per_a = 0.01
resistance_ohm = 2
gear_ratio = 4
pulley_radius_m = 0.01
supply_v = 12
dead_zone_v = 0.5
slew_v_per_s = 1000
[tick]
period_s = 0.001
delay_ticks = 1
[lqr]
state_weights = [1, 1, 1, 1, 1, 1]
force_weight = 0.1
[pole_placement]
overshoot_percent = 5
settling_time_s = 2
far_poles = [-10, -11, -12, -13]
[kalman]
force_noise_n2_s = 1e-5
joint_noise = [1e-9, 1e-9]
[integral]
position_weight = 1
[limits]
angle_rad = 0.3
speed_m_per_s = 2
"#;

/// A plant given by its matrices, one key per line.
const MODEL: &str = r#"name = "model"
[model]
a = [[0, 1], [2, 0]]
b = [0, 1]
output = 0
measured = [0, 1]
measured_steps = [1e-3, 1e-3]
noise_input = [[0, 1], [1, 0]]
[pole_placement]
poles = [[-1, 2], [-1, -2]]
[kalman]
force_noise_n2_s = 1
joint_noise = [1]
"#;

/// (file, line to replace, replacement, place, key, words of the message, exit code)
type Case =
    (&'static str, &'static str, &'static str, &'static str, &'static str, &'static [&'static str], u8);

#[rustfmt::skip]
const CASES: &[Case] = &[
    // Not TOML
    (GOOD, "mass_kg = 1.0", "mass_kg = ", "3:", "mass_kg", &["not TOML"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg 1.0", "3:", "", &["not TOML"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 1.0 kg", "3:", "mass_kg", &["not TOML"], 2),
    (GOOD, "[gravity]", "[gravity", "18:", "", &["not TOML"], 2),
    (GOOD, "[gravity]", "[]", "18:", "", &["not TOML"], 2),
    // Keys and tables
    (GOOD, "mass_kg = 1.0", "mass_kg = 1.0\nmass_kg = 2.0", "4:1", "mass_kg", &["given twice"], 2),
    (GOOD, "[gravity]", "[cart]", "18:", "cart", &["given twice"], 2),
    (GOOD, "mass_kg = 1.0", "mas_kg = 1.0", "3:1", "cart.mas_kg", &["unknown", "did you mean `mass_kg`?"], 2),
    ("name = \"x\"\n[cart]\nmas_kg = 1\n", "", "", "3:1", "cart.mas_kg", &["did you mean `mass_kg`?"], 2),
    (GOOD, "mass_kg = 0.1", "mass = 0.1", "12:1", "link[2].mass", &["did you mean `mass_kg`?"], 2),
    (GOOD, "[limits]", "[limit]", "44:", "limit", &["did you mean `limits`?"], 2),
    (GOOD, "[limits]", "[gains]", "44:", "gains", &["unknown", "accepted here: name, cart"], 2),
    (GOOD, "period_s = 0.001", "period_s.value = 0.001", "30:", "tick.period_s", &["a table", "accepted: a number"], 2),
    (GOOD, "mass_kg = 1.0", "", "2:1", "cart.mass_kg", &["missing", "in kg"], 2),
    (GOOD, "name = \"bench\"", "", "1:1", "name", &["missing", "at the top"], 2),
    (GOOD, "length_m = 0.4", "", "11:1", "link[2].length_m", &["missing"], 2),
    (GOOD, "force_weight = 0.1", "", "32:1", "lqr.force_weight", &["missing"], 2),
    (GOOD, "joint_noise = [1e-9, 1e-9]", "", "39:1", "kalman.joint_noise", &["missing"], 2),
    (GOOD, "supply_v = 12", "", "20:1", "actuator.supply_v", &["missing", "in V"], 2),
    (GOOD, "encoder_step_m = 2e-5", "", "2:1", "cart.encoder_step_m", &["missing", "[kalman] needs it"], 2),
    // Types
    (GOOD, "mass_kg = 1.0", "mass_kg = \"heavy\"", "3:11", "cart.mass_kg", &["\"heavy\" (string)", "a number > 0"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = true", "3:11", "cart.mass_kg", &["true (boolean)"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 2026-01-01", "3:11", "cart.mass_kg", &["datetime"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = [1.0]", "3:11", "cart.mass_kg", &["[1.0] (array)"], 2),
    (GOOD, "name = \"bench\"", "name = 7", "1:8", "name", &["7 (integer)", "printable text"], 2),
    (GOOD, "[gravity]", "[[gravity]]", "18:", "gravity", &["a list of tables", "write it as [gravity]"], 2),
    (GOOD, "delay_ticks = 1", "delay_ticks = 1.0", "31:15", "tick.delay_ticks", &["1.0 (float)", "0 or 1"], 2),
    (GOOD, "travel_m = [-0.4, 0.4]", "travel_m = 0.8", "5:12", "cart.travel_m", &["a list of 2 numbers"], 2),
    // Names
    (GOOD, "name = \"bench\"", "name = \"\"", "1:8", "name", &["1 to 64 bytes"], 2),
    (GOOD, "name = \"bench\"", "name = \"a\\u001b[2Jb\"", "1:8", "name", &["printable"], 2),
    (GOOD, "name = \"bench\"", "name = \"0123456789012345678901234567890123456789012345678901234567890123456789\"",
        "1:8", "name", &["1 to 64 bytes"], 2),
    // Numbers that are not finite or out of range
    (GOOD, "mass_kg = 1.0", "mass_kg = nan", "3:11", "cart.mass_kg", &["found nan", "a finite number"], 2),
    (GOOD, "friction_n_s_per_m = 2", "friction_n_s_per_m = -inf", "4:22", "cart.friction_n_s_per_m", &["-inf", "finite"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 1e400", "3:11", "mass_kg", &["not TOML", "overflow"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 1e16", "3:11", "cart.mass_kg", &["1e16", "1e-30 to 1e15"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 1e-300", "3:11", "cart.mass_kg", &["1e-300", "1e-30 to 1e15"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 99999999999999999999999", "3:11", "mass_kg", &["not TOML"], 2),
    // Physics
    (GOOD, "mass_kg = 1.0", "mass_kg = -1.0", "3:11", "cart.mass_kg", &["found -1.0", "a number > 0"], 2),
    (GOOD, "mass_kg = 1.0", "mass_kg = 0", "3:11", "cart.mass_kg", &["found 0", "a number > 0"], 2),
    (GOOD, "length_m = 0.3", "length_m = 0", "9:12", "link[1].length_m", &["found 0", "a number > 0"], 2),
    (GOOD, "centre_of_mass_m = 0.2", "centre_of_mass_m = -0.2", "14:20", "link[2].centre_of_mass_m", &["a number > 0"], 2),
    (GOOD, "centre_of_mass_m = 0.2", "centre_of_mass_m = 4.1", "14:20", "link[2].centre_of_mass_m", &["10 times length_m, 4"], 2),
    (GOOD, "inertia_kg_m2 = 0", "inertia_kg_m2 = -1e-9", "15:17", "link[2].inertia_kg_m2", &["a number >= 0"], 2),
    (GOOD, "friction_n_m_s_per_rad = 0.001", "friction_n_m_s_per_rad = -1", "16:26",
        "link[2].friction_n_m_s_per_rad", &["a number >= 0"], 2),
    (GOOD, "travel_m = [-0.4, 0.4]", "travel_m = [0.4, -0.4]", "5:12", "cart.travel_m", &["[a number < 0, a number > 0]"], 2),
    (GOOD, "travel_m = [-0.4, 0.4]", "travel_m = [-1, 0, 1]", "5:12", "cart.travel_m", &["found a list of 3", "accepted: 2"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 0", "6:18", "cart.encoder_step_m", &["a number > 0"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 2e-5\nsensor_bits = 19", "7:15", "cart.sensor_bits",
        &["found 19", "a whole number from 10 to 18"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 2e-5\nsensor_bits = 14\nsensor_noise_m = 0.01", "8:18",
        "cart.sensor_noise_m", &["found 0.01", "a number from 0 to 0.005 (m)"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 2e-5\nsensor_noise_m = 1e-5", "2:1", "cart.sensor_bits", &["missing"], 2),
    (GOOD, "encoder_step_m = 2e-5", "sensor_bits = 14", "2:1", "cart.encoder_step_m", &["missing", "the travel per count"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 2e-7\nsensor_bits = 12", "6:18", "cart.encoder_step_m",
        &["less than half a turn in a tick", "use a larger pulley"], 2),
    (GOOD, "encoder_step_m = 2e-5", "encoder_step_m = 2e-5\nsensor_bits = 12\nsensor_travel_rad = 5.9", "8:1",
        "cart.sensor_travel_rad", &["unknown", "sensor_bits"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "encoder_counts_per_rev = 1", "10:26",
        "link[1].encoder_counts_per_rev", &["a number >= 2"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "encoder_counts_per_rev = 4096\nencoder_step_rad = 0.001", "10:26",
        "link[1].encoder_counts_per_rev", &["given together with link[1].encoder_step_rad"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "encoder_counts_per_rev = 4096\nsensor_bits = 14", "11:15",
        "link[1].sensor_bits", &["given together with link[1].encoder_counts_per_rev", "that the board reads"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 19", "10:15", "link[1].sensor_bits",
        &["found 19", "a whole number from 10 to 18"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 14.5", "10:15", "link[1].sensor_bits", &["found 14.5"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_zero_counts = 4096", "11:22",
        "link[1].sensor_zero_counts", &["found 4096", "a whole number from 0 to 4095", "while the links hang"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_zero_counts = -1", "11:22",
        "link[1].sensor_zero_counts", &["found -1", "a whole number from 0"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_noise_rad = -1e-4", "11:20",
        "link[1].sensor_noise_rad", &["a number from 0 to 0.005 (rad)"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_noise_rad = 0.4", "11:20",
        "link[1].sensor_noise_rad", &["found 0.4", "a number from 0 to 0.005 (rad)"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_travel_rad = 5.9\nsensor_zero_counts = 2100",
        "12:22", "link[1].sensor_zero_counts", &["found 2100", "from 203 to 1710 or from 2385 to 3892", "turn the potentiometer"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_travel_rad = 5.9", "7:1",
        "link[1].sensor_zero_counts", &["missing"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_bits = 12\nsensor_travel_rad = 6.283", "11:21",
        "link[1].sensor_travel_rad", &["a number from 3.7 to 6.2 (rad)"], 2),
    (GOOD, "encoder_counts_per_rev = 4096", "sensor_noise_rad = 4e-4", "7:1", "link[1].sensor_bits", &["missing"], 2),
    (GOOD, "m_per_s2 = 9.81", "m_per_s2 = -9.81", "19:12", "gravity.m_per_s2", &["a number > 0"], 2),
    (GOOD, "force_limit_n = 10", "force_limit_n = 0", "21:17", "actuator.force_limit_n", &["a number > 0"], 2),
    (GOOD, "dead_zone_v = 0.5", "dead_zone_v = 12", "27:15", "actuator.dead_zone_v", &["< supply_v"], 2),
    (GOOD, "period_s = 0.001", "period_s = 1e-7", "30:12", "tick.period_s", &["1e-6 to 10"], 2),
    (GOOD, "period_s = 0.001", "period_s = 11", "30:12", "tick.period_s", &["1e-6 to 10"], 2),
    (GOOD, "delay_ticks = 1", "delay_ticks = 2", "31:15", "tick.delay_ticks", &["found 2", "0 or 1"], 2),
    (GOOD, "delay_ticks = 1", "delay_ticks = -1", "31:15", "tick.delay_ticks", &["0 or 1"], 2),
    (GOOD, "angle_rad = 0.3", "angle_rad = 17", "45:13", "limits.angle_rad", &["pi (rad)"], 2),
    (GOOD, "speed_m_per_s = 2", "speed_m_per_s = 0", "46:17", "limits.speed_m_per_s", &["a number > 0"], 2),
    (GOOD, "speed_m_per_s = 2", "rail_margin_m = -0.1", "46:17", "limits.rail_margin_m", &["a number >= 0"], 2),
    (GOOD, "speed_m_per_s = 2", "rail_margin_m = 2", "46:17", "limits.rail_margin_m", &["free"], 2),
    (GOOD, "speed_m_per_s = 2", "travel_tolerance_m = 0", "46:22", "limits.travel_tolerance_m", &["a number > 0"], 2),
    (GOOD, "speed_m_per_s = 2", "supply_min_v = -1", "46:16", "limits.supply_min_v", &["a number >= 0"], 2),
    (GOOD, "speed_m_per_s = 2", "supply_time_s = 61", "46:17", "limits.supply_time_s", &["<= 60 (s)"], 2),
    (GOOD, "speed_m_per_s = 2", "saturation_time_s = 0", "46:21", "limits.saturation_time_s", &["<= 60 (s)"], 2),
    (GOOD, "speed_m_per_s = 2", "link_timeout_s = -1", "46:18", "limits.link_timeout_s", &["<= 60 (s)"], 2),
    (GOOD, "speed_m_per_s = 2", "arm_angle_rad = 4", "46:17", "limits.arm_angle_rad", &["pi (rad)"], 2),
    (GOOD, "speed_m_per_s = 2", "arm_rate_rad_per_s = 0", "46:22", "limits.arm_rate_rad_per_s", &["a number > 0"], 2),
    (GOOD, "speed_m_per_s = 2", "arm_speed_m_per_s = 0", "46:21", "limits.arm_speed_m_per_s", &["a number > 0"], 2),
    (GOOD, "speed_m_per_s = 2", "arm_time_s = 0", "46:14", "limits.arm_time_s", &["<= 60 (s)"], 2),
    (GOOD, "speed_m_per_s = 2", "still_time_s = 100", "46:16", "limits.still_time_s", &["<= 60 (s)"], 2),
    (GOOD, "speed_m_per_s = 2", "false_alarm_h = 0.5", "46:17", "limits.false_alarm_h", &["1 to 1e9 (h)"], 2),
    // Design
    (GOOD, "state_weights = [1, 1, 1, 1, 1, 1]", "state_weights = [1, 1, 1, 1]", "33:17", "lqr.state_weights",
        &["found a list of 4", "accepted: 6", "one weight per state"], 2),
    (GOOD, "state_weights = [1, 1, 1, 1, 1, 1]", "state_weights = [1, 1, 1, -1, 1, 1]", "33:27", "lqr.state_weights[4]",
        &["found -1", "a number >= 0"], 2),
    (GOOD, "state_weights = [1, 1, 1, 1, 1, 1]", "state_weights = [[1, 0], [0, 1]]", "33:17", "lqr.state_weights",
        &["found a list of 2", "accepted: 6"], 2),
    (MODEL, "noise_input = [[0, 1], [1, 0]]", "noise_input = [[0, 1], [1, 0]]\n[lqr]\nforce_weight = 1\nstate_weights = [[1, 2], [3, 4]]", "11:26",
        "lqr.state_weights[2]", &["a symmetric matrix, here 2 in column 1"], 2),
    (MODEL, "noise_input = [[0, 1], [1, 0]]", "noise_input = [[0, 1], [1, 0]]\n[lqr]\nforce_weight = 1\nstate_weights = [[1, 2], [2, 3]]", "11:17",
        "lqr.state_weights", &["less than 0", "cross_weights"], 2),
    (MODEL, "noise_input = [[0, 1], [1, 0]]", "noise_input = [[0, 1], [1, 0]]\n[lqr]\nforce_weight = 1\nstate_weights = [1, 1]\nangles = \"absolute\"",
        "12:10", "lqr.angles", &["a [model] has no angles"], 2),
    (GOOD, "force_weight = 0.1", "force_weight = 0.1\ncost = \"mean\"", "35:8", "lqr.cost", &["\"integral\" or \"sum\""], 2),
    (GOOD, "force_weight = 0.1", "force_weight = 0.1\ncross_weights = [1]", "35:17", "lqr.cross_weights", &["accepted: 6"], 2),
    ("<?xml version=\"1.0\"?>\n<robot name=\"x\"/>\n", "", "", "1:1", "", &["this is URDF", "upright import"], 2),
    ("{\"name\": \"x\"}\n", "", "", "1:1", "", &["this is JSON"], 2),
    (GOOD, "force_weight = 0.1", "force_weight = 0", "34:16", "lqr.force_weight", &["a number > 0"], 2),
    (GOOD, "overshoot_percent = 5", "overshoot_percent = 100", "36:21", "pole_placement.overshoot_percent", &["< 100"], 2),
    (GOOD, "settling_time_s = 2", "settling_time_s = 0", "37:19", "pole_placement.settling_time_s", &["a number > 0"], 2),
    (GOOD, "far_poles = [-10, -11, -12, -13]", "far_poles = [-10, 11, -12, -13]", "38:19",
        "pole_placement.far_poles[2]", &["found 11", "a number < 0"], 2),
    (GOOD, "far_poles = [-10, -11, -12, -13]", "far_poles = [-10, -11, -12]", "38:13", "pole_placement.far_poles",
        &["poles is 3", "accepted: 4"], 3),
    (GOOD, "far_poles = [-10, -11, -12, -13]", "poles = [[-1, 0]]", "36:21", "pole_placement.overshoot_percent",
        &["given together with pole_placement.poles"], 2),
    (GOOD, "joint_noise = [1e-9, 1e-9]", "joint_noise = [1e-9]", "41:15", "kalman.joint_noise", &["found a list of 1", "accepted: 2"], 2),
    (GOOD, "force_noise_n2_s = 1e-5", "force_noise_n2_s = -1", "40:20", "kalman.force_noise_n2_s", &["a number >= 0"], 2),
    (GOOD, "position_weight = 1", "position_weight = 0", "43:19", "integral.position_weight", &["a number > 0"], 2),
    // Models
    (GOOD, "[limits]", "[model]\na = [[0]]\nb = [1]\n[limits]", "2:1", "cart", &["given together with model"], 2),
    (MODEL, "[model]", "[gravity]\nm_per_s2 = 1\n[model]", "2:1", "gravity", &["given together with model"], 2),
    ("name = \"x\"\n[tick]\nperiod_s = 1\n", "", "", "1:1", "cart", &["missing", "[cart] and its [[link]]s, or [model]"], 2),
    ("name = \"x\"\n[cart]\nmass_kg = 1\n", "", "", "1:1", "link", &["missing", "[[link]]"], 2),
    ("name = \"x\"\nlink = []\n[cart]\nmass_kg = 1\n", "", "", "2:8", "link", &["found a list of 0", "1 to 14"], 2),
    ("name = \"x\"\n[cart]\nmass_kg = 1\n[link]\nmass_kg = 1\n", "", "", "4:1", "link", &["a table", "[[link]]"], 2),
    (MODEL, "a = [[0, 1], [2, 0]]", "a = [[0, 1], [2]]", "3:14", "model.a[2]", &["found a list of 1", "accepted: 2"], 2),
    (MODEL, "a = [[0, 1], [2, 0]]", "a = [[0, 1], [2, \"x\"]]", "3:18", "model.a[2][2]", &["\"x\" (string)"], 2),
    (MODEL, "a = [[0, 1], [2, 0]]", "a = []", "3:5", "model.a", &["1 to 60"], 2),
    (MODEL, "b = [0, 1]", "b = [0, 1, 2]", "4:5", "model.b", &["found a list of 3", "accepted: 2", "single input"], 2),
    (MODEL, "output = 0", "output = 2", "5:10", "model.output", &["found 2", "from 0 to 1"], 2),
    (MODEL, "measured = [0, 1]", "measured = [0, -1]", "6:16", "model.measured[2]", &["found -1", "from 0 to 1"], 2),
    (MODEL, "measured = [0, 1]", "measured = [1, 1]", "6:16", "model.measured[2]", &["each state once"], 2),
    (MODEL, "measured = [0, 1]", "measured = []", "6:12", "model.measured", &["1 to 2"], 2),
    (MODEL, "measured_steps = [1e-3, 1e-3]", "measured_steps = [1e-3]", "7:18", "model.measured_steps", &["accepted: 2"], 2),
    (MODEL, "measured_steps = [1e-3, 1e-3]", "", "2:1", "model.measured_steps", &["missing", "[kalman] needs them"], 2),
    (MODEL, "noise_input = [[0, 1], [1, 0]]", "noise_input = [[0, 1], [1]]", "8:24", "model.noise_input[2]", &["accepted: 2"], 2),
    (MODEL, "joint_noise = [1]", "joint_noise = [1, 2]", "13:15", "kalman.joint_noise", &["accepted: 1"], 2),
    (MODEL, "poles = [[-1, 2], [-1, -2]]", "poles = [[-1, 2], [-1, -2.5]]", "10:10", "pole_placement.poles[1]",
        &["[-1, 2] stands alone", "add [-1, -2]"], 3),
    (MODEL, "poles = [[-1, 2], [-1, -2]]", "poles = [[-1, 2], [-1, 2]]", "10:10", "pole_placement.poles[1]", &["stands alone"], 3),
    (MODEL, "poles = [[-1, 2], [-1, -2]]", "poles = [[-1, 0]]", "10:9", "pole_placement.poles", &["poles is 1", "accepted: 2"], 3),
    (MODEL, "poles = [[-1, 2], [-1, -2]]", "poles = [[-1, 2, 3], [-1, -2]]", "10:10", "pole_placement.poles[1]", &["accepted: 2"], 2),
    (MODEL, "poles = [[-1, 2], [-1, -2]]", "poles = [[1, 2], [1, -2]]", "10:10", "pole_placement.poles[1]", &["left half-plane"], 2),
];

fn check(error: &RigError, place: &str, key: &str, words: &[&str], exit_code: u8) {
    let message = error.to_string();
    let start = format!("bench.toml:{place}");
    assert!(message.starts_with(&start), "{message}\ndoes not start with {start}");
    assert_eq!(error.key.as_deref().unwrap_or_default(), key, "{message}");
    for word in words {
        assert!(message.contains(word), "{message}\ndoes not say {word}");
    }
    assert_eq!(error.exit_code(), exit_code, "{message}");
    assert!(!message.contains('\n') && !message.contains('\u{1b}'), "{message:?} is not one plain line");
}

#[test]
fn the_unchanged_files_are_good() {
    for text in [GOOD, MODEL] {
        Rig::from_toml(text, Path::new("bench.toml")).unwrap();
    }
}

#[test]
fn bad_text_is_reported_with_line_and_key() {
    for &(file, line, replacement, place, key, words, exit_code) in CASES {
        let text =
            file.replacen(&format!("{line}\n"), &format!("{replacement}\n"), usize::from(!line.is_empty()));
        assert!(line.is_empty() || text != file, "no line {line:?} to replace");
        let error = match Rig::from_toml(&text, Path::new("bench.toml")) {
            Ok(_) => panic!("accepted {replacement:?}"),
            Err(error) => error,
        };
        check(&error, place, key, words, exit_code);
    }
    assert!(CASES.len() > 40);
}

#[test]
fn too_many_links_or_states() {
    let links = "[[link]]\nmass_kg = 1\nlength_m = 1\n";
    let text = |n: usize| format!("name = \"x\"\n[cart]\nmass_kg = 1\n{}", links.repeat(n));
    assert_eq!(Rig::from_toml(&text(14), Path::new("bench.toml")).unwrap().states(), 30);
    let error = Rig::from_toml(&text(15), Path::new("bench.toml")).unwrap_err();
    check(&error, "4:1", "link", &["found a list of 15", "1 to 14"], 2);

    let text = format!("name = \"x\"\n[model]\na = [{}]\nb = []\n", "[1],".repeat(61));
    let error = Rig::from_toml(&text, Path::new("bench.toml")).unwrap_err();
    check(&error, "3:5", "model.a", &["found a list of 61", "1 to 60"], 2);
}

/// Writes a file with these bytes to a directory of this test's own.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rig_errors");
    std::fs::create_dir_all(&directory).unwrap();
    let path = directory.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn refuse(path: &Path) -> RigError {
    let error = Rig::from_path(path).unwrap_err();
    assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
    assert_eq!(error.exit_code(), 2);
    error
}

#[test]
fn files_that_are_no_rig_files() {
    assert_eq!(*refuse(Path::new("no/such/rig.toml")).kind, RigErrorKind::NoFile);
    assert_eq!(*refuse(Path::new(env!("CARGO_TARGET_TMPDIR"))).kind, RigErrorKind::Directory);
    assert_eq!(*refuse(&file("zeros.toml", &vec![0; 10_000_000])).kind, RigErrorKind::TooLarge);
    assert_eq!(
        *refuse(&file("blank.toml", &vec![b'\n'; MAX_BYTES as usize + 1])).kind,
        RigErrorKind::TooLarge
    );

    let zeros = refuse(&file("few-zeros.toml", &[0; 1000]));
    assert!(matches!(*zeros.kind, RigErrorKind::NotToml { .. }), "{zeros}");

    for nothing in [&b""[..], b"\n\n", b"# only a comment", b"\xef\xbb\xbf"] {
        let empty = refuse(&file("empty.toml", nothing));
        assert_eq!(empty.key.as_deref(), Some("name"), "{empty}");
    }

    let latin = refuse(&file("latin1.toml", b"name = \"a\"\n# Gl\xfcck\n"));
    assert_eq!(*latin.kind, RigErrorKind::NotUtf8 { offset: 15 });
    assert!(latin.to_string().contains("latin1.toml:2:5: byte 15 is not UTF-8"), "{latin}");
}

#[cfg(unix)]
#[test]
fn an_endless_device_is_not_read_to_its_end() {
    assert_eq!(*refuse(Path::new("/dev/zero")).kind, RigErrorKind::TooLarge);
}
