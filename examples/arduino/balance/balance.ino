// Balances a cart with one link on an Arduino Uno (ATmega328P, 16 MHz), with the header that
//
//     cargo upright export rigs/single-quanser-ip02.toml --c examples/arduino/balance/controller.h
//
// writes beside this sketch. Wires:
//
//     2, 3    encoder of the cart, A and B       7    enable of the motor's driver, with a resistor to ground
//     4, 5    encoder of the link, A and B       8    its direction        9    its PWM, 20 kHz
//     10      button to ground                   11, 12    limit switches to ground, normally closed
//
// Once, while the link hangs still and the cart is in the middle, press the button: the rig is homed. Hold the link
// upright and press: it balances as soon as the link has been still for UPRIGHT_ARM_S. Press again to end it, or after
// a fault, which blinks on the board, to clear it.
//
// Nothing here checks signs: with the motor off, push the cart and turn the link, and watch the counts; then push the
// cart with a small duty. And wire an emergency stop that cuts the motor's supply.

#define UPRIGHT_COUNTERS_OF_16_BITS 3ul
#include "controller.h"
#include <avr/wdt.h>

static_assert(UPRIGHT_SENSORS == 2, "this sketch has two encoders: cart and one link");

static const uint8_t ENABLE = 7, DIRECTION = 8, PWM = 9, BUTTON = 10, LIMIT_LOW = 11, LIMIT_HIGH = 12;
static const uint16_t FULL = 400; // 16 MHz / 2 / 400 = 20 kHz
static const uint32_t PERIOD_US = (uint32_t)(UPRIGHT_TICK_S * 1e6f + 0.5f);
static const uint8_t DEBOUNCED = (uint8_t)(0.05f / UPRIGHT_TICK_S); // ticks for which the button has to be pressed

static upright_controller controller;
static volatile uint16_t counts[2];
static uint8_t channels;

// What a change of the channels adds to a counter: old A and B, then new A and B.
static const int8_t STEP[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0};

static uint8_t read_channels() { return (PIND >> 2) & 15; }

ISR(PCINT2_vect)
{
    uint8_t now = read_channels();
    counts[0] += STEP[(channels & 3) << 2 | (now & 3)];
    counts[1] += STEP[(channels & 12) | now >> 2];
    channels = now;
}

static void drive(float duty, bool on)
{
    digitalWrite(DIRECTION, duty < 0.0f);
    OCR1A = on ? (uint16_t)((duty < 0.0f ? -duty : duty) * FULL) : 0;
    digitalWrite(ENABLE, on);
}

void setup()
{
    pinMode(ENABLE, OUTPUT);
    pinMode(DIRECTION, OUTPUT);
    pinMode(PWM, OUTPUT);
    pinMode(LED_BUILTIN, OUTPUT);
    static const uint8_t INPUTS[] = {2, 3, 4, 5, BUTTON, LIMIT_LOW, LIMIT_HIGH};
    for (uint8_t pin : INPUTS) {
        pinMode(pin, INPUT_PULLUP);
    }
    // Timer 1: phase-correct PWM with ICR1 as the top.
    TCCR1A = _BV(COM1A1) | _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(CS10);
    ICR1 = FULL;
    channels = read_channels();
    PCMSK2 = _BV(2) | _BV(3) | _BV(4) | _BV(5);
    PCICR = _BV(PCIE2);
    upright_init(&controller);
    // A program that hangs is reset, which turns the driver off.
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

// Steady light: the motor is on. After a fault it blinks as often as docs/c-header.md says, then pauses.
static bool light(uint16_t tick)
{
    uint8_t blinks = upright_blinks(controller.fault);
    uint16_t phase = (uint16_t)(tick * UPRIGHT_TICK_S * 4.0f) % (2 * (blinks + 3));
    return controller.state == UPRIGHT_BALANCING || (phase % 2 && phase / 2 < blinks);
}

void loop()
{
    static uint32_t due = micros();
    static uint16_t tick = 0;
    static uint8_t held = 0;
    static bool wants_to_balance = false;
    if ((int32_t)(micros() - due) < 0) {
        return;
    }
    bool is_late = micros() - due > PERIOD_US;
    due = is_late ? micros() : due + PERIOD_US;
    tick++;
    wdt_reset();
    noInterrupts();
    const uint32_t raw[UPRIGHT_SENSORS] = {counts[0], counts[1]};
    interrupts();
    if (controller.state == UPRIGHT_BALANCING && is_late) {
        upright_trip(&controller);
    }
    if (controller.state == UPRIGHT_BALANCING && (digitalRead(LIMIT_LOW) || digitalRead(LIMIT_HIGH))) {
        upright_trip_at_switch(&controller);
    }
    float duty = upright_control(&controller, raw);
    drive(duty, upright_motor_is_on(&controller));
    upright_predict(&controller);
    if (controller.state == UPRIGHT_FAULT) {
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
