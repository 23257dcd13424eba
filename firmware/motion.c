#include "motion.h"

#include <avr/interrupt.h>
#include <string.h>

#include "home.h"
#include "protocol.h"

struct config config = { 0, 0, 0, 0, 0, 0, 0, 1, 200, 10 }; /* until CONFIG comes nothing may move */
volatile uint8_t state, fault, position_known;
volatile uint32_t tick, start_tick;
volatile uint8_t start_set;
volatile struct segment queue[QUEUE];
volatile uint8_t queue_head, queue_tail;
uint16_t next_frame;

/* where the last accepted segment ends */
struct end {
	int64_t position[2];
	struct segment last;
};
static struct end end;

static volatile uint16_t silent_ms;
static volatile uint8_t ramp_fresh;

void motion_heard(void) { silent_ms = 0; }

void motion_stop(uint8_t cause)
{
	uint8_t saved = SREG;
	cli();
	if (state == RUNNING || state == HOMING) {
		state = STOPPING;
		fault = cause;
		ramp_fresh = 1;
	} else if (state == ARMED) {
		state = FAULT;
		fault = cause;
	}
	SREG = saved;
}

void motion_cut(uint8_t cause)
{
	static const int32_t none[2];
	uint8_t saved = SREG;
	cli();
	uint8_t moved = state == RUNNING || state == STOPPING;
	if (cause == BY_ENCODER || cause == BY_COUNTS || (ENCODERLESS && moved)) position_known = 0;
	if (state != FAULT || cause == BY_ESTOP_PIN || cause == BY_ESTOP_FRAME) fault = cause;
	state = FAULT;
	drive_set_rates(none);
	SREG = saved;
}

void motion_reset(void)
{
	int32_t counts[2];
	cli();
	queue_head = queue_tail = 0;
	start_set = 0;
	drive_reset();
	sei();
	drive_counts(counts);
	next_frame = 0;
	memset(&end, 0, sizeof end);
	for (uint8_t m = 0; m < 2; m++)
		end.position[m] = ((int64_t)counts[m] << FRACTION_BITS) + ((int64_t)1 << (FRACTION_BITS - 1));
}

static uint32_t magnitude(int32_t rate) { return rate < 0 ? -(uint32_t)rate : (uint32_t)rate; }

static uint8_t rate_fault(const struct segment *next, const struct end *from, uint8_t m)
{
	int32_t now = next->rate[m], before = from->last.rate[m];
	uint16_t shorter = next->ticks < from->last.ticks ? next->ticks : from->last.ticks;
	uint64_t allowed = config.jump + (uint64_t)config.acceleration * shorter;
	uint32_t change = now > before ? (uint32_t)now - before : (uint32_t)before - now;
	if (magnitude(now) > config.rate || magnitude(now) > FASTEST) return BY_RATE;
	if (change > allowed) return BY_ACCELERATION;
	if (KIND == 'S' && ((now < 0 && before > 0) || (now > 0 && before < 0))) return BY_REVERSAL;
	return NOTHING;
}

static uint8_t outside(int64_t a, int64_t b)
{
	return a + b < config.lower_x || a + b > config.upper_x || a - b < config.lower_y
		|| a - b > config.upper_y;
}

/* check one segment and go to its end */
static uint8_t advance(struct end *from, const struct segment *next)
{
	if (next->ticks == 0 && (next->rate[0] || next->rate[1])) return BY_RATE;
	for (uint8_t m = 0; m < 2; m++) {
		uint8_t why = rate_fault(next, from, m);
		if (why) return why;
		from->position[m] += (int64_t)next->rate[m] * next->ticks;
	}
	from->last = *next;
	int64_t a = from->position[0] >> FRACTION_BITS, b = from->position[1] >> FRACTION_BITS;
	return outside(a, b) ? BY_POSITION : NOTHING;
}

uint8_t motion_accept(const uint8_t *body, uint8_t length)
{
	uint8_t count = length / SEGMENT_SIZE;
	struct end reached = end;
	struct segment next;
	if (!count || length % SEGMENT_SIZE) return REFUSED_FORM;
	if (count > queue_free()) return REFUSED_FULL;
	for (uint8_t i = 0; i < count; i++) {
		memcpy(&next, body + i * SEGMENT_SIZE, SEGMENT_SIZE);
		uint8_t why = advance(&reached, &next);
		if (why) return why;
		queue[(queue_head + i) & (QUEUE - 1)] = next; /* not visible before the head moves */
	}
	end = reached;
	queue_head += count;
	next_frame++;
	return NOTHING;
}

/* rates go to zero on a straight line, both in the same time */
static void ramp(void)
{
	static int32_t less[2];
	static uint16_t left;
	int32_t rates[2], counts[2];
	cli();
	drive_rates(rates);
	sei();
	if (ramp_fresh) {
		uint32_t a = magnitude(rates[0]), b = magnitude(rates[1]);
		uint32_t steps = (a > b ? a : b) / (config.brake ? config.brake : 1) + 1;
		left = steps > 2000 ? 2000 : steps;
		less[0] = rates[0] / left;
		less[1] = rates[1] / left;
		ramp_fresh = 0;
	}
	left--;
	drive_counts(counts);
	if (!left || outside(counts[0], counts[1])) {
		uint8_t sudden = magnitude(rates[0]) > config.jump || magnitude(rates[1]) > config.jump;
		if (ENCODERLESS && sudden) position_known = 0;
		rates[0] = rates[1] = left = 0;
	} else {
		rates[0] -= less[0], rates[1] -= less[1];
	}
	cli();
	if (state == STOPPING) {
		drive_set_rates(rates);
		if (!left) state = FAULT;
	}
	sei();
}

void motion_millisecond(void)
{
	uint8_t live = state == ARMED || state == RUNNING || state == HOMING;
	if (live && ++silent_ms > config.watchdog) motion_stop(BY_WATCHDOG);
	if (state == STOPPING) ramp();
	if (state == HOMING) home_millisecond();
}
