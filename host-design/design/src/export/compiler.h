/* ---- Compiler and arithmetic: sums and products have to be rounded one by one, to single precision. ---- */

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "upright: compile without -ffast-math, -Ofast and -ffinite-math-only: they change the controller's results"
#endif
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#error "upright: compile as C99 or C++11, or later"
#endif
/* 0: a float is computed as a float; 16: so it is, only numbers of 16 bits are another matter. */
#if defined(__FLT_EVAL_METHOD__)
#define UPRIGHT_EVAL_METHOD __FLT_EVAL_METHOD__
#else
#define UPRIGHT_EVAL_METHOD FLT_EVAL_METHOD
#endif
#if UPRIGHT_EVAL_METHOD != 0 && UPRIGHT_EVAL_METHOD != 16
#error "upright: float is computed with more digits here: compile for SSE (-msse2 -mfpmath=sse), not for the x87"
#endif
#if FLT_RADIX != 2 || FLT_MANT_DIG != 24 || FLT_MAX_EXP != 128
#error "upright: float is not IEEE single precision here"
#endif

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
/* Without this, gcc fuses products into sums, which saves a rounding and changes the bits. */
#pragma GCC optimize ("fp-contract=off", "no-associative-math", "no-reciprocal-math", "signed-zeros")
#else
#pragma STDC FP_CONTRACT OFF
#endif
#if defined(__GNUC__)
/* Not inlined, so that the options above hold, whatever those of the caller are. */
#define UPRIGHT_CALL static __attribute__((noinline, unused))
#else
#define UPRIGHT_CALL static inline
#endif

/* Bit i is set if the counter of sensor i has 16 bits and wraps after 65536 counts; the others have 32. */
#ifndef UPRIGHT_COUNTERS_OF_16_BITS
#define UPRIGHT_COUNTERS_OF_16_BITS 0ul
#endif

/* ---- The table ---- */

/* Gains of one law u = N r - K x - k_pending u_pending - k_integral z. */
typedef struct {
    float k[UPRIGHT_STATES];
    float k_pending;
    float k_integral;
    float n;
    float setpoint_step_m; /* largest change of the governed set-point in one tick */
} upright_law_gains;

/* Each member consists of 32-bit words, of which `checksum` is taken. Matrices are stored column by column. */
typedef struct {
    upright_law_gains laws[UPRIGHT_LAWS];
    float force_limit_n;
#if UPRIGHT_HAS_PENDING
    /* Shares of the pending force: in the mean force of a tick, and still pending after it. */
    float pending_acts, pending_stays;
#endif
    /* Observer: x+ = Ad x + Bd u; x = x- + L e; travel per count (m or rad). */
    float ad[UPRIGHT_STATES][UPRIGHT_STATES];
    float bd[UPRIGHT_STATES];
    float l[UPRIGHT_SENSORS][UPRIGHT_STATES];
#if UPRIGHT_HAS_DELAY
    float delay_s[UPRIGHT_SENSORS]; /* age of each sensor's reading */
#endif
    float step[UPRIGHT_SENSORS];
#if UPRIGHT_HAS_FRICTION
    /* Known Coulomb friction of each axis: bound, slope, force on the cart with each law; effect on the states. */
    float friction[UPRIGHT_SENSORS][2 + UPRIGHT_LAWS];
    float friction_effect[UPRIGHT_SENSORS][UPRIGHT_STATES];
#endif
#if UPRIGHT_HAS_MOTOR
    float volts_per_newton, volts_per_speed, dead_zone_v, slew_v_per_tick, supply_v;
#endif
#if UPRIGHT_HAS_STEPS
    float step_m, acceleration_limit_m_per_s2, speed_limit_m_per_s;
    float lag_s, lead_s; /* of a drive that follows late; speed that is commanded above the cart's, per acceleration */
#endif
    /* Limits. */
    float rail_m[2], setpoints_m[2]; /* soft limits of the rail; where the cart may be told to stand */
    float angle_rad, speed_m_per_s, arm_angle_rad;
    /* Thresholds of the tests of the innovation. */
    float innovation[UPRIGHT_SENSORS];
    float frozen[UPRIGHT_SENSORS];
    float push[UPRIGHT_SENSORS];
    float motor_a[4], motor_b[2], motor_ratio, motor_energy;
    uint32_t saturated_ticks, arm_ticks;
    uint32_t measured[UPRIGHT_SENSORS]; /* the state that each sensor measures */
    int32_t slow_counts[UPRIGHT_SENSORS];
    int32_t rest_counts[UPRIGHT_SENSORS]; /* readings while the links hang and the cart is at 0 */
    int32_t turn_counts[UPRIGHT_SENSORS];
    int32_t furthest_counts[UPRIGHT_SENSORS]; /* in a tick, with the motor off */
#if UPRIGHT_HAS_ABSOLUTE
    /* Of absolute sensors: counts in a turn, less 1; bits of a reading that are too fine; lowest and highest one. */
    uint32_t range[UPRIGHT_SENSORS], unused_bits[UPRIGHT_SENSORS], readings[UPRIGHT_SENSORS][2];
#endif
    uint32_t checksum;
} upright_table_type;

