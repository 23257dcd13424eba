#include "home.h"

#include <avr/interrupt.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "motion.h"
#include "protocol.h"

#define SETTLE 100 /* [ms] of rest between two ways */
#define FAR 5 /* pull-offs within which a switch must close again, and open once more */

enum { SEEK, LEAVE, APPROACH, AWAY, PHASES };

static struct home home;
static uint8_t axis, phase;
static uint16_t rest; /* [ms] */
static int32_t from, closed; /* counts of motor 1 where a way began; where the switch last was open */
static int32_t at[2][2]; /* counts where the switches opened */
static volatile uint8_t wanted, bearable; /* pins of switches: that end the way, that may be open */
static volatile uint8_t hit;

static uint8_t own(void) { return axis ? SWITCH_Y_PIN : SWITCH_X_PIN; }

static uint8_t to_switch(void) { return phase == SEEK || phase == APPROACH; }

static int32_t place_of_motor(void)
{
	int32_t counts[2];
	drive_counts(counts);
	return counts[0];
}

/* both motors alike move x, against each other y */
static void go(int32_t rate)
{
	int32_t rates[2] = { rate, axis ? -rate : rate };
	from = closed = place_of_motor();
	cli();
	hit = 0;
	wanted = to_switch() ? own() : 0;
	bearable = own();
	if (state == HOMING) drive_set_rates(rates);
	sei();
}

static void stand(void)
{
	static const int32_t none[2];
	cli();
	drive_set_rates(none);
	sei();
	rest = SETTLE;
}

static void start_phase(void)
{
	int32_t seek = home.seek[axis], slow = seek < 0 ? -home.slow : home.slow;
	go(phase == SEEK ? seek : phase == APPROACH ? slow : -seek);
}

void home_tick(void)
{
	static const int32_t none[2];
	uint8_t open = SWITCHES_HIGH;
	if (open & ~bearable) {
		motion_cut(BY_LIMIT_SWITCH);
	} else if ((open & wanted) && !hit) {
		hit = 1;
		drive_counts(at[axis]);
		drive_set_rates(none);
	}
}

/* the place of the switches is known: so is that of the carriage */
static void finish(void)
{
	int32_t counts[2];
	int32_t x = home.place[0] - (at[0][0] + at[0][1]), y = home.place[1] - (at[1][0] - at[1][1]);
	cli();
	if (state == HOMING) {
		state = IDLE;
		drive_counts(counts);
		counts[0] += (x + y) / 2;
		counts[1] += (x - y) / 2;
		drive_set_counts(counts);
		position_known = 1;
	}
	sei();
}

static void next_phase(void)
{
	if (phase == APPROACH && !(SWITCHES_HIGH & own())) {
		motion_cut(BY_HOMING); /* it opened for a moment only */
		return;
	}
	if (++phase == PHASES) {
		phase = SEEK;
		if (++axis == 2) {
			finish();
			return;
		}
	}
	start_phase();
}

/* whether the way has come to its end; one that leads nowhere is cut off */
static uint8_t arrived(void)
{
	int32_t now = place_of_motor(), moved = labs(now - from);
	if (to_switch()) {
		if (!hit && moved > (phase == SEEK ? home.travel[axis] : FAR * home.pull)) motion_cut(BY_HOMING);
		return hit;
	}
	if (SWITCHES_HIGH & own()) {
		closed = now;
		if (moved > FAR * home.pull) motion_cut(BY_HOMING);
	}
	return labs(now - closed) >= home.pull;
}

void home_millisecond(void)
{
	if (rest) {
		if (!--rest) next_phase();
	} else if (arrived()) {
		stand();
	}
}

static uint8_t too_fast(int32_t rate)
{
	uint32_t size = labs(rate);
	return !size || size > config.rate || size > config.jump || size > FASTEST;
}

uint8_t home_begin(const uint8_t *body, uint8_t length)
{
	if (length != sizeof home) return REFUSED_FORM;
	if (state == HOMING) return NOTHING; /* its reply was lost */
	if (state != ARMED || queue_head != queue_tail) return REFUSED_STATE;
	memcpy(&home, body, sizeof home);
	if (too_fast(home.seek[0]) || too_fast(home.seek[1]) || too_fast(home.slow)) return BY_RATE;
	if (home.pull < 1 || home.travel[0] < 1 || home.travel[1] < 1) return REFUSED_FORM;
	axis = phase = rest = 0;
	position_known = 0;
	fault = NOTHING;
	state = HOMING;
	start_phase();
	return NOTHING;
}
