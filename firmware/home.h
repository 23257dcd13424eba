/* Homing: each axis to its limit switch, off it, and slowly to it again. */
#ifndef HOME_H
#define HOME_H

#include <stdint.h>

struct home {
	int32_t seek[2]; /* rate of the motors towards the switch of x, of y; the sign is its side */
	int32_t slow; /* rate of the second approach */
	int32_t travel[2]; /* [counts] of a motor within which the switch of x, of y must open */
	int32_t pull; /* [counts] of a motor off a switch that closed again */
	int32_t place[2]; /* [counts] a + b where the switch of x opens, a - b for y */
} __attribute__((packed));

/* begin; 0, or why not */
uint8_t home_begin(const uint8_t *body, uint8_t length);
/* once a tick while homing: stops at a switch */
void home_tick(void);
/* once a millisecond while homing: what comes next */
void home_millisecond(void);

#endif
