/* ---- State of the controller ---- */

#if UPRIGHT_HAS_STEPS
typedef int32_t upright_drive; /* pulses in this tick, spread evenly, positive along +x */
#else
typedef float upright_drive; /* duty cycle, -1 to 1, positive along +x */
#endif

typedef enum {
    UPRIGHT_NOT_HOMED, /* motor off; positions are unknown */
    UPRIGHT_READY,     /* motor off */
    UPRIGHT_ARMED,     /* motor off; balancing begins once the links have been upright and slow for long enough */
    UPRIGHT_BALANCING, /* motor on */
    UPRIGHT_FAULT      /* motor off until upright_clear() */
} upright_state;

/* Memory of the tests of one sensor. */
typedef struct {
#if UPRIGHT_HAS_PUSHES
    int32_t lowest, highest; /* the two neighbouring values at which the counter has stayed */
    uint32_t still_ticks;    /* for this many ticks */
    float closest;           /* innovation closest to 0 since then; 0 once its sign has changed (m or rad) */
    float accepted;          /* last innovation that was accepted (m or rad) */
    float jump;              /* jump of the first measurement that is rejected now (m or rad) */
    uint32_t rejected;       /* rejected measurements in a row */
    uint32_t pushed;         /* ticks in a row beyond the limit for pushes */
#else
    int32_t counts;
    float corrected;      /* corrected estimate of its position in the tick before (m or rad) */
    float moved;          /* motion that the model predicts while the counter stands still (m or rad) */
    uint32_t implausible; /* implausible measurements in a row */
#endif
} upright_sensor_memory;

/* Sums of the motor's test: e p, p^2 and e^2, where p is the innovation that a missing force would have caused. */
typedef struct {
    float correlation, energy, error;
} upright_motor_sums;

/* Read what you like; change it only through the functions. */
typedef struct {
    upright_state state;
    upright_fault fault;    /* the first since upright_clear() */
    uint8_t fault_sensor;   /* at which sensor: 0 is the cart */
    uint8_t law;            /* UPRIGHT_LQR or UPRIGHT_POLE_PLACEMENT */
    bool setpoint_is_given; /* else the position at which balancing begins is held */
    uint32_t last[UPRIGHT_SENSORS];
    int32_t counts[UPRIGHT_SENSORS];
    int32_t slow_reference[UPRIGHT_SENSORS];
    uint32_t slow_ticks;
    uint32_t saturated;
    uint32_t rejected; /* measurements rejected so far */
    float estimate[UPRIGHT_STATES];
    float innovation[UPRIGHT_SENSORS];
    float target_m;   /* requested set-point */
    float setpoint_m; /* governed set-point, which the law follows */
    float integral, pending_n, last_volts;
    float friction[UPRIGHT_SENSORS];
    float requested_n; /* force requested by the law; with pulses, acceleration (m/s^2) */
    float applied_n;   /* the same after all limits */
#if UPRIGHT_HAS_STEPS
    int32_t emitted; /* pulses so far, from position 0 */
#endif
    upright_sensor_memory sensors[UPRIGHT_SENSORS];
    float missing[2];
    upright_motor_sums sums; /* over 16 ticks */
#if UPRIGHT_HAS_PUSHES
    upright_motor_sums long_sums; /* over 256 ticks */
    bool lacks_force;             /* what the motor's test has found after the last tick */
#endif
} upright_controller;

/* ---- Parts of a tick ---- */

static inline float upright_magnitude(float x) { return x < 0.0f ? -x : x; }

/* Limits u; 0 if it is NaN. */
static inline float upright_saturate(float u, float limit)
{
    if (u >= -limit && u <= limit) {
        return u;
    }
    return u > limit ? limit : u < -limit ? -limit : 0.0f;
}

static inline const upright_law_gains *upright_gains(const upright_controller *c)
{
    return &upright_table.laws[c->law];
}

/* Whether the force depends on earlier ticks by more than the estimate. */
static inline bool upright_has_memory(const upright_law_gains *gains)
{
    return UPRIGHT_HAS_PENDING || gains->k_pending != 0.0f || gains->k_integral != 0.0f;
}

static inline void upright_count(uint32_t *ticks, bool holds)
{
    *ticks = !holds ? 0 : *ticks == UINT32_MAX ? UINT32_MAX : *ticks + 1;
}

static inline void upright_trip_at(upright_controller *c, upright_fault fault, uint8_t sensor)
{
    if (c->state != UPRIGHT_FAULT) {
        c->fault = fault;
        c->fault_sensor = sensor;
    }
    c->state = UPRIGHT_FAULT;
    c->setpoint_is_given = false;
    c->requested_n = c->applied_n = 0.0f;
}

/* Speed of the cart (m/s): the state after its position. */
static inline float upright_speed(const upright_controller *c)
{
#if UPRIGHT_STATES > 1
    return c->estimate[1];
#else
    (void)c;
    return 0.0f;
#endif
}

/* What sensor i measures of the estimate (m or rad). */
static inline float upright_measured(const upright_controller *c, uint8_t i)
{
    uint32_t state = upright_table.measured[i];
#if UPRIGHT_HAS_DELAY
    return c->estimate[state] - upright_table.delay_s[i] * (state + 1 < UPRIGHT_STATES ? c->estimate[state + 1] : 0.0f);
#else
    return c->estimate[state];
#endif
}

/* Takes new readings of the counters; `y` gets the positions (m or rad). */
static inline void upright_measure(upright_controller *c, const uint32_t *raw, float *y)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        uint32_t moved = raw[i] - c->last[i];
        if ((UPRIGHT_COUNTERS_OF_16_BITS >> i) & 1) {
            moved = (moved & 0xffff) ^ 0x8000;
            moved -= 0x8000;
        }
        c->last[i] = raw[i];
        c->counts[i] = (int32_t)((uint32_t)c->counts[i] + moved);
        y[i] = upright_table.step[i] * (float)c->counts[i];
    }
}

/* Counts without whole turns of the joints. */
static inline void upright_unwind(const int32_t *counts, int32_t *unwound)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        int32_t turn = upright_table.turn_counts[i];
        unwound[i] = counts[i];
        if (turn > 0) {
            int32_t rest = (int32_t)((uint32_t)counts[i] + (uint32_t)(turn / 2)) % turn;
            unwound[i] = (rest < 0 ? rest + turn : rest) - turn / 2;
        }
    }
}

/* Largest angle of a link from the vertical at these counts (rad). */
static inline float upright_lean(const int32_t *counts)
{
    float angle = 0.0f, largest = 0.0f;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        if (upright_table.turn_counts[i] > 0) {
            angle += upright_table.step[i] * (float)counts[i];
            if (upright_magnitude(angle) > largest) {
                largest = upright_magnitude(angle);
            }
        }
    }
    return largest;
}

static inline bool upright_is_off_centre(const upright_controller *c)
{
    float position = upright_table.step[0] * (float)c->counts[0];
    return position < upright_table.rail_m[0] || position > upright_table.rail_m[1];
}

static inline void upright_restart_slow(upright_controller *c)
{
    memcpy(c->slow_reference, c->counts, sizeof c->counts);
    c->slow_ticks = 0;
}

static inline void upright_update_slow(upright_controller *c)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        int32_t moved = (int32_t)((uint32_t)c->counts[i] - (uint32_t)c->slow_reference[i]);
        uint32_t distance = moved < 0 ? 0u - (uint32_t)moved : (uint32_t)moved;
        if (distance > (uint32_t)upright_table.slow_counts[i]) {
            upright_restart_slow(c);
            return;
        }
    }
    upright_count(&c->slow_ticks, true);
}

#if UPRIGHT_HAS_STEPS
/* The step nearest to a position (m), or `otherwise` if that is not a number or beyond all counts. */
static inline int32_t upright_nearest_step(float position_m, int32_t otherwise)
{
    float steps = position_m / upright_table.step_m;
    steps += steps < 0.0f ? -0.5f : 0.5f;
    return steps > -2147483648.0f && steps < 2147483648.0f ? (int32_t)steps : otherwise;
}
#endif

/* Starts at rest at the present positions, with all memories cleared. */
static inline void upright_start(upright_controller *c)
{
    memset(c->estimate, 0, sizeof c->estimate);
    memset(c->innovation, 0, sizeof c->innovation);
    memset(c->friction, 0, sizeof c->friction);
    memset(c->sensors, 0, sizeof c->sensors);
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        float y = upright_table.step[i] * (float)c->counts[i];
        c->estimate[upright_table.measured[i]] = y;
#if UPRIGHT_HAS_PUSHES
        c->sensors[i].lowest = c->sensors[i].highest = c->counts[i];
#else
        c->sensors[i].counts = c->counts[i];
        c->sensors[i].corrected = y;
#endif
    }
    c->missing[0] = c->missing[1] = 0.0f;
    memset(&c->sums, 0, sizeof c->sums);
#if UPRIGHT_HAS_PUSHES
    memset(&c->long_sums, 0, sizeof c->long_sums);
    c->lacks_force = false;
#endif
    c->integral = c->pending_n = c->last_volts = 0.0f;
    c->saturated = 0;
    c->setpoint_m = c->estimate[UPRIGHT_OUTPUT];
#if UPRIGHT_HAS_STEPS
    c->emitted = upright_nearest_step(c->estimate[0], 0);
#endif
    if (!c->setpoint_is_given) {
        c->target_m = c->setpoint_m;
    }
    c->state = UPRIGHT_BALANCING;
}

/* A tick while armed: balancing starts when all links have been upright and slow for long enough. */
static inline void upright_wait(upright_controller *c)
{
    int32_t upright[UPRIGHT_SENSORS];
    upright_unwind(c->counts, upright);
    float lean = upright_lean(upright);
    upright_update_slow(c);
    if (lean > upright_table.angle_rad || upright_is_off_centre(c)) {
        c->state = UPRIGHT_READY;
    } else if (lean > upright_table.arm_angle_rad) {
        upright_restart_slow(c);
    } else if (c->slow_ticks >= upright_table.arm_ticks) {
        memcpy(c->counts, upright, sizeof upright);
        upright_start(c);
    }
}

/* Adds a tick to the motor's sums, of which each keeps the share `keep`. */
static inline void upright_add(upright_motor_sums *sums, float keep, float e, float p)
{
    sums->correlation = keep * sums->correlation + e * p;
    sums->energy = keep * sums->energy + p * p;
    sums->error = keep * sums->error + e * e;
}

/* Whether more than the share `ratio` of the force is missing. */
static inline bool upright_lacks(const upright_motor_sums *sums, float ratio, float energy)
{
    return sums->energy > energy && sums->correlation > ratio * sums->energy;
}

/* Moves the governed set-point towards the requested one, no faster than the limits allow. */
static inline void upright_govern(upright_controller *c, float step)
{
    float rising = c->target_m - c->setpoint_m;
    rising = rising > step ? step : rising;
    c->setpoint_m += rising < -step ? -step : rising;
}

/* x = x- + L e, and the state feedback N r - K x: positions and rates are summed separately. */
static inline float upright_correct(upright_controller *c)
{
    const upright_law_gains *gains = upright_gains(c);
    float positions = gains->n * c->setpoint_m, rates = -0.0f;
    for (uint8_t state = 0; state < UPRIGHT_STATES; state++) {
        float x = c->estimate[state];
        for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
            x += upright_table.l[i][state] * c->innovation[i];
        }
        c->estimate[state] = x;
        if (state % 2 == 0) {
            positions -= gains->k[state] * x;
        } else {
            rates -= gains->k[state] * x;
        }
    }
    return positions + rates;
}

#if UPRIGHT_HAS_FRICTION
/* Force on the cart (N) that compensates the known friction of all axes. */
static inline float upright_compensate_friction(upright_controller *c)
{
    float force = 0.0f;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS && i < UPRIGHT_STATES / 2; i++) {
        const float *axis = upright_table.friction[i];
        c->friction[i] = -upright_saturate(axis[1] * c->estimate[2 * i + 1], axis[0]);
        force += axis[2 + c->law] * c->friction[i];
    }
    return force;
}
#endif

/* The first half of the controller's tick, to the requested force (N). */
static inline float upright_request(upright_controller *c)
{
    const upright_law_gains *gains = upright_gains(c);
    float requested = upright_correct(c);
#if UPRIGHT_HAS_FRICTION
    requested += upright_compensate_friction(c);
#endif
    if (upright_has_memory(gains)) {
        requested -= gains->k_pending * c->pending_n;
        requested -= gains->k_integral * c->integral;
    }
    return requested;
}

#if UPRIGHT_HAS_STEPS
/* Limits the requested acceleration, so that the tick does not end faster than the drive may be. */
static inline float upright_limited(float requested, float speed)
{
    const upright_table_type *t = &upright_table;
    float limited = upright_saturate(requested, t->acceleration_limit_m_per_s2);
    float lead_s = t->lead_s > UPRIGHT_TICK_S ? t->lead_s : UPRIGHT_TICK_S;
    float next = speed + limited * lead_s;
    float within = upright_saturate(next, t->speed_limit_m_per_s);
    if (within == next) {
        return limited;
    }
    return upright_saturate((within - speed) / lead_s, t->acceleration_limit_m_per_s2);
}

/* The pulses that bring the cart to the step nearest to where the tick ends. What is rounded off is not lost. */
static inline upright_drive upright_actuate(upright_controller *c)
{
    float speed = upright_speed(c);
    c->applied_n = upright_limited(c->requested_n, speed);
    float commanded_speed = speed + c->applied_n * upright_table.lead_s;
    float commanded = c->estimate[0] + upright_table.lag_s * speed;
    int32_t target = upright_nearest_step(commanded + commanded_speed * UPRIGHT_TICK_S, c->emitted);
    int32_t pulses = (int32_t)((uint32_t)target - (uint32_t)c->emitted);
    c->emitted = target;
    return pulses;
}
#else
/* Limits the requested force; returns the duty cycle, -1 to 1. */
static inline upright_drive upright_actuate(upright_controller *c)
{
    float limited = upright_saturate(c->requested_n, upright_table.force_limit_n);
#if UPRIGHT_HAS_MOTOR
    const upright_table_type *t = &upright_table;
    float back_emf = t->volts_per_speed * upright_speed(c);
    float wanted = t->volts_per_newton * limited + back_emf;
    float within_supply = upright_saturate(wanted, t->supply_v - t->dead_zone_v);
    float volts = c->last_volts + upright_saturate(within_supply - c->last_volts, t->slew_v_per_tick);
    c->applied_n = volts == wanted ? limited : (volts - back_emf) / t->volts_per_newton;
    c->last_volts = volts;
    float lift = upright_saturate(10.0f * volts, t->dead_zone_v);
    return upright_saturate((volts + lift) / t->supply_v, 1.0f);
#else
    c->applied_n = limited;
    return upright_saturate(limited / upright_table.force_limit_n, 1.0f);
#endif
}
#endif

/* The first limit that estimate or requested force exceeds. */
static inline upright_fault upright_exceeded(const upright_controller *c)
{
    const float *x = c->estimate;
    if (!(c->requested_n - c->requested_n == 0.0f)) {
        return UPRIGHT_NOT_FINITE;
    }
    if (x[0] < upright_table.rail_m[0] || x[0] > upright_table.rail_m[1]) {
        return UPRIGHT_RAIL;
    }
    float angle = 0.0f;
    for (uint8_t state = 2; state < UPRIGHT_STATES; state += 2) {
        angle += x[state];
        if (upright_magnitude(angle) > upright_table.angle_rad) {
            return UPRIGHT_ANGLE;
        }
    }
    return upright_magnitude(upright_speed(c)) > upright_table.speed_m_per_s ? UPRIGHT_SPEED : UPRIGHT_NO_FAULT;
}

/* x- = Ad x + Bd u with the force u (N) that acts during this tick. The terms of a sum are added in this order. */
static inline void upright_predict_state(upright_controller *c, float u)
{
    float *x = c->estimate, next[UPRIGHT_STATES];
    for (uint8_t row = 0; row < UPRIGHT_STATES; row++) {
        next[row] = upright_table.bd[row] * u;
    }
#if UPRIGHT_PATTERN == 2
    /* A chain without friction: nothing depends on the cart's position and speed but itself, and both entries on the
       diagonal of a block are equal. */
    next[0] = next[0] + x[0] + upright_table.ad[1][0] * x[1];
    next[1] = next[1] + x[1];
    for (uint8_t joint = 2; joint < UPRIGHT_STATES; joint += 2) {
        const float *from_position = upright_table.ad[joint], *from_rate = upright_table.ad[joint + 1];
        for (uint8_t row = 0; row < UPRIGHT_STATES; row += 2) {
            next[row] = next[row] + from_position[row] * x[joint] + from_rate[row] * x[joint + 1];
            next[row + 1] = next[row + 1] + from_position[row + 1] * x[joint] + from_position[row] * x[joint + 1];
        }
    }
#else
#if UPRIGHT_PATTERN == 1
    /* Nothing depends on the cart's position but itself: the first column is 1, 0, 0 ... */
    next[0] += x[0];
#endif
    for (uint8_t column = UPRIGHT_PATTERN; column < UPRIGHT_STATES; column++) {
        for (uint8_t row = 0; row < UPRIGHT_STATES; row++) {
            next[row] += upright_table.ad[column][row] * x[column];
        }
    }
#endif
    memcpy(x, next, sizeof next);
}

