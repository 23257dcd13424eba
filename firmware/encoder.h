/* Two quadrature encoders on PC0 to PC3, four counts a line, none lost unseen (dc build). */
#ifndef ENCODER_H
#define ENCODER_H

#include <stdint.h>

#define ENCODERS 0x0f /* PC0 to PC3: A, B of motor 1, A, B of motor 2 */
#define STORM 100 /* counts of both between two ticks, which are followed without a loss */

void encoder_begin(void);
/* count again from where the encoders stand; what was missed stays missed */
void encoder_resume(void);
/* whether it counts: an edge that was missed, or a storm, ends it and takes the PWM off the pins */
uint8_t encoder_counts(void);
/* once in each tick; interrupts must be off */
void encoder_tick(void);
int32_t encoder_get(uint8_t motor);
/* interrupts must be off */
void encoder_set(uint8_t motor, int32_t counts);

#endif
