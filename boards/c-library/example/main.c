/* The firmware in C. Here, pins and serial line are files of the emulator, so that a test can play the machine; on a
   board, a timer's interrupt calls upright_tick, and the functions below read and write registers.

   wires.in:  for each tick an upright_inputs, the number of received bytes as one byte, and these bytes.
   wires.out: for each tick an upright_output, then the number of sent bytes as two bytes, and these bytes. */

#include "upright.h"

#include <stdio.h>
#include <stdlib.h>

/* What the wires carry in this tick. */
static upright_inputs wires;
static upright_output motor;

void upright_board_inputs(upright_inputs *inputs)
{
    *inputs = wires; /* counters, contacts, converter */
}

void upright_board_drive(const upright_output *output)
{
    motor = *output; /* enable, direction, PWM */
}

void upright_board_feed_watchdog(void)
{
    /* The emulator has none. */
}

uint32_t upright_board_cycles(void)
{
    return 0; /* as in a simulation on the host, because it is sent */
}

float upright_board_tick_s(void)
{
    return TICK_S;
}

void upright_board_stop(void)
{
    exit(3);
}

/* The serial line, below the tick: what has been received, and then all that waits. */
static void serve_line(const uint8_t *received, size_t number, FILE *out)
{
    static uint8_t sent[4096];
    uint16_t length = 0;
    uint32_t frame_length;
    const uint8_t *frame;
    for (size_t at = 0; at < number; at++)
        upright_receive(received[at]);
    while ((frame = upright_transmit(&frame_length)), frame_length > 0)
        for (uint32_t at = 0; at < frame_length && length < sizeof sent; at++)
            sent[length++] = frame[at];
    fwrite(&length, sizeof length, 1, out);
    fwrite(sent, 1, length, out);
}

int main(void)
{
    FILE *in = fopen("wires.in", "rb"), *out = fopen("wires.out", "wb");
    uint8_t number, received[255];
    if (!in || !out || !upright_start(UPRIGHT_POWER_ON))
        return 1;
    while (fread(&wires, sizeof wires, 1, in) == 1) {
        if (fread(&number, 1, 1, in) != 1 || fread(received, 1, number, in) != number)
            return 2;
        upright_tick();
        fwrite(&motor, sizeof motor, 1, out);
        serve_line(received, number, out);
    }
    return fclose(out) == 0 ? 0 : 2;
}
