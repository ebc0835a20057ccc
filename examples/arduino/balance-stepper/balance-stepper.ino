// Balances a cart with one link, moved by a stepper, on an Arduino Uno (ATmega328P, 16 MHz), with the header that
//
//     cargo upright export rigs/single-stepper.toml --c examples/arduino/balance-stepper/controller.h
//
// writes beside this sketch. Wires:
//
//     2, 3    encoder of the link, A and B       7    enable of the stepper's driver: low turns it on
//     10      button to ground                   8    its direction        9    its pulses
//     11, 12  limit switches to ground, normally closed
//
// Once, while the link hangs still and the cart is in the middle, press the button: the motor holds the cart, and the
// rig is homed. Hold the link upright and press: it balances as soon as the link has been still for UPRIGHT_ARM_S. Press
// again to end it, or after a fault, which blinks on the board, to clear it; then home it again.
//
// Nothing here checks signs: with the motor off, turn the link counter-clockwise, and watch the count grow; then give
// some pulses, and watch the cart move along +x. And wire an emergency stop that cuts the motor's supply.

#define UPRIGHT_COUNTERS_OF_16_BITS 2ul
#include "controller.h"
#include "pulses.h"
#include <avr/wdt.h>

static_assert(UPRIGHT_SENSORS == 2 && UPRIGHT_HAS_STEPS, "this sketch is for a stepper and one link");
static_assert(UPRIGHT_TICK_S <= 0.012f, "a tick of at most 12 ms: the watchdog waits 15 ms");

static const uint8_t ENABLE = 7, BUTTON = 10, LIMIT_LOW = 11, LIMIT_HIGH = 12;
static const uint16_t PERIOD = (uint16_t)(UPRIGHT_TICK_S * 2e6f + 0.5f); // counts of the timer
static const uint8_t DEBOUNCED = (uint8_t)(0.05f / UPRIGHT_TICK_S); // ticks for which the button has to be pressed

static upright_controller controller;
static volatile uint16_t link_counts;
static uint8_t channels;

// What a change of the channels adds to the counter: old A and B, then new A and B.
static const int8_t STEP[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0};

static uint8_t read_channels() { return (PIND >> 2) & 3; }

ISR(PCINT2_vect)
{
    uint8_t now = read_channels();
    link_counts += STEP[channels << 2 | now];
    channels = now;
}

void setup()
{
    digitalWrite(ENABLE, HIGH);
    pinMode(ENABLE, OUTPUT);
    pinMode(LED_BUILTIN, OUTPUT);
    static const uint8_t INPUTS[] = {2, 3, BUTTON, LIMIT_LOW, LIMIT_HIGH};
    for (uint8_t pin : INPUTS) {
        pinMode(pin, INPUT_PULLUP);
    }
    start_timer();
    channels = read_channels();
    PCMSK2 = _BV(2) | _BV(3);
    PCICR = _BV(PCIE2);
    upright_init(&controller);
    // A program that hangs is reset, which turns the driver off if its enable has a resistor to the supply.
    wdt_enable(WDTO_15MS);
}

// The button has been pressed.
static void pressed(bool &wants_to_balance, const uint32_t *raw)
{
    switch (controller.state) {
    case UPRIGHT_NOT_HOMED: upright_home(&controller, raw, upright_table.rest_counts); break;
    case UPRIGHT_READY: wants_to_balance = !wants_to_balance; break;
    case UPRIGHT_FAULT: upright_clear(&controller); break;
    default: wants_to_balance = false; upright_disarm(&controller);
    }
}

// Steady light: it balances. After a fault it blinks as often as docs/c-header.md says, then pauses.
static bool light(uint16_t tick)
{
    uint8_t blinks = upright_blinks(controller.fault);
    uint16_t phase = (uint16_t)(tick * UPRIGHT_TICK_S * 4.0f) % (2 * (blinks + 3));
    return controller.state == UPRIGHT_BALANCING || (phase % 2 && phase / 2 < blinks);
}

void loop()
{
    static uint16_t due = timer();
    static uint16_t tick = 0;
    static uint8_t held = 0;
    static bool wants_to_balance = false;
    uint16_t elapsed = timer() - due;
    if (elapsed >= 0x8000) {
        return; // not yet due
    }
    bool is_late = elapsed > PERIOD / 2;
    due = is_late ? timer() + PERIOD : due + PERIOD;
    tick++;
    wdt_reset();
    noInterrupts();
    const uint32_t raw[UPRIGHT_SENSORS] = {pulses_given(), link_counts};
    interrupts();
    if (controller.state == UPRIGHT_BALANCING && is_late) {
        upright_trip(&controller);
    }
    if (controller.state == UPRIGHT_BALANCING && (digitalRead(LIMIT_LOW) || digitalRead(LIMIT_HIGH))) {
        upright_trip_at_switch(&controller);
    }
    int32_t pulses = upright_control(&controller, raw);
    if (!give(pulses, due)) {
        upright_trip(&controller);
    }
    digitalWrite(ENABLE, !upright_motor_is_on(&controller));
    upright_predict(&controller);
    if (controller.state == UPRIGHT_FAULT || controller.state == UPRIGHT_NOT_HOMED) {
        wants_to_balance = false;
    }
    held = digitalRead(BUTTON) ? 0 : held < 255 ? held + 1 : held;
    if (held == DEBOUNCED) {
        pressed(wants_to_balance, raw);
    }
    if (wants_to_balance && controller.state == UPRIGHT_READY) {
        upright_arm(&controller); // refused until the link is upright
    }
    digitalWrite(LED_BUILTIN, light(tick));
}
