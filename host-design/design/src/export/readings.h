/* How far a counter has moved since its last reading. */
static inline uint32_t upright_moved(const upright_controller *c, const uint32_t *raw, uint8_t i)
{
    uint32_t range = (UPRIGHT_COUNTERS_OF_16_BITS >> i) & 1 ? 0xfffful : 0xfffffffful;
#if UPRIGHT_HAS_ABSOLUTE
    range &= upright_table.range[i];
#endif
    uint32_t half = range / 2 + 1;
    return (((raw[i] - c->last[i]) & range) ^ half) - half;
}

/* Distance without its sign. */
static inline uint32_t upright_distance(uint32_t moved) { return moved > 0x7ffffffful ? 0u - moved : moved; }

#if UPRIGHT_HAS_ABSOLUTE
/* Drops the bits that are finer than those used; `raw` becomes `used`. */
static inline const uint32_t *upright_used_bits(const uint32_t *raw, uint32_t *used)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        used[i] = raw[i] >> upright_table.unused_bits[i];
    }
    return used;
}
#endif

/* Takes new readings of the counters; `y` gets the positions (m or rad). */
static inline void upright_measure(upright_controller *c, const uint32_t *raw, float *y)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        uint32_t moved = upright_moved(c, raw, i);
        c->last[i] = raw[i];
        c->counts[i] = (int32_t)((uint32_t)c->counts[i] + moved);
        y[i] = upright_table.step[i] * (float)c->counts[i];
    }
}

/* Whether sensor i reads where a potentiometer has its dead band, or a wire is open. */
static inline bool upright_is_dead(const uint32_t *raw, uint8_t i)
{
#if UPRIGHT_HAS_ABSOLUTE
    return raw[i] < upright_table.readings[i][0] || raw[i] > upright_table.readings[i][1];
#else
    (void)raw;
    (void)i;
    return false;
#endif
}

/* The first sensor that reads what cannot be: it has moved further in this tick than its cart or joint can, or is dead;
   UPRIGHT_SENSORS if there is none. */
static inline uint8_t upright_find_jump(const upright_controller *c, const uint32_t *raw)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        uint32_t moved = upright_distance(upright_moved(c, raw, i));
        if (moved > (uint32_t)upright_table.furthest_counts[i] || upright_is_dead(raw, i)) {
            return i;
        }
    }
    return UPRIGHT_SENSORS;
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
    return position < upright_table.setpoints_m[0] || position > upright_table.setpoints_m[1];
}

static inline void upright_restart_slow(upright_controller *c)
{
    memcpy(c->slow_reference, c->counts, sizeof c->counts);
    c->slow_ticks = 0;
}

static inline void upright_update_slow(upright_controller *c)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        uint32_t moved = (uint32_t)c->counts[i] - (uint32_t)c->slow_reference[i];
        if (upright_distance(moved) > (uint32_t)upright_table.slow_counts[i]) {
            upright_restart_slow(c);
            return;
        }
    }
    upright_count(&c->slow_ticks, true);
}

