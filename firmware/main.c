/* Frames in, frames out, and the millisecond. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <string.h>

#include "board.h"
#include "home.h"
#include "link.h"
#include "motion.h"
#include "protocol.h"

#define HEADER 3 /* [bytes] type and sequence before the body */

struct info {
	uint8_t version, kind, queue, reset_cause, fraction_bits;
	uint32_t tick_hz, cpu_hz, fastest;
} __attribute__((packed));

struct status {
	uint8_t state, fault, flags, free;
	uint16_t next_frame;
	uint16_t frames_bad;
	uint8_t bytes_lost;
	uint32_t tick;
	int32_t counts[2];
	int16_t volts[2]; /* [mV] */
	uint16_t longest; /* [cycles] from a tick to the end of its interrupt, largest so far */
} __attribute__((packed));

static uint8_t reset_cause, configured;

static void send_info(void)
{
	struct info info = { PROTOCOL_VERSION, KIND, QUEUE, reset_cause, FRACTION_BITS, TICK_HZ, F_CPU,
		FASTEST };
	link_send(INFO, &info, sizeof info);
}

static uint8_t flags(void)
{
	uint8_t now = position_known ? POSITION_KNOWN : 0;
	if (drive_enabled()) now |= DRIVERS_ON;
	if (SWITCHES_HIGH & SWITCH_X_PIN) now |= SWITCH_X;
	if (SWITCHES_HIGH & SWITCH_Y_PIN) now |= SWITCH_Y;
	if (ESTOP_HIGH) now |= ESTOP_OPEN;
	return now;
}

static void send_status(void)
{
	struct status status = { .next_frame = next_frame, .frames_bad = frames_bad };
	status.flags = flags();
	status.bytes_lost = bytes_lost;
	status.longest = drive_longest();
	drive_volts(status.volts);
	cli(); /* state, tick and counts of one instant */
	status.state = state;
	status.fault = fault;
	status.free = queue_free();
	status.tick = tick;
	drive_counts(status.counts);
	sei();
	link_send(STATUS, &status, sizeof status);
}

static void send_reply(uint8_t type, uint8_t code)
{
	uint8_t free = queue_free();
	uint8_t body[5] = { type, code, next_frame, next_frame >> 8, free };
	link_send(REPLY, body, sizeof body);
}

static void send_pong(const uint8_t *body)
{
	uint8_t pong[10];
	uint32_t at;
	uint16_t cycles;
	link_stamp(&at, &cycles);
	memcpy(pong, body, 4);
	memcpy(pong + 4, &at, 4);
	memcpy(pong + 8, &cycles, 2);
	link_send(PONG, pong, sizeof pong);
}

static uint8_t on_config(const uint8_t *body, uint8_t length)
{
	if (length != sizeof config) return REFUSED_FORM;
	if (state != IDLE) return REFUSED_STATE;
	memcpy(&config, body, sizeof config);
	configured = 1;
	return NOTHING;
}

/* a body of one byte: for homing, which needs no known place */
static uint8_t on_arm(uint8_t length)
{
	if (length > 1) return REFUSED_FORM;
	if (state == ARMED && !start_set && next_frame == 0) return NOTHING; /* its reply was lost */
	if (state != IDLE || !configured || !(position_known || length)) return REFUSED_STATE;
	if (ESTOP_HIGH) return BY_ESTOP_PIN;
	if (SWITCHES_HIGH) return BY_LIMIT_SWITCH;
	motion_reset();
	drive_enable(1);
	fault = NOTHING;
	state = ARMED;
	return NOTHING;
}

static uint8_t on_run(const uint8_t *body, uint8_t length)
{
	uint32_t at;
	if (length != sizeof at) return REFUSED_FORM;
	memcpy(&at, body, sizeof at);
	if ((state == RUNNING || start_set) && at == start_tick) return NOTHING;
	if (state != ARMED || queue_head == queue_tail) return REFUSED_STATE;
	cli();
	uint8_t ahead = (int32_t)(at - tick) > 1;
	if (ahead) {
		start_tick = at;
		start_set = 1;
	}
	sei();
	return ahead ? NOTHING : REFUSED_FORM;
}

static uint8_t moving(void) { return state == RUNNING || state == STOPPING || state == HOMING; }

static uint8_t on_clear(void)
{
	if (moving()) return REFUSED_STATE;
	if (ESTOP_HIGH) return BY_ESTOP_PIN;
	motion_reset();
	fault = NOTHING;
	state = IDLE;
	return NOTHING;
}

static uint8_t on_origin(const uint8_t *body, uint8_t length)
{
	int32_t counts[2];
	if (length != sizeof counts) return REFUSED_FORM;
	if (state != IDLE) return REFUSED_STATE;
	memcpy(counts, body, sizeof counts);
	drive_set_counts(counts);
	position_known = 1;
	return NOTHING;
}

static uint8_t on_release(void)
{
	if (moving() || state == ARMED) return REFUSED_STATE;
	drive_enable(0);
	if (ENCODERLESS) position_known = 0;
	return NOTHING;
}

static uint8_t on_estop(void)
{
	motion_cut(BY_ESTOP_FRAME);
	drive_enable(0);
	if (ENCODERLESS) position_known = 0;
	return NOTHING;
}

static uint8_t on_segments(const uint8_t *body, uint8_t length)
{
	uint16_t number;
	memcpy(&number, frame + 1, sizeof number);
	if ((state != ARMED && state != RUNNING) || !position_known) return REFUSED_STATE;
	if ((int16_t)(number - next_frame) < 0) return NOTHING; /* we have it already */
	if (number != next_frame) return REFUSED_ORDER;
	uint8_t why = motion_accept(body, length);
	if (why && why < REFUSED_STATE) motion_stop(why);
	return why;
}

static uint8_t command(const uint8_t *body, uint8_t length)
{
	switch (frame[0]) {
	case CONFIG: return on_config(body, length);
	case ARM: return on_arm(length);
	case RUN: return on_run(body, length);
	case STOP: motion_stop(BY_HOST); return NOTHING;
	case ESTOP: return on_estop();
	case CLEAR: return on_clear();
	case ORIGIN: return on_origin(body, length);
	case RELEASE: return on_release();
	case HOME: return home_begin(body, length);
	case SEGMENTS: return on_segments(body, length);
#ifdef DC
	case GAINS: return state == IDLE ? drive_gains(body, length) : REFUSED_STATE;
#endif
	default: return REFUSED_FORM;
	}
}

static void handle(uint8_t length)
{
	const uint8_t *body = frame + HEADER;
	motion_heard();
	switch (frame[0]) {
	case HELLO: send_info(); break;
	case BEAT: break;
	case PING:
		if (length == HEADER + 4) send_pong(body);
		break;
	default: send_reply(frame[0], command(body, length - HEADER));
	}
}

/* milliseconds since the last call, from the tick */
static uint8_t millisecond(void)
{
	static uint32_t last;
	cli();
	uint32_t now = tick;
	sei();
	if (now - last < TICK_HZ / 1000) return 0;
	last += TICK_HZ / 1000;
	return 1;
}

int main(void)
{
	reset_cause = MCUSR;
	MCUSR = 0;
	wdt_enable(WDTO_60MS); /* a firmware that hangs resets: pins low, drivers off */
	drive_begin();
	link_begin();
	sei();
	send_info();
	for (uint16_t since_status = 0;;) {
		wdt_reset();
		if (millisecond()) {
			motion_millisecond();
			if (++since_status >= config.status) {
				since_status = 0;
				send_status();
			}
		}
		uint8_t length = link_frame();
		if (length) handle(length);
		else if (!link_waiting()) sleep_mode();
	}
}
