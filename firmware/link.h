/* Frames over the UART. */
#ifndef LINK_H
#define LINK_H

#include <stdint.h>

extern volatile uint8_t bytes_lost; /* overrun, framing error, full ring */
extern uint16_t frames_bad; /* wrong CRC, COBS or length */

void link_begin(void);
/* non-zero while received bytes wait */
uint8_t link_waiting(void);
/* length of the next complete frame without its CRC, 0 if there is none; the frame is in `frame` */
uint8_t link_frame(void);
extern uint8_t frame[];
/* send a type and its body; dropped where the ring has no room */
void link_send(uint8_t type, const void *body, uint8_t length);
/* tick and timer counts in it at the end of the last PING */
void link_stamp(uint32_t *tick, uint16_t *cycles);

#endif
