/* ---- Tests of the innovation of a rig that may be pushed by hand ---- */

/* Notes whether the counter stays at two neighbouring values, and the innovation e closest to 0 since it does. */
static inline void upright_watch(upright_sensor_memory *memory, int32_t counts, float e)
{
    int32_t lowest = counts < memory->lowest ? counts : memory->lowest;
    int32_t highest = counts > memory->highest ? counts : memory->highest;
    if ((uint32_t)highest - (uint32_t)lowest > 1u) {
        memory->lowest = memory->highest = counts;
        memory->still_ticks = 0;
        memory->closest = e;
        return;
    }
    memory->lowest = lowest;
    memory->highest = highest;
    upright_count(&memory->still_ticks, true);
    /* Of two numbers with the same sign, the one closer to 0 has the smaller bits. */
    uint32_t bits, closest;
    memcpy(&bits, &e, sizeof bits);
    memcpy(&closest, &memory->closest, sizeof closest);
    if ((bits ^ closest) >> 31 != 0) {
        memory->closest = 0.0f;
    } else if (bits < closest) {
        memory->closest = e;
    }
}

/* By how much the innovation e is beyond what lies between 0 and the last accepted one. */
static inline float upright_change(const upright_sensor_memory *memory, float e)
{
    bool is_same_side = e * memory->accepted > 0.0f;
    if (is_same_side && upright_magnitude(e) <= upright_magnitude(memory->accepted)) {
        return 0.0f;
    }
    return e - (is_same_side ? memory->accepted : 0.0f);
}

/* Whether the innovation e, which has changed too much, is rejected. The third in a row is accepted if it moves on. */
static inline bool upright_rejects(upright_sensor_memory *memory, float e, float change)
{
    upright_count(&memory->rejected, true);
    if (memory->rejected == 1) {
        memory->jump = change;
    }
    bool moves_on = upright_magnitude(change - memory->jump) >= 0.5f * upright_magnitude(memory->jump);
    if (memory->rejected >= 3 && moves_on) {
        memory->accepted = e;
        memory->rejected = 0;
        return false;
    }
    return true;
}

/* Whether a missing force explains at least this share of the innovation. */
static inline bool upright_explains(const upright_motor_sums *sums, float share)
{
    return sums->correlation * sums->correlation > share * (sums->energy * sums->error);
}

/* Whether most of the force is missing, as with a dead motor, or about twice the force, as with one that is stuck. */
static inline bool upright_lacks_force(upright_controller *c)
{
    float e = c->innovation[UPRIGHT_MOTOR_SENSOR], p = c->missing[0], energy = upright_table.motor_energy;
    upright_add(&c->sums, 0.9375f, e, p);          /* a memory of 16 ticks */
    upright_add(&c->long_sums, 0.99609375f, e, p); /* a memory of 256 ticks */
    bool dead = upright_lacks(&c->long_sums, upright_table.motor_ratio, 16.0f * energy);
    bool stuck = upright_lacks(&c->sums, 1.8125f, energy) && !upright_lacks(&c->sums, 3.0f, energy);
    return (dead && upright_explains(&c->long_sums, 0.985f)) || (stuck && upright_explains(&c->sums, 0.95f));
}

/* Tests the innovation: do encoders and motor behave as the model says? That of a rejected measurement is set to 0, so
   that the prediction replaces it. */
static inline upright_fault upright_test(upright_controller *c, const float *y, uint8_t *sensor)
{
    (void)y;
    uint8_t jumped = UPRIGHT_SENSORS, frozen = UPRIGHT_SENSORS, pushed = UPRIGHT_SENSORS;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        upright_sensor_memory *memory = &c->sensors[i];
        float e = c->innovation[i], limit = upright_table.innovation[i];
        upright_watch(memory, c->counts[i], e);
        if (upright_magnitude(e) <= limit) {
            /* Then none of its tests can fail. */
            memory->accepted = e;
            memory->rejected = memory->pushed = 0;
            continue;
        }
        if (memory->still_ticks >= 10 && upright_magnitude(e - memory->closest) > limit) {
            frozen = i;
        }
        upright_count(&memory->pushed, upright_magnitude(e) > upright_table.push[i]);
        if (memory->pushed >= 3) {
            pushed = i;
        }
        float change = upright_change(memory, e);
        if (upright_magnitude(change) <= limit) {
            memory->accepted = e;
            memory->rejected = 0;
        } else if (upright_rejects(memory, e, change)) {
            c->innovation[i] = 0.0f;
            upright_count(&c->rejected, true);
            if (memory->rejected >= 3 && jumped == UPRIGHT_SENSORS) {
                jumped = i;
            }
        }
    }
    if (jumped < UPRIGHT_SENSORS) {
        *sensor = jumped;
        return UPRIGHT_ENCODER;
    }
    if (frozen < UPRIGHT_SENSORS) {
        *sensor = frozen;
        return UPRIGHT_FROZEN;
    }
    if (c->lacks_force) {
        *sensor = UPRIGHT_MOTOR_SENSOR;
        return UPRIGHT_MOTOR;
    }
    *sensor = pushed < UPRIGHT_SENSORS ? pushed : 0;
    return pushed < UPRIGHT_SENSORS ? UPRIGHT_DISTURBED : UPRIGHT_NO_FAULT;
}

