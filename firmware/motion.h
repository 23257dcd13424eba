/* Segments, limits and states: what both builds share.
 *
 * A segment is a number of ticks at constant rates. Positions are exact: P += rate at every tick,
 * position = floor(P / 2^FRACTION_BITS), starting at half a count after ARM. */
#ifndef MOTION_H
#define MOTION_H

#include <stdint.h>

#include "board.h"

struct segment {
	uint16_t ticks; /* 0: the motion ends here */
	int32_t rate[2];
};

struct config {
	int32_t lower_x, upper_x, lower_y, upper_y; /* [counts] of a + b and a - b */
	uint32_t rate; /* largest rate of a motor */
	uint32_t jump; /* largest change of rate at once */
	uint32_t acceleration; /* further change of rate for each tick of the shorter segment */
	uint32_t brake; /* change of rate per millisecond when stopping */
	uint16_t watchdog; /* [ms] */
	uint16_t status; /* [ms] between reports */
};

extern struct config config;
extern volatile uint8_t state, fault, position_known;
extern volatile uint32_t tick, start_tick;
extern volatile uint8_t start_set;
extern volatile struct segment queue[QUEUE];
extern volatile uint8_t queue_head, queue_tail;
extern uint16_t next_frame; /* number of the segment frame that is expected */

/* dc only: the position loop */
struct gains {
	int32_t kp, kd; /* [mV/count, mV per count a tick] in 1/256 */
	uint16_t supply, largest; /* [mV] full duty, and the most that the loop may ask for */
	uint16_t astray; /* [counts] from the reference at which a motor does not follow */
} __attribute__((packed));

#ifdef DC
#define TICK_CYCLES TCNT2
#else
#define TICK_CYCLES TCNT1
#endif

static inline uint8_t queue_free(void) { return QUEUE - (uint8_t)(queue_head - queue_tail); }

/* stop with a ramp; the cause is kept */
void motion_stop(uint8_t cause);
/* stop at once; the position may have been lost */
void motion_cut(uint8_t cause);
/* forget the queue and begin where the counters stand */
void motion_reset(void);
/* take all segments of a frame, or none: 0, or why not */
uint8_t motion_accept(const uint8_t *body, uint8_t length);
/* watchdog and ramp; once a millisecond */
void motion_millisecond(void);
/* a valid frame came */
void motion_heard(void);

/* the drive: stepper.c or dc.c */
void drive_begin(void);
void drive_enable(uint8_t on);
uint8_t drive_enabled(void);
void drive_counts(int32_t counts[2]);
void drive_set_counts(const int32_t counts[2]);
void drive_rates(int32_t rates[2]);
void drive_set_rates(const int32_t rates[2]);
/* ready for a motion from where the counters stand */
void drive_reset(void);
/* volts of both motors in mV; 0 for steppers */
void drive_volts(int16_t volts[2]);
uint16_t drive_longest(void);
/* dc only: take the gains; 0, or why not */
uint8_t drive_gains(const uint8_t *body, uint8_t length);

#endif
