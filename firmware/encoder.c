/* The interrupt adds to 8-bit sums in I/O registers, from tables by (old pins, new pins); the tick
 * adds these to the counts. It is written in assembly because its length bounds the count rate: 66
 * cycles, entry and vector included. */
#include "encoder.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>

#define BEFORE GPIOR0 /* pins at the last edge, in the upper half */
#define MOVED_1 GPIOR1 /* since the last tick */
#define MOVED_2 GPIOR2
#define MISSED 128 /* what an impossible change of pins adds to the events: more than a storm */

/* quadrature state as a place in its turn of four, and the way from one to the next */
#define PLACE(s) ((s) ^ ((s) >> 1))
#define TURN(old, new) ((PLACE((new) & 3) - PLACE((old) & 3)) & 3)
#define MOVE(old, new) (TURN(old, new) == 1 ? 1 : TURN(old, new) == 3 ? 255 : 0)
#define EVENT(old, new) (TURN(old, new) == 2 ? MISSED : TURN(old, new) != 0)

#define MOVE_1(old, new) MOVE(old, new)
#define MOVE_2(old, new) MOVE((old) >> 2, (new) >> 2)
#define EVENTS(old, new) \
	(EVENT(old, new) + EVENT((old) >> 2, (new) >> 2) > MISSED \
			? MISSED : EVENT(old, new) + EVENT((old) >> 2, (new) >> 2))

#define FOUR(f, old, new) f(old, new), f(old, new + 1), f(old, new + 2), f(old, new + 3)
#define ROW(f, old) FOUR(f, old, 0), FOUR(f, old, 4), FOUR(f, old, 8), FOUR(f, old, 12)
#define ROWS(f, old) ROW(f, old), ROW(f, old + 1), ROW(f, old + 2), ROW(f, old + 3)
#define TABLE(f) { ROWS(f, 0), ROWS(f, 4), ROWS(f, 8), ROWS(f, 12) }

static const uint8_t tables[3][256] __attribute__((progmem, aligned(256), used)) = {
	TABLE(MOVE_1), TABLE(MOVE_2), TABLE(EVENTS)
};

static volatile int32_t count[2];
static volatile uint8_t events; /* edges since the last tick */

ISR(PCINT1_vect, ISR_NAKED)
{
	asm volatile(
		"push r24 \n push r25 \n push r30 \n push r31 \n"
		"in r24, __SREG__ \n push r24 \n"
		/* Z: the table of motor 1, at (old pins, new pins) */
		"in r30, %[pins] \n andi r30, %[mask] \n"
		"in r24, %[before] \n mov r25, r30 \n swap r25 \n out %[before], r25 \n"
		"or r30, r24 \n ldi r31, hi8(%[tables]) \n"
		"lpm r24, Z \n in r25, %[moved1] \n add r25, r24 \n out %[moved1], r25 \n"
		"inc r31 \n"
		"lpm r24, Z \n in r25, %[moved2] \n add r25, r24 \n out %[moved2], r25 \n"
		"inc r31 \n"
		"lpm r24, Z \n lds r25, %[events] \n add r25, r24 \n sts %[events], r25 \n"
		"cpi r25, %[storm] + 1 \n brlo 1f \n"
		/* volts off, and no more of these interrupts: they would keep the tick from seeing it */
		"ldi r24, 0 \n sts %[control], r24 \n ldi r24, %[pwm] \n sts %[timer], r24 \n"
		"1: pop r24 \n out __SREG__, r24 \n"
		"pop r31 \n pop r30 \n pop r25 \n pop r24 \n reti"
		:
		: [pins] "I"(_SFR_IO_ADDR(PINC)), [mask] "M"(ENCODERS), [before] "I"(_SFR_IO_ADDR(BEFORE)),
		  [moved1] "I"(_SFR_IO_ADDR(MOVED_1)), [moved2] "I"(_SFR_IO_ADDR(MOVED_2)),
		  [tables] "i"(tables), [events] "i"(&events), [storm] "M"(STORM),
		  [control] "n"(_SFR_MEM_ADDR(PCICR)), [timer] "n"(_SFR_MEM_ADDR(TCCR1A)),
		  [pwm] "M"(_BV(WGM11)));
}

void encoder_begin(void)
{
	PORTC = ENCODERS;
	PCMSK1 = ENCODERS;
	encoder_resume();
}

void encoder_resume(void)
{
	uint8_t saved = SREG;
	cli();
	if (!PCICR) {
		BEFORE = (PINC & ENCODERS) << 4;
		events = 0;
		PCIFR = _BV(PCIF1);
		PCICR = _BV(PCIE1);
	}
	SREG = saved;
}

uint8_t encoder_counts(void) { return PCICR; }

void encoder_tick(void)
{
	count[0] += (int8_t)MOVED_1;
	count[1] += (int8_t)MOVED_2;
	MOVED_1 = MOVED_2 = events = 0;
}

int32_t encoder_get(uint8_t motor)
{
	uint8_t saved = SREG;
	cli();
	int32_t now = count[motor] + (int8_t)(motor ? MOVED_2 : MOVED_1);
	SREG = saved;
	return now;
}

void encoder_set(uint8_t motor, int32_t counts)
{
	count[motor] = counts;
	if (motor) MOVED_2 = 0;
	else MOVED_1 = 0;
}
