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

