/* Two step/direction channels. The whole step generator is the interrupt of timer 1. */
#include <avr/interrupt.h>
#include <avr/io.h>

#include "home.h"
#include "motion.h"
#include "protocol.h"

#define STEPS (STEP_A | STEP_B)

static volatile int32_t count_a, count_b;
static uint32_t fraction_a, fraction_b;
static int32_t rate_a, rate_b;
static uint16_t ticks_left;
static uint8_t pulses, backward_a, backward_b;
static volatile uint16_t longest;

/* rates and their directions; a direction stays while its rate is zero */
static inline void turn(int32_t a, int32_t b)
{
	uint8_t port = PORTD;
	rate_a = a;
	rate_b = b;
	if (rate_a < 0) backward_a = 1, port |= DIRECTION_A;
	else if (rate_a > 0) backward_a = 0, port &= ~DIRECTION_A;
	if (rate_b < 0) backward_b = 1, port |= DIRECTION_B;
	else if (rate_b > 0) backward_b = 0, port &= ~DIRECTION_B;
	PORTD = port;
}

/* the next segment; none without ticks */
static inline uint8_t load(void)
{
	volatile struct segment *next = &queue[queue_tail & (QUEUE - 1)];
	ticks_left = next->ticks;
	turn(next->rate[0], next->rate[1]);
	queue_tail++;
	return ticks_left != 0;
}

/* P += rate; a step where its whole part changes */
static inline void advance(void)
{
	uint32_t before = fraction_a;
	fraction_a += rate_a;
	if (backward_a ? fraction_a > before : fraction_a < before) pulses = STEP_A;
	before = fraction_b;
	fraction_b += rate_b;
	if (backward_b ? fraction_b > before : fraction_b < before) pulses |= STEP_B;
}

static inline void run(void)
{
	if (SWITCHES_HIGH) {
		motion_cut(BY_LIMIT_SWITCH);
		return;
	}
	if (!ticks_left) {
		if (queue_tail == queue_head) {
			motion_stop(BY_UNDERRUN);
			return;
		}
		if (!load()) {
			state = ARMED;
			return;
		}
	}
	ticks_left--;
	advance();
}

ISR(TIMER1_COMPA_vect)
{
	/* edges first: their jitter is the latency of this interrupt and nothing else */
	PORTD = (PORTD & ~STEPS) | pulses;
	if (pulses & STEP_A) count_a += backward_a ? -1 : 1;
	if (pulses & STEP_B) count_b += backward_b ? -1 : 1;
	pulses = 0;
	tick++;
	if (ESTOP_HIGH) {
		PORTB |= DRIVERS_OFF_PIN;
		if (state != FAULT || fault != BY_ESTOP_PIN) motion_cut(BY_ESTOP_PIN);
		position_known = 0;
	} else if (state == RUNNING) {
		run();
	} else if (state == STOPPING) {
		if (SWITCHES_HIGH) motion_cut(BY_LIMIT_SWITCH);
		else advance();
	} else if (state == HOMING) {
		home_tick();
		advance();
	} else if (state == ARMED && start_set && (int32_t)(tick - start_tick) >= 0) {
		start_set = 0;
		state = RUNNING;
	}
	uint16_t now = TCNT1;
	if (now > longest) longest = now;
}

void drive_begin(void)
{
	PORTB = DRIVERS_OFF_PIN | _BV(PB1) | _BV(PB2); /* drivers off, pull-ups of the switches */
	DDRB = DRIVERS_OFF_PIN;
	PORTC = _BV(PC0);
	DDRD = STEPS | DIRECTION_A | DIRECTION_B;
	OCR1A = F_CPU / TICK_HZ - 1;
	TCCR1B = _BV(WGM12) | _BV(CS10);
	TIMSK1 = _BV(OCIE1A);
}

void drive_enable(uint8_t on)
{
	uint8_t saved = SREG;
	cli();
	if (on) PORTB &= ~DRIVERS_OFF_PIN;
	else PORTB |= DRIVERS_OFF_PIN;
	SREG = saved;
}

uint8_t drive_enabled(void) { return !(PORTB & DRIVERS_OFF_PIN); }

void drive_counts(int32_t counts[2])
{
	uint8_t saved = SREG;
	cli();
	counts[0] = count_a;
	counts[1] = count_b;
	SREG = saved;
}

void drive_set_counts(const int32_t counts[2])
{
	uint8_t saved = SREG;
	cli();
	count_a = counts[0];
	count_b = counts[1];
	SREG = saved;
}

void drive_rates(int32_t rates[2])
{
	rates[0] = rate_a;
	rates[1] = rate_b;
}

void drive_set_rates(const int32_t rates[2])
{
	turn(rates[0], rates[1]);
	if (!rate_a && !rate_b) pulses = 0;
}

void drive_reset(void)
{
	rate_a = rate_b = 0;
	ticks_left = 0;
	pulses = 0;
	fraction_a = fraction_b = 0x80000000UL;
}

void drive_volts(int16_t volts[2]) { volts[0] = volts[1] = 0; }

uint16_t drive_longest(void)
{
	cli();
	uint16_t cycles = longest;
	sei();
	return cycles;
}
