/* Replays recorded ticks on the controller in controller.h. Reads and writes words of 32 bits.

   In, for each tick: what to do before it (1: home at rest, 2: select the law in the next byte, 4: arm, 8: take the
   set-point, 16: clear, 32: disarm, 64: trip, 128: trip at a limit switch), the set-point, the readings of the sensors.
   Out: state, or 99 if something was refused; fault, duty or pulses, whether the motor is on, requested and applied
   force or acceleration, governed set-point, estimate, innovation. */

/* As on the simulated bench: 32 bits for the cart, 16 for the links. */
#define UPRIGHT_COUNTERS_OF_16_BITS 0x7ffeul
#include "controller.h"

#include <stdio.h>

static void put(float value)
{
    uint32_t word;
    memcpy(&word, &value, sizeof word);
    fwrite(&word, sizeof word, 1, stdout);
}

static void put_all(const float *values, int count)
{
    for (int i = 0; i < count; i++) {
        put(values[i]);
    }
}

int main(void)
{
    static upright_controller c;
    uint32_t in[2 + UPRIGHT_SENSORS];
    upright_init(&c);
    while (fread(in, sizeof in, 1, stdin) == 1) {
        float setpoint_m;
        memcpy(&setpoint_m, &in[1], sizeof setpoint_m);
        bool done = true;
        done = (!(in[0] & 1) || upright_home(&c, in + 2, upright_table.rest_counts)) && done;
        done = (!(in[0] & 2) || upright_select(&c, (uint8_t)(in[0] >> 8))) && done;
        done = (!(in[0] & 4) || upright_arm(&c)) && done;
        done = (!(in[0] & 8) || upright_set_setpoint(&c, setpoint_m)) && done;
        done = (!(in[0] & 16) || upright_clear(&c)) && done;
        if (in[0] & 32) {
            upright_disarm(&c);
        }
        if (in[0] & 64) {
            upright_trip(&c);
        }
        if (in[0] & 128) {
            upright_trip_at_switch(&c);
        }
        upright_drive drive = upright_control(&c, in + 2);
        uint32_t head[2] = {done ? (uint32_t)c.state : 99u, (uint32_t)c.fault};
        fwrite(head, sizeof head, 1, stdout);
        uint32_t is_on = upright_motor_is_on(&c);
        fwrite(&drive, sizeof drive, 1, stdout);
        fwrite(&is_on, sizeof is_on, 1, stdout);
        put(c.requested_n);
        put(c.applied_n);
        put(c.setpoint_m);
        put_all(c.estimate, UPRIGHT_STATES);
        put_all(c.innovation, UPRIGHT_SENSORS);
        upright_predict(&c);
    }
    return 0;
}
