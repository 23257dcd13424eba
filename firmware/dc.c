/* Two dc motors: 20 kHz PWM with direction, quadrature encoders, a position loop at 1 kHz.
 *
 * u = kp (reference - count) + kd (rate - counts per tick), limited; the reference is what the
 * segments say. A motor that does not follow is cut off. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <string.h>

#include "encoder.h"
#include "home.h"
#include "motion.h"
#include "protocol.h"

#define PWM_TOP 799 /* 16 MHz / 800 = 20 kHz */
#define FAR 32000 /* [1/256 count] errors beyond it count as this much */
#define PATIENCE 20 /* [ms] for which a motor may be too far from its reference */

static struct gains gains;
static int64_t reference[2]; /* 2^-FRACTION_BITS count */
static int32_t rate[2], last_count[2];
static int16_t volts[2]; /* [mV] */
static uint16_t ticks_left;
static uint8_t astray[2];
static volatile uint16_t longest;

static void apply(uint8_t m, int16_t mv)
{
	uint16_t size = mv < 0 ? -mv : mv;
	uint16_t width = gains.supply ? (uint32_t)size * PWM_TOP / gains.supply : 0;
	uint8_t pin = m ? _BV(PD6) : _BV(PD5);
	volts[m] = mv;
	if (mv < 0) PORTD |= pin;
	else PORTD &= ~pin;
	if (m) OCR1B = width;
	else OCR1A = width;
	/* a width of 0 still gives one clock of pulse: the pin is taken from the timer instead */
	uint8_t output = m ? _BV(COM1B1) : _BV(COM1A1);
	if (width) TCCR1A |= output;
	else TCCR1A &= ~output;
}

static int32_t clipped(int32_t value, int32_t limit)
{
	return value > limit ? limit : value < -limit ? -limit : value;
}

/* the loop of one motor; gains are mV per count, in 1/256 */
static void control(uint8_t m)
{
	int32_t now = encoder_get(m), moved = now - last_count[m];
	int64_t away = reference[m] - ((int64_t)now << FRACTION_BITS)
		- ((int64_t)1 << (FRACTION_BITS - 1));
	int32_t error = away >> (FRACTION_BITS - 8);
	int32_t slip = (rate[m] >> (FRACTION_BITS - 8)) - (moved << 8);
	last_count[m] = now;
	int32_t limit = (int32_t)gains.astray << 8;
	if (error > limit || error < -limit) {
		if (++astray[m] > PATIENCE) motion_cut(BY_ENCODER);
	} else {
		astray[m] = 0;
	}
	int32_t mv = ((clipped(error, FAR) * gains.kp) >> 16) + ((clipped(slip, FAR) * gains.kd) >> 16);
	apply(m, clipped(mv, gains.largest));
}

static void advance(void)
{
	reference[0] += rate[0];
	reference[1] += rate[1];
}

static void run(void)
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
		volatile struct segment *next = &queue[queue_tail++ & (QUEUE - 1)];
		ticks_left = next->ticks;
		rate[0] = next->rate[0];
		rate[1] = next->rate[1];
		if (!ticks_left) {
			state = ARMED;
			return;
		}
	}
	ticks_left--;
	advance();
}

static uint8_t limp(void)
{
	uint8_t cut = fault == BY_ESTOP_FRAME || fault == BY_ESTOP_PIN || fault == BY_LIMIT_SWITCH
		|| fault == BY_ENCODER || fault == BY_COUNTS;
	return state == IDLE || (state == FAULT && cut);
}

/* before anybody knows the place, as when the encoders' supply comes on, nothing is lost with it */
static void lost_count(void)
{
	if (state == IDLE && !position_known) encoder_resume();
	else if (state != FAULT) motion_cut(BY_COUNTS);
	position_known = 0;
}

/* interrupts stay on inside: the encoders must not wait for the loop */
ISR(TIMER2_COMPA_vect, ISR_NOBLOCK)
{
	cli();
	tick++;
	encoder_tick();
	sei();
	if (!encoder_counts()) lost_count();
	if (ESTOP_HIGH) {
		PORTB |= DRIVERS_OFF_PIN;
		if (state != FAULT || fault != BY_ESTOP_PIN) motion_cut(BY_ESTOP_PIN);
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
	for (uint8_t m = 0; m < 2; m++) {
		if (limp()) apply(m, 0), last_count[m] = encoder_get(m);
		else control(m);
	}
	uint16_t now = (uint16_t)TCNT2 * 64;
	if (now > longest) longest = now;
}

void drive_begin(void)
{
	PORTB = DRIVERS_OFF_PIN;
	DDRB = DRIVERS_OFF_PIN | _BV(PB1) | _BV(PB2);
	PORTD = _BV(PD2) | _BV(PD3) | _BV(PD4); /* pull-ups of the switches */
	DDRD = _BV(PD5) | _BV(PD6);
	encoder_begin();
	ICR1 = PWM_TOP;
	TCCR1A = _BV(WGM11);
	TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS10);
	OCR2A = F_CPU / 64 / TICK_HZ - 1;
	TCCR2A = _BV(WGM21);
	TCCR2B = _BV(CS22);
	TIMSK2 = _BV(OCIE2A);
}

uint8_t drive_gains(const uint8_t *body, uint8_t length)
{
	struct gains given;
	if (length != sizeof given) return REFUSED_FORM;
	memcpy(&given, body, sizeof given);
	if (given.largest > INT16_MAX) return REFUSED_FORM; /* voltages are 16 bits of millivolts */
	gains = given;
	return NOTHING;
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
	counts[0] = encoder_get(0);
	counts[1] = encoder_get(1);
	SREG = saved;
}

void drive_set_counts(const int32_t counts[2])
{
	uint8_t saved = SREG;
	cli();
	for (uint8_t m = 0; m < 2; m++) {
		encoder_set(m, counts[m]);
		last_count[m] = counts[m];
	}
	SREG = saved;
}

void drive_rates(int32_t rates[2])
{
	rates[0] = rate[0];
	rates[1] = rate[1];
}

void drive_set_rates(const int32_t rates[2])
{
	rate[0] = rates[0];
	rate[1] = rates[1];
}

void drive_reset(void)
{
	ticks_left = 0;
	encoder_resume();
	for (uint8_t m = 0; m < 2; m++) {
		rate[m] = 0;
		astray[m] = 0;
		last_count[m] = encoder_get(m);
		reference[m] = ((int64_t)last_count[m] << FRACTION_BITS) + ((int64_t)1 << (FRACTION_BITS - 1));
	}
}

void drive_volts(int16_t out[2])
{
	cli();
	out[0] = volts[0];
	out[1] = volts[1];
	sei();
}

uint16_t drive_longest(void)
{
	cli();
	uint16_t cycles = longest;
	sei();
	return cycles;
}
