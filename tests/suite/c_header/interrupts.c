/* Calls upright_trip() as an interrupt at every moment of every other function: on an AVR by a timer, elsewhere between
   any two statements, after each of which the test has put HOOK. Says how many moments there were, in how many of them
   the trip was lost, so that the motor was not off for it two ticks later, and how many calls were interrupted. */

#include <stdint.h>
#if !defined(__AVR__)
#include <stdio.h>
static void interrupt_if_due(void);
#define HOOK interrupt_if_due()
#endif
#include "controller.h"

static upright_controller c;
static volatile uint8_t has_come;
static uint32_t raw[UPRIGHT_SENSORS], moments, lost, calls;

#if defined(__AVR__)
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#define APART 7u /* cycles */
#define FIRST 24u

ISR(TIMER1_COMPA_vect)
{
    upright_trip(&c);
    has_come = 1;
    TIMSK1 = 0;
}

static void begin(uint32_t moment)
{
    TCCR1B = 0;
    TCNT1 = 0;
    OCR1A = (uint16_t)(FIRST + APART * moment);
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
    TCCR1B = _BV(CS10); /* counts cycles */
}

static void end(void) { TIMSK1 = 0; }

static void say(uint32_t number, char end)
{
    char digits[11];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    while (count) {
        while (!(UCSR0A & _BV(UDRE0))) {}
        UDR0 = digits[--count];
    }
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = end;
}
#else
static volatile uint32_t left;
static volatile bool is_counting;

static void interrupt_if_due(void)
{
    if (is_counting && !has_come && left-- == 0) {
        has_come = 1;
        upright_trip(&c);
    }
}

static void begin(uint32_t moment)
{
    left = moment;
    is_counting = true;
}

static void end(void) { is_counting = false; }

static void say(uint32_t number, char end) { printf("%lu%c", (unsigned long)number, end); }
#endif

static upright_drive tick(void)
{
    upright_drive drive = upright_control(&c, raw);
    upright_predict(&c);
    return drive;
}

/* Homes the hanging links and puts them upright, no faster than links turn, until the next tick balances. */
static void until_armed(void)
{
    for (uint8_t i = 0; i < UPRIGHT_SENSORS; i++) {
        raw[i] = (uint32_t)upright_table.rest_counts[i];
    }
    upright_init(&c);
    upright_home(&c, raw, upright_table.rest_counts);
    while (raw[1] != 0) {
        raw[1]--;
        tick();
    }
    upright_arm(&c);
    while (c.state == UPRIGHT_ARMED && c.slow_ticks + 1 < upright_table.arm_ticks) {
        tick();
    }
}

static void control(void) { upright_control(&c, raw); }
static void predict(void) { upright_predict(&c); }
static void arm(void) { upright_arm(&c); }
static void disarm(void) { upright_disarm(&c); }
static void set(void) { upright_set_setpoint(&c, 0.01f); }
static void choose(void) { upright_select(&c, 0); }
static void home(void) { upright_home(&c, raw, upright_table.rest_counts); }

/* Interrupts `call` at every moment, each time from the state that `c` has now. */
static void interrupt(void (*call)(void))
{
    static upright_controller before;
    uint32_t moment = 0;
    before = c;
    do {
        c = before;
        has_come = 0;
        begin(moment++);
        call();
        end();
        if (has_come) {
            moments++;
            tick();
            upright_drive drive = tick();
            bool is_seen = c.state == UPRIGHT_FAULT && c.fault == UPRIGHT_CALLER;
            lost += !is_seen || drive != 0 || upright_motor_is_on(&c);
        }
    } while (has_come);
    calls += moment > 1;
    c = before;
}

int main(void)
{
#if defined(__AVR__)
    UCSR0B = _BV(TXEN0);
    sei();
#endif
    until_armed();
    interrupt(control); /* which begins to balance */
    interrupt(disarm);
    upright_control(&c, raw);
    interrupt(predict);
    upright_predict(&c);
    interrupt(control);
    interrupt(disarm);
    interrupt(set);
    upright_disarm(&c);
    interrupt(arm);
    interrupt(choose);
    interrupt(home);
    interrupt(control);
    say(moments, ' ');
    say(lost, ' ');
    say(calls, ' ');
    say(0, '\n');
#if defined(__AVR__)
    cli();
    sleep_cpu(); /* ends the simulator */
    for (;;) {}
#endif
    return 0;
}
