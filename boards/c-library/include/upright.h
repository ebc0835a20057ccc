/* The whole firmware of Upright for programs in C: supervisor, controller and serial protocol. Compile with
   -DUPRIGHT_SENSORS=N, the number of encoders of the rig, for a stepper's rig the pulses and the links. The table of the
   rig is in the library. */
#ifndef UPRIGHT_H
#define UPRIGHT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* All inputs, read at the start of a tick. What is left as it is counts as an open contact. */
typedef struct {
    /* Of 32 bits. A counter of 16 bits: count += (int16_t)(uint16_t)(timer - count). With a stepper, the first one is the
       number of all pulses given so far. An absolute sensor of n bits: as a counter of n bits. */
    uint32_t raw_counts[UPRIGHT_SENSORS];
    float supply_v;
    /* 1: pressed, or its wire is open. */
    uint8_t limit_low, limit_high, emergency_stop;
    /* 1: the power stage has reported a fault since the last tick. */
    uint8_t driver_fault;
    /* 1: the previous tick was still running when this one was due. */
    uint8_t overrun;
    /* 1: the clock or the chip is not as it should be. */
    uint8_t clock_fault, board_fault;
    /* Bit i: the sample of sensor i is bad, as the parity of an absolute sensor says. */
    uint8_t bad_samples;
} upright_inputs;

/* The output to the power stage. */
typedef struct {
    float duty;     /* -1 to 1, positive along +x */
    int32_t pulses; /* of this tick, for a stepper */
    uint8_t enable; /* 0: the motor coasts */
} upright_output;

/* Why the program starts. */
enum { UPRIGHT_POWER_ON, UPRIGHT_WATCHDOG, UPRIGHT_CRASH };

/* What the library gives. `upright_start` comes first, once; false: the library is for another number of encoders. */
bool upright_start_for(uint32_t sensors, uint8_t reset);
static inline bool upright_start(uint8_t reset) { return upright_start_for(UPRIGHT_SENSORS, reset); }
/* Each tick of the rig, from a timer's interrupt, and from nowhere else. */
void upright_tick(void);
/* The serial line, below the tick in priority: both from the same task. A frame of `length` bytes, valid until the next
   call; of 0 bytes if there is nothing to send. */
void upright_receive(uint8_t byte);
const uint8_t *upright_transmit(uint32_t *length);

/* What the program gives; `upright_start` and `upright_tick` call it. None may wait. */
void upright_board_inputs(upright_inputs *inputs);
void upright_board_drive(const upright_output *output);
/* Restart the watchdog. Called at the end of a tick, but not while `overrun` was set in three ticks in a row. */
void upright_board_feed_watchdog(void);
/* A counter of processor cycles; 0 if there is none. */
uint32_t upright_board_cycles(void);
/* To which the timer is set. If the table is for another tick, the motor stays off. */
float upright_board_tick_s(void);
/* After a panic: turns the motor off for good. */
void upright_board_stop(void) __attribute__((noreturn));

/* The library asserts the same. */
_Static_assert(offsetof(upright_inputs, supply_v) == 4 * UPRIGHT_SENSORS, "upright_inputs");
_Static_assert(sizeof(upright_inputs) == 4 * UPRIGHT_SENSORS + 12, "upright_inputs");
_Static_assert(offsetof(upright_output, enable) == 8 && sizeof(upright_output) == 12, "upright_output");

#endif
