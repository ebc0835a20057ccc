// Gives the pulses of a tick on pin 9 (PB1) of an ATmega328P, their direction on pin 8 (PB0), by timer 1, which runs
// through at a half microsecond per count.

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>
#include <util/atomic.h>
#include <util/delay.h>

static volatile uint32_t given; // all pulses so far: those along +x added, the others subtracted
static volatile uint8_t left;   // pulses of this tick that are not yet given
static uint16_t interval;       // counts of the timer between two pulses
static int8_t sense;            // what a pulse adds

static void start_timer(void)
{
    DDRB |= _BV(PB0) | _BV(PB1);
    TCCR1A = 0;
    TCCR1B = _BV(CS11);
}

ISR(TIMER1_COMPA_vect)
{
    PORTB |= _BV(PB1);
    OCR1A += interval;
    given += (uint32_t)(int32_t)sense;
    if (--left == 0) {
        TIMSK1 &= (uint8_t)~_BV(OCIE1A);
    }
    _delay_us(2); // the shortest pulse of common drivers
    PORTB &= (uint8_t)~_BV(PB1);
}

// The counts of the timer. Its two bytes must not be read with an interrupt between them.
static uint16_t timer(void)
{
    uint16_t counts;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { counts = TCNT1; }
    return counts;
}

// Gives so many pulses, evenly spread from now until the timer is at `until`; false if they are more than 255, or if
// earlier ones are still to be given.
static bool give(int32_t pulses, uint16_t until)
{
    uint32_t count = (uint32_t)(pulses < 0 ? -pulses : pulses);
    if (left > 0 || count > 255) {
        return false;
    }
    if (count == 0) {
        return true;
    }
    sense = pulses < 0 ? -1 : 1;
    PORTB = (uint8_t)((PORTB & ~_BV(PB0)) | (pulses < 0 ? _BV(PB0) : 0));
    uint16_t now = timer();
    interval = (uint16_t)((uint16_t)(until - now) / count);
    left = (uint8_t)count;
    // Half an interval before the first pulse: drivers want to know the direction some microseconds earlier.
    OCR1A = (uint16_t)(now + interval / 2);
    TIFR1 = _BV(OCF1A);
    TIMSK1 |= _BV(OCIE1A);
    return true;
}

static uint32_t pulses_given(void)
{
    uint32_t counts;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { counts = given; }
    return counts;
}
