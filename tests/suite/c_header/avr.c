/* Replays a recorded run on an AVR: recording.h has the readings of the counters from the tick in which it is armed, as
   changes from tick to tick, and the steps of the set-point. Sends over the serial line: the hash of everything that the
   controller reports while it balances, and the mean and the largest number of cycles of its ticks. */

/* As on the simulated bench: 32 bits for the cart, 16 for the links. */
#define UPRIGHT_COUNTERS_OF_16_BITS 0x7ffeul
#include "controller.h"
#include "recording.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

static uint32_t hash = 2166136261ul;

static void add(uint32_t word) { hash = (hash ^ word) * 16777619ul; }

static void add_all(const float *values, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        uint32_t word;
        memcpy(&word, values + i, sizeof word);
        add(word);
    }
}

static void send(uint32_t number, char end)
{
    char digits[11];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    digits[10] = end;
    while (count) {
        while (!(UCSR0A & _BV(UDRE0))) {}
        UDR0 = digits[--count];
    }
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = digits[10];
}

static void report(const upright_controller *c, float duty)
{
    add(c->fault);
    add_all(&duty, 1);
    add_all(&c->requested_n, 1);
    add_all(&c->applied_n, 1);
    add_all(&c->setpoint_m, 1);
    add_all(c->estimate, UPRIGHT_STATES);
    add_all(c->innovation, UPRIGHT_SENSORS);
}

int main(void)
{
    static upright_controller c;
    uint32_t raw[UPRIGHT_SENSORS], sum = 0, worst = 0, balanced = 0;
    TCCR1B = _BV(CS11); /* counts every eighth cycle */
    UCSR0B = _BV(TXEN0);
    upright_init(&c);
    upright_home(&c, at_rest, upright_table.rest_counts);
    /* No faster than a link turns. */
    memcpy(raw, at_rest, sizeof raw);
    for (bool is_there = false; !is_there; upright_control(&c, raw)) {
        is_there = true;
        for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
            int16_t left = (int16_t)(before_arming[i] - raw[i]);
            raw[i] += (uint32_t)(int32_t)(left > 40 ? 40 : left < -40 ? -40 : left);
            is_there = is_there && left == 0;
        }
    }
    upright_arm(&c);
    memcpy(raw, before_arming, sizeof raw);
    for (uint16_t tick = 0; tick < TICKS; tick++) {
        for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
            raw[i] += (uint32_t)(int32_t)(int8_t)pgm_read_byte(&moved[tick][i]);
        }
        upright_set_setpoint(&c, tick >= STEP_AT && tick < STEP_UNTIL ? STEP_M : 0.0f);
        TCNT1 = 0;
        float duty = upright_control(&c, raw);
        uint16_t first_half = TCNT1;
        if (c.state == UPRIGHT_BALANCING) {
            report(&c, duty);
        }
        TCNT1 = 0;
        upright_predict(&c);
        uint32_t cycles = 8ul * ((uint32_t)first_half + TCNT1);
        if (c.state == UPRIGHT_BALANCING) {
            sum += cycles / 8;
            balanced++;
            worst = cycles > worst ? cycles : worst;
        }
    }
    send(hash, ' ');
    send(balanced, ' ');
    send(sum / balanced * 8, ' ');
    send(worst, '\n');
    cli();
    sleep_cpu(); /* ends the simulator */
    for (;;) {}
}
