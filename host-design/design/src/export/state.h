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
    UPRIGHT_FAULT      /* motor off until upright_clear(); with pulses, once it has brought the cart to rest */
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
    uint8_t jumps;     /* ticks in a row with readings that cannot be, with the motor off */
    bool loses_positions; /* whether the rig has to be homed again after the fault */
    /* Set from anywhere, and reset only by upright_clear(): nothing else that runs can undo them. */
    volatile uint8_t tripped, at_switch;
    float estimate[UPRIGHT_STATES];
    float innovation[UPRIGHT_SENSORS];
    float target_m;   /* requested set-point */
    float setpoint_m; /* governed set-point, which the law follows */
    float integral, pending_n, last_volts;
    float friction[UPRIGHT_SENSORS];
    float requested_n; /* force requested by the law; with pulses, acceleration (m/s^2) */
    float applied_n;   /* the same after all limits */
#if UPRIGHT_HAS_STEPS
    int32_t emitted;      /* pulses so far, from position 0 */
    bool is_controlled;   /* whether the law has commanded the drive since it was last brought to rest */
    bool is_braking;      /* whether the pulses of this tick bring it to rest */
    float braked_m_per_s; /* speed while it is brought to rest */
    float braked_rest;    /* travel left over from the ticks before (pulses) */
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
    c->loses_positions = c->loses_positions || UPRIGHT_HAS_STEPS || fault == UPRIGHT_ENCODER || fault == UPRIGHT_FROZEN;
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

