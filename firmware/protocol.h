/* What travels on the wire. The host's copy of these numbers is src/corexy_fmi/hil/protocol.py; a
 * test compares both.
 *
 * Frame: COBS(type u8 | sequence u16 | body | CRC-16/MCRF4XX) 00, all little endian. */
#ifndef PROTOCOL_H
#define PROTOCOL_H

#define PROTOCOL_VERSION 2
#define FRAME_SIZE 64 /* [bytes] decoded: type, sequence, body, CRC */
#define SEGMENT_SIZE 10 /* [bytes] ticks u16, rate i32 of each motor */

/* host to board */
enum {
	HELLO = 0x01, /* -> INFO */
	CONFIG = 0x02, /* struct config */
	ARM = 0x03, /* drivers on, queue empty; a body of one byte: to home */
	RUN = 0x04, /* start tick u32 */
	STOP = 0x05, /* ramp down */
	ESTOP = 0x06, /* no further step, drivers off */
	CLEAR = 0x07, /* out of a fault or the armed state; drivers stay as they are */
	PING = 0x08, /* token u32 -> PONG */
	BEAT = 0x09, /* the host is alive */
	ORIGIN = 0x0a, /* counts i32, i32 of where the carriage stands */
	RELEASE = 0x0b, /* drivers off: the position is lost */
	GAINS = 0x0c, /* dc only: struct gains */
	HOME = 0x0d, /* struct home; when armed */
	SEGMENTS = 0x10 /* numbered from 0 at each ARM */
};

/* board to host */
enum {
	INFO = 0x81,
	STATUS = 0x82,
	PONG = 0x83, /* token u32, tick u32, cycles u16 at the end of the PING */
	REPLY = 0x84 /* type u8, code u8, next segment frame u16, free u8 */
};

enum { IDLE, ARMED, RUNNING, STOPPING, FAULT, HOMING };

/* why it stopped, and why a frame was refused */
enum {
	NOTHING,
	BY_HOST, /* STOP */
	BY_ESTOP_FRAME,
	BY_ESTOP_PIN,
	BY_LIMIT_SWITCH,
	BY_WATCHDOG,
	BY_UNDERRUN,
	BY_POSITION, /* a segment leaves the stage */
	BY_RATE,
	BY_ACCELERATION,
	BY_REVERSAL, /* a rate changed its sign without two ticks at zero */
	BY_ENCODER, /* dc: the motor does not follow */
	BY_COUNTS, /* dc: an encoder's edge was missed, or they came too fast */
	BY_HOMING, /* no switch on the way, or it did not close again */
	REFUSED_STATE, /* from here on: refused, nothing stops */
	REFUSED_ORDER, /* not the next segment frame */
	REFUSED_FULL,
	REFUSED_FORM
};

/* flags of STATUS */
#define POSITION_KNOWN 0x01
#define DRIVERS_ON 0x02
#define SWITCH_X 0x10
#define SWITCH_Y 0x20
#define ESTOP_OPEN 0x40

#endif
