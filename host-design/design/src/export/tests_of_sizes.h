/* ---- Tests of the innovation of a rig whose pushes are not told from defects ---- */

/* Sets the innovation of an implausible measurement to 0, so that the prediction replaces it. Three in a row are a
   fault: of the encoder, or of the motor if several measurements are implausible at once. */
static inline upright_fault upright_reject(upright_controller *c, uint8_t *sensor)
{
    uint8_t rejected_now = 0;
    bool is_fault = false;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        upright_sensor_memory *memory = &c->sensors[i];
        if (upright_magnitude(c->innovation[i]) <= upright_table.innovation[i]) {
            memory->implausible = 0;
            continue;
        }
        c->innovation[i] = 0.0f;
        upright_count(&memory->implausible, true);
        upright_count(&c->rejected, true);
        rejected_now++;
        if (memory->implausible >= 3 && !is_fault) {
            is_fault = true;
            *sensor = i;
        }
    }
    return !is_fault ? UPRIGHT_NO_FAULT : rejected_now > 1 ? UPRIGHT_MOTOR : UPRIGHT_ENCODER;
}

/* Tests the innovation: do encoders and motor behave as the model says? */
static inline upright_fault upright_test(upright_controller *c, const float *y, uint8_t *sensor)
{
    const float keep = 0.9375f; /* a memory of 16 ticks */
    bool is_plausible = true, is_frozen = false;
    uint8_t frozen = 0;
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        upright_sensor_memory *memory = &c->sensors[i];
        float e = c->innovation[i];
        if (c->counts[i] == memory->counts) {
            /* y - e is the predicted position. */
            memory->moved = keep * memory->moved + (y[i] - e - memory->corrected);
            if (upright_magnitude(memory->moved) > upright_table.frozen[i]) {
                is_frozen = true;
                frozen = i;
            }
        } else {
            memory->moved = 0.0f;
            memory->counts = c->counts[i];
        }
        is_plausible = is_plausible && upright_magnitude(e) <= upright_table.innovation[i];
    }
    upright_fault found = UPRIGHT_NO_FAULT;
    if (is_plausible) {
        for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
            c->sensors[i].implausible = 0;
        }
    } else {
        found = upright_reject(c, sensor);
    }
    upright_add(&c->sums, keep, c->innovation[UPRIGHT_MOTOR_SENSOR], c->missing[0]);
    if (found != UPRIGHT_NO_FAULT) {
        return found;
    }
    if (is_frozen) {
        *sensor = frozen;
        return UPRIGHT_FROZEN;
    }
    *sensor = UPRIGHT_MOTOR_SENSOR;
    bool lacks_force = upright_lacks(&c->sums, upright_table.motor_ratio, upright_table.motor_energy);
    return lacks_force ? UPRIGHT_MOTOR : UPRIGHT_NO_FAULT;
}

