#include "link.h"

#include <avr/interrupt.h>
#include <string.h>
#include <util/crc16.h>

#include "board.h"
#include "motion.h"
#include "protocol.h"

#define CRC_SIZE 2
#define HEADER_SIZE 3

volatile uint8_t bytes_lost;
uint16_t frames_bad;
uint8_t frame[FRAME_SIZE];

/* rings of 256 bytes: their 8-bit indices wrap by themselves */
static volatile uint8_t received[256], received_head, received_tail;
static volatile uint8_t sending[256], sending_head, sending_tail;

/* when the last PING ended; its type is the second byte of a frame, after the COBS code */
static volatile uint32_t stamp_tick;
static volatile uint16_t stamp_cycles;

ISR(USART_RX_vect)
{
	static uint8_t place, ping;
	uint8_t failed = UCSR0A & (_BV(DOR0) | _BV(FE0)), byte = UDR0;
	if (failed) bytes_lost++;
	received[received_head] = byte;
	if ((uint8_t)(received_head + 1) != received_tail) received_head++;
	else bytes_lost++;
	if (byte) {
		if (place < 2 && ++place == 2) ping = byte == PING;
		return;
	}
	if (ping) {
		stamp_cycles = TICK_CYCLES;
		stamp_tick = tick;
	}
	place = ping = 0;
}

ISR(USART_UDRE_vect)
{
	if (sending_tail != sending_head) UDR0 = sending[sending_tail++];
	else UCSR0B &= ~_BV(UDRIE0);
}

void link_begin(void)
{
	UCSR0A = _BV(U2X0);
	UCSR0C = 3 << UCSZ00;
	UBRR0 = (F_CPU / 8 + BAUD / 2) / BAUD - 1;
	UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

uint8_t link_waiting(void) { return received_tail != received_head; }

void link_stamp(uint32_t *at, uint16_t *cycles)
{
	cli();
	*at = stamp_tick;
	*cycles = stamp_cycles;
	sei();
}

static uint8_t crc_holds(uint8_t length)
{
	uint16_t crc = 0xffff;
	for (uint8_t i = 0; i < length; i++) crc = _crc_ccitt_update(crc, frame[i]);
	return crc == 0;
}

uint8_t link_frame(void)
{
	static uint8_t length, block, left, bad;
	while (received_tail != received_head) {
		uint8_t byte = received[received_tail++];
		if (byte == 0) {
			uint8_t size = length, whole = !bad && !left && size >= HEADER_SIZE + CRC_SIZE;
			length = block = left = bad = 0;
			if (size == 0) continue;
			if (whole && crc_holds(size)) return size - CRC_SIZE;
			frames_bad++;
			continue;
		}
		uint8_t put = left != 0;
		if (!left) {
			/* a block's code: the block before it stands for a zero, unless it was the first or full */
			put = block && block != 0xff;
			block = byte;
			left = byte;
			byte = 0;
		}
		left--;
		if (!put) continue;
		if (length < FRAME_SIZE) frame[length++] = byte;
		else bad = 1;
	}
	return 0;
}

/* one byte of a frame into the ring, as COBS: `*code` is where the open block's length will stand */
static void put(uint8_t byte, uint8_t *code, uint8_t *next, uint16_t *crc)
{
	*crc = _crc_ccitt_update(*crc, byte);
	if (byte) {
		sending[(*next)++] = byte;
		return;
	}
	sending[*code] = *next - *code;
	*code = (*next)++;
}

void link_send(uint8_t type, const void *body, uint8_t length)
{
	static uint16_t sequence;
	uint8_t room = sending_tail - sending_head - 1, code = sending_head, next = code + 1;
	uint16_t crc = 0xffff, number = sequence++;
	const uint8_t *bytes = body;
	if (room < length + HEADER_SIZE + CRC_SIZE + 3) return;
	put(type, &code, &next, &crc);
	put(number, &code, &next, &crc);
	put(number >> 8, &code, &next, &crc);
	for (uint8_t i = 0; i < length; i++) put(bytes[i], &code, &next, &crc);
	uint16_t check = crc;
	put(check, &code, &next, &crc);
	put(check >> 8, &code, &next, &crc);
	sending[code] = next - code;
	sending[next++] = 0;
	sending_head = next;
	UCSR0B |= _BV(UDRIE0);
}
