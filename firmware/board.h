/* Pins and clocks of the two builds, both for an ATmega328P at 16 MHz (Arduino Uno, Nano).
 *
 * Stepper pins are those of the Arduino CNC shield. Switches are normally closed to ground with the
 * pull-up on: an open switch or a broken wire reads high and stops the machine. */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>

#define BAUD 500000UL /* exact at 16 MHz */
#define QUEUE 64 /* segments, a power of two */

#ifdef DC
#define KIND 'D'
#define ENCODERLESS 0
#define TICK_HZ 1000UL
#define FRACTION_BITS 20 /* 1 count = 2^20 */
#define FASTEST (40UL << FRACTION_BITS) /* of a reference; both encoders are followed to 50 a tick */
#define ESTOP_HIGH (PIND & _BV(PD4))
#define SWITCHES_HIGH (PIND & (_BV(PD2) | _BV(PD3)))
#define SWITCH_X_PIN _BV(PD2)
#define SWITCH_Y_PIN _BV(PD3)
#else
#define KIND 'S'
#define ENCODERLESS 1 /* counts are commands: after a sudden stop nobody knows the place */
#define TICK_HZ 25000UL /* a step is high for one tick, 40 us: the TB6560 wants 30 us */
#define FRACTION_BITS 32 /* 1 step = 2^32 */
#define FASTEST 0x7fffffffUL /* half a step a tick: one high, one low */
#define STEP_A _BV(PD2)
#define STEP_B _BV(PD3)
#define DIRECTION_A _BV(PD5)
#define DIRECTION_B _BV(PD6)
#define ESTOP_HIGH (PINC & _BV(PC0))
#define SWITCHES_HIGH (PINB & (_BV(PB1) | _BV(PB2)))
#define SWITCH_X_PIN _BV(PB1)
#define SWITCH_Y_PIN _BV(PB2)
#endif

#define DRIVERS_OFF_PIN _BV(PB0) /* high: drivers off */

#endif
