/* Gives recorded pulses on an AVR, tick by tick. The simulator writes what its pins do to pulses.vcd: pulses, direction,
   and another pin that changes with every tick. Sends over the serial line the number of ticks in which the counter of
   pulses is wrong, or pulses are late; then the number of ticks twice, and 0. */

#define F_CPU 16000000ul
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include "/usr/include/simavr/avr/avr_mcu_section.h"
#include <stdbool.h>

#include "pulses.h"
#include "recording.h"

AVR_MCU(F_CPU, "atmega328p");
AVR_MCU_VCD_FILE("pulses.vcd", 1);
AVR_MCU_VCD_PORT_PIN('B', 1, "pulse");
AVR_MCU_VCD_PORT_PIN('B', 0, "direction");
AVR_MCU_VCD_PORT_PIN('B', 2, "tick");

static void send(uint16_t number, char end)
{
    char digits[5];
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

int main(void)
{
    uint16_t wrong = 0;
    int32_t expected = 0;
    UCSR0B = _BV(TXEN0);
    start_timer();
    DDRB |= _BV(PB2);
    sei();
    uint16_t due = timer();
    for (uint16_t tick = 0; tick < TICKS; tick++) {
        while ((uint16_t)(timer() - due) >= 0x8000) {}
        due += PERIOD;
        PINB = _BV(PB2); /* the other level */
        wrong += pulses_given() != (uint32_t)expected;
        int8_t pulses = (int8_t)pgm_read_byte(&recorded[tick]);
        expected += pulses;
        /* As long as the controller computes. */
        _delay_us(1500);
        wrong += !give(pulses, due);
    }
    while ((uint16_t)(timer() - due) >= 0x8000) {}
    send(wrong, ' ');
    send(TICKS, ' ');
    send(TICKS, ' ');
    send(0, '\n');
    cli();
    sleep_cpu(); /* ends the simulator */
    for (;;) {}
}
