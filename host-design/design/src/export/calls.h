/* ---- Checks at the start ---- */

/* Whether products, sums and quotients are rounded one by one here, and small numbers kept. */
UPRIGHT_CALL bool upright_arithmetic_is_exact(void)
{
    volatile float one = 1.0f, factor = 1.000244140625f, square = 1.00048828125f, least = FLT_MIN, half = 0.5f;
    volatile float third = one / 3.0f, tenth = one / 10.0f;
    /* The square is used once in each: only then would a compiler fuse it. */
    float a = factor, b = square;
    volatile float difference = a * a - b;
    float c = factor, d = square;
    volatile float sum = d - c * c;
    volatile float subnormal = least * half;
    volatile float twice = subnormal + subnormal;
    return difference == 0.0f && sum == 0.0f && subnormal > 0.0f && twice == FLT_MIN && third == 0.333333343f
        && tenth == 0.100000001f;
}

/* Whether the table has the values that were exported. */
UPRIGHT_CALL bool upright_table_is_intact(void)
{
    uint32_t hash = 2166136261ul;
    for (uint16_t at = 0; at + sizeof hash < sizeof upright_table; at = (uint16_t)(at + sizeof hash)) {
        uint32_t word;
        memcpy(&word, (const char *)&upright_table + at, sizeof word);
        hash = (uint32_t)((hash ^ word) * (uint32_t)16777619ul);
    }
    return hash == upright_table.checksum;
}

/* ---- What a program calls ---- */

/* Before all else. After a fault of table or arithmetic the controller never leaves UPRIGHT_FAULT. */
UPRIGHT_CALL void upright_init(upright_controller *c)
{
    memset(c, 0, sizeof *c);
    if (!upright_table_is_intact()) {
        upright_trip_at(c, UPRIGHT_TABLE, 0);
    } else if (!upright_arithmetic_is_exact()) {
        upright_trip_at(c, UPRIGHT_ARITHMETIC, 0);
    }
}

/* Declares that the counters read `raw` at the positions `counts`; upright_table.rest_counts: the links hang at rest
   and the cart is in the middle. With pulses, energize the motor before. Refused while armed, balancing, braking or
   after a fault, and in the dead band of a potentiometer. */
UPRIGHT_CALL bool upright_home(upright_controller *c, const uint32_t *raw, const int32_t *counts)
{
#if UPRIGHT_HAS_ABSOLUTE
    uint32_t used[UPRIGHT_SENSORS];
    raw = upright_used_bits(raw, used);
#endif
    bool is_possible = c->state == UPRIGHT_NOT_HOMED || c->state == UPRIGHT_READY;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        is_possible = is_possible && !upright_is_dead(raw, i);
    }
#if UPRIGHT_HAS_STEPS
    is_possible = is_possible && !c->is_controlled && !c->is_braking;
#endif
    if (!is_possible) {
        return false;
    }
    memcpy(c->last, raw, sizeof c->last);
    memcpy(c->counts, counts, sizeof c->counts);
    c->jumps = 0;
    c->loses_positions = false;
    c->state = UPRIGHT_READY;
    return true;
}

/* Selects UPRIGHT_LQR or UPRIGHT_POLE_PLACEMENT, with the motor off. */
UPRIGHT_CALL bool upright_select(upright_controller *c, uint8_t law)
{
    if (law >= UPRIGHT_LAWS || c->state == UPRIGHT_BALANCING) {
        return false;
    }
    c->law = law;
    return true;
}

/* Requests a position of the cart (m), within upright_table.setpoints_m: on its way, the cart goes beyond it. */
UPRIGHT_CALL bool upright_set_setpoint(upright_controller *c, float position_m)
{
    if (!(position_m >= upright_table.setpoints_m[0] && position_m <= upright_table.setpoints_m[1])) {
        return false;
    }
    c->target_m = position_m;
    c->setpoint_is_given = true;
    return true;
}

/* Arms, if the rig is homed, its links are upright and its cart is where it may be told to stand. */
UPRIGHT_CALL bool upright_arm(upright_controller *c)
{
    int32_t upright[UPRIGHT_SENSORS];
    upright_unwind(c->counts, upright);
    bool is_ready = c->state == UPRIGHT_READY && c->jumps == 0 && !c->tripped && !c->at_switch;
    if (!is_ready || upright_lean(upright) > upright_table.arm_angle_rad || upright_is_off_centre(c)) {
        return false;
    }
    upright_restart_slow(c);
    c->state = UPRIGHT_ARMED;
    return true;
}

/* Turns the motor off. With pulses, the rig has to be homed again once it has balanced. */
UPRIGHT_CALL void upright_disarm(upright_controller *c)
{
    if (c->state == UPRIGHT_ARMED) {
        c->state = UPRIGHT_READY;
    } else if (c->state == UPRIGHT_BALANCING) {
        c->state = UPRIGHT_HAS_STEPS ? UPRIGHT_NOT_HOMED : UPRIGHT_READY;
    }
    c->setpoint_is_given = false;
    c->requested_n = c->applied_n = 0.0f;
}

/* Turns the motor off until upright_clear(), at the latest from the next upright_control() on: emergency stop, supply,
   a tick that came late ... From anywhere, interrupts too. Pulses end at once. */
UPRIGHT_CALL void upright_trip(upright_controller *c) { c->tripped = 1; }

/* The same for a limit switch of the rail, after which pulses bring the cart to rest. */
UPRIGHT_CALL void upright_trip_at_switch(upright_controller *c) { c->at_switch = 1; }

/* Whether the power stage is to be on: while balancing, and with pulses also while they hold or brake the cart. */
UPRIGHT_CALL bool upright_motor_is_on(const upright_controller *c)
{
#if UPRIGHT_HAS_STEPS
    bool holds = c->state == UPRIGHT_READY || c->state == UPRIGHT_ARMED || c->state == UPRIGHT_BALANCING;
    return !c->tripped && (holds || c->is_controlled || c->is_braking);
#else
    return !c->tripped && !c->at_switch && c->state == UPRIGHT_BALANCING;
#endif
}

/* Clears a fault. After one of an encoder, the rig has to be homed again; with pulses, after any. */
UPRIGHT_CALL bool upright_clear(upright_controller *c)
{
    if (c->fault == UPRIGHT_TABLE || c->fault == UPRIGHT_ARITHMETIC) {
        return false;
    }
    if (c->state != UPRIGHT_FAULT) {
        return !c->tripped && !c->at_switch;
    }
    /* First: a trip that comes from here on is another one. */
    c->tripped = 0;
    c->at_switch = 0;
    c->state = c->loses_positions ? UPRIGHT_NOT_HOMED : UPRIGHT_READY;
    c->fault = UPRIGHT_NO_FAULT;
    return true;
}

/* A tick with the law off: takes the readings. In a tick in which one cannot be, none is taken; after the third in a
   row, nobody knows where the rig is. */
static inline void upright_follow(upright_controller *c, const uint32_t *raw)
{
    float y[UPRIGHT_SENSORS];
    bool is_homed = c->state != UPRIGHT_NOT_HOMED && !c->loses_positions;
    uint8_t jumped = is_homed ? upright_find_jump(c, raw) : UPRIGHT_SENSORS;
    if (jumped == UPRIGHT_SENSORS) {
        c->jumps = 0;
        upright_measure(c, raw, y);
        if (c->state == UPRIGHT_ARMED) {
            upright_wait(c);
        }
        return;
    }
    upright_restart_slow(c);
    upright_count(&c->rejected, true);
    c->jumps++;
    if (c->jumps >= 3) {
        upright_trip_at(c, UPRIGHT_ENCODER, jumped);
    }
}

/* A tick of balancing, up to the output of the law. */
static inline upright_drive upright_balance(upright_controller *c, const uint32_t *raw)
{
    float y[UPRIGHT_SENSORS];
    upright_measure(c, raw, y);
#if UPRIGHT_HAS_STEPS
    y[0] -= upright_table.lag_s * upright_speed(c);
#endif
    upright_govern(c, upright_gains(c)->setpoint_step_m);
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        c->innovation[i] = y[i] - upright_measured(c, i);
    }
    uint8_t sensor = 0;
    upright_fault of_sensors = upright_test(c, y, &sensor);
    c->requested_n = upright_request(c);
    upright_drive drive = upright_actuate(c);
    upright_fault fault = upright_exceeded(c);
    upright_count(&c->saturated, c->requested_n != c->applied_n);
    if (fault != UPRIGHT_NO_FAULT) {
        upright_trip_at(c, fault, 0);
    } else if (of_sensors != UPRIGHT_NO_FAULT) {
        upright_trip_at(c, of_sensors, sensor);
    } else if (c->saturated > upright_table.saturated_ticks) {
        upright_trip_at(c, UPRIGHT_SATURATED, 0);
    }
    return drive;
}

/* First half of a tick: from the readings of the sensors to the duty cycle, or to the pulses of this tick. Drive the
   motor with it at once, if upright_motor_is_on(); else turn it off. Call it every tick from upright_home() on: a
   sensor that moves further between two calls than a cart or a link can in a tick is a fault, motor on or off. */
UPRIGHT_CALL upright_drive upright_control(upright_controller *c, const uint32_t *raw)
{
    upright_drive drive = 0;
#if UPRIGHT_HAS_ABSOLUTE
    uint32_t used[UPRIGHT_SENSORS];
    raw = upright_used_bits(raw, used);
#endif
    if (c->state != UPRIGHT_BALANCING) {
        upright_follow(c, raw);
    }
    if (c->state == UPRIGHT_BALANCING) {
        drive = upright_balance(c, raw);
    }
    /* Last: whenever an interrupt has called upright_trip(), here it is seen. */
    if (c->at_switch) {
        upright_trip_at(c, UPRIGHT_LIMIT_SWITCH, 0);
    }
    if (c->tripped) {
        upright_trip_at(c, UPRIGHT_CALLER, 0);
    }
    return c->state == UPRIGHT_BALANCING ? drive : upright_idle(c);
}

/* Second half of a tick, any time before the next one: the prediction. */
UPRIGHT_CALL void upright_predict(upright_controller *c)
{
    const upright_law_gains *gains = upright_gains(c);
    if (c->state != UPRIGHT_BALANCING) {
        return;
    }
#if UPRIGHT_HAS_PENDING
    float behind = c->pending_n - c->applied_n;
    float acting = c->applied_n + upright_table.pending_acts * behind;
    c->pending_n = c->applied_n + upright_table.pending_stays * behind;
#else
    float acting = c->applied_n;
    c->pending_n = c->applied_n;
#endif
    if (upright_has_memory(gains)) {
        if (gains->k_integral != 0.0f) {
            float moved = UPRIGHT_TICK_S * (c->estimate[UPRIGHT_OUTPUT] - c->setpoint_m);
            float excess = c->requested_n - c->applied_n;
            /* While the force is limited, the integral moves only in the direction that reduces the excess. */
            if (excess * (-gains->k_integral * moved) <= 0.0f) {
                c->integral += moved;
            }
        }
    }
#if UPRIGHT_HAS_PUSHES
    c->lacks_force = upright_lacks_force(c);
#else
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        c->sensors[i].corrected = upright_measured(c, i);
    }
#endif
    const float *a = upright_table.motor_a, *b = upright_table.motor_b;
    float p = c->missing[0], v = c->missing[1];
    c->missing[0] = a[0] * p + a[1] * v - b[0] * acting;
    c->missing[1] = a[2] * p + a[3] * v - b[1] * acting;
    upright_predict_state(c, acting);
#if UPRIGHT_HAS_FRICTION
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        for (uint8_t row = 0; row < UPRIGHT_STATES; row++) {
            c->estimate[row] += upright_table.friction_effect[i][row] * c->friction[i];
        }
    }
#endif
}

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
