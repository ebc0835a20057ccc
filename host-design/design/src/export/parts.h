#if UPRIGHT_HAS_STEPS
/* The nearest whole number, or `otherwise` if `steps` is not a number or beyond all counts. */
static inline int32_t upright_nearest(float steps, int32_t otherwise)
{
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
    c->emitted = upright_nearest(c->estimate[0] / upright_table.step_m, 0);
    c->is_controlled = true;
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
    float next = commanded + commanded_speed * UPRIGHT_TICK_S;
    int32_t target = upright_nearest(next / upright_table.step_m, c->emitted);
    int32_t pulses = (int32_t)((uint32_t)target - (uint32_t)c->emitted);
    c->emitted = target;
    return pulses;
}

/* The pulses of a tick without the law. After it, they bring the cart to rest with the largest acceleration, so that no
   step is lost; but not if drive or program may be at fault, or if upright_trip() has been called. */
static inline upright_drive upright_idle(upright_controller *c)
{
    float before = c->braked_m_per_s;
    if (c->is_controlled) {
        float speed = upright_speed(c);
        before = speed - speed == 0.0f ? speed : 0.0f;
        c->is_controlled = false;
        c->braked_rest = 0.0f;
    }
    c->braked_m_per_s = 0.0f;
    bool is_cut = c->tripped || (c->state == UPRIGHT_FAULT && !upright_brakes(c->fault));
    c->is_braking = before != 0.0f && !is_cut;
    if (!c->is_braking) {
        return 0;
    }
    float wanted = (0.0f - before) / UPRIGHT_TICK_S;
    float acceleration = upright_limited(wanted, before);
    if (acceleration != wanted) {
        c->braked_m_per_s = before + acceleration * UPRIGHT_TICK_S;
    }
    float travel = 0.5f * (before + c->braked_m_per_s) * UPRIGHT_TICK_S / upright_table.step_m;
    float steps = c->braked_rest + travel;
    int32_t whole = upright_nearest(steps, 0);
    c->braked_rest = steps - (float)whole;
    return whole;
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

static inline upright_drive upright_idle(upright_controller *c)
{
    (void)c;
    return 0.0f;
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
    for (uint8_t state = 2; state < UPRIGHT_STATES; state = (uint8_t)(state + 2)) {
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
    for (uint8_t joint = 2; joint < UPRIGHT_STATES; joint = (uint8_t)(joint + 2)) {
        const float *from_position = upright_table.ad[joint], *from_rate = upright_table.ad[joint + 1];
        for (uint8_t row = 0; row < UPRIGHT_STATES; row = (uint8_t)(row + 2)) {
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

