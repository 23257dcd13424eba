/* An ATmega328P running a firmware in simavr, driven over stdin and stdout in lock-step.
 *
 * usage: emulated_board FIRMWARE.elf
 * A test tool in a process of its own: it links libsimavr (GPL-3) and never enters the package.
 *
 * in:  'R' cycle u64                     run to that cycle, then the reply below
 *      'W' n u32, bytes                  into the UART
 *      'P' port u8, bit u8, level u8     drive an input pin
 *      'E' a i32, b i32                  quadrature encoders reach these counts during the next run
 *      'X'                               reset pin
 *      'G' address u16, n u8             read n bytes of data memory
 *      'S' address u16, value u8         write one
 * out: 'R' -> state u8, cycle u64, steps i32 x 2, duty of OC1A, OC1B u32 x 2, port D u8,
 *      n u32, UART bytes, m u32, edges of 16 bytes: cycle u64, port u8, bit u8, level u8, 0, count i32
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "avr_extint.h"
#include "avr_ioport.h"
#include "avr_uart.h"
#include "sim_avr.h"
#include "sim_elf.h"

#define FREQUENCY 16000000
#define MANY (1 << 20)
#define ENTRY 4 /* [cycles] of an interrupt */

struct edge {
	uint64_t cycle;
	uint8_t port, bit, level, zero;
	int32_t count;
};

struct pin {
	char port;
	uint8_t bit, level;
	struct pin *direction; /* steps count down while it is high */
	int32_t count;
};

static FILE *replies; /* our stdout: libsimavr would print there too */
static avr_t *avr;
static avr_irq_t *uart_in;
static int full;
static uint8_t to_board[MANY], from_board[MANY];
static size_t to_head, to_tail, from_count, edge_count;
static struct edge edges[MANY];
static struct pin pins[] = {
	{ .port = 'D', .bit = 5 }, { .port = 'D', .bit = 6 },
	{ .port = 'D', .bit = 2, .direction = &pins[0] },
	{ .port = 'D', .bit = 3, .direction = &pins[1] },
	{ .port = 'B', .bit = 0 },
};
static int32_t encoder[2], encoder_goal[2];

static void pump(void)
{
	while (!full && to_tail != to_head) {
		uint8_t byte = to_board[to_tail];
		to_tail = (to_tail + 1) % MANY;
		avr_raise_irq(uart_in, byte);
	}
}

static void on_ready(avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq, (void)param;
	if (value) full = 0, pump();
}

static void on_full(avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq, (void)param;
	if (value) full = 1;
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq, (void)param;
	if (from_count < MANY) from_board[from_count++] = value;
}

static void on_pin(avr_irq_t *irq, uint32_t value, void *param)
{
	struct pin *pin = param;
	uint8_t level = value & 1;
	(void)irq;
	if (level == pin->level) return;
	pin->level = level;
	if (pin->direction && level) pin->count += pin->direction->level ? -1 : 1;
	if (edge_count == MANY) fputs("emulated_board: edges lost\n", stderr), exit(1);
	edges[edge_count++] = (struct edge){ avr->cycle, pin->port, pin->bit, level, 0, pin->count };
}

/* an external level, held against the port's own pull-ups */
static void drive(char port, int bit, int level)
{
	static avr_ioport_external_t held[26];
	avr_ioport_external_t *e = &held[port - 'A'];
	e->name = port;
	e->mask |= 1 << bit;
	e->value = level ? e->value | 1 << bit : e->value & ~(1 << bit);
	avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), e);
	avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit), level);
}

static void encode(int n, int32_t count)
{
	static const uint8_t gray[] = { 0, 1, 3, 2 };
	uint8_t code = gray[count & 3];
	drive('C', 2 * n, code & 1);
	drive('C', 2 * n + 1, code >> 1);
}

static void no_sleep(avr_t *a, avr_cycle_count_t n) { (void)a, (void)n; }

static avr_cycle_count_t nothing(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a, (void)when, (void)param;
	return 0;
}

static int run_to(uint64_t cycle)
{
	int state = avr->state;
	if (avr->cycle >= cycle) return state;
	pump();
	/* without a timer here a sleep would jump beyond the goal; one right at the goal would be gone
	 * when the instruction that reaches the goal is the sleep itself */
	avr_cycle_timer_register(avr, cycle - avr->cycle + 1, nothing, NULL);
	while (avr->cycle < cycle) {
		state = avr_run(avr);
		if (state == cpu_Done || state == cpu_Crashed) break;
	}
	return state;
}

/* both encoders move evenly over the run, one quarter at a time, in turns */
static int run_encoders(uint64_t cycle)
{
	int32_t start[2] = { encoder[0], encoder[1] }, way[2];
	uint64_t begin = avr->cycle, span = cycle - begin;
	int state = avr->state;
	for (int n = 0; n < 2; n++) way[n] = abs(encoder_goal[n] - start[n]);
	while (encoder[0] != encoder_goal[0] || encoder[1] != encoder_goal[1]) {
		double share[2] = { 2, 2 };
		for (int n = 0; n < 2; n++)
			if (encoder[n] != encoder_goal[n])
				share[n] = (abs(encoder[n] - start[n]) + 0.5) / way[n];
		int next = share[1] < share[0];
		state = run_to(begin + (uint64_t)(share[next] * span));
		encoder[next] += encoder_goal[next] > encoder[next] ? 1 : -1;
		encode(next, encoder[next]);
	}
	(void)state;
	return run_to(cycle);
}

static void get(void *into, size_t size)
{
	if (fread(into, 1, size, stdin) != size) exit(0); /* the test is gone */
}

static void give(const void *from, size_t size) { fwrite(from, 1, size, replies); }

/* duty of OC1A or OC1B in 1/65536 from the timer's registers: simavr 1.6 keeps the pin's old width
 * when a compare register is written */
static uint32_t duty(int channel)
{
	const uint8_t *data = avr->data;
	uint32_t top = data[0x86] | data[0x87] << 8;
	uint32_t match = data[0x88 + 2 * channel] | data[0x89 + 2 * channel] << 8;
	int connected = data[0x80] & (channel ? 0x20 : 0x80);
	return connected && top ? (match + 1) * 65536 / (top + 1) : 0;
}

static void run(void)
{
	uint64_t cycle;
	get(&cycle, sizeof cycle);
	uint8_t state = run_encoders(cycle), port_d = avr->data[0x2b];
	uint32_t duties[2] = { duty(0), duty(1) };
	uint32_t bytes = from_count, count = edge_count;
	int32_t steps[2] = { pins[2].count, pins[3].count };
	give(&state, 1), give(&avr->cycle, 8), give(steps, 8), give(duties, 8), give(&port_d, 1);
	give(&bytes, 4), give(from_board, bytes), give(&count, 4), give(edges, count * sizeof *edges);
	fflush(replies);
	from_count = edge_count = 0;
}

static void feed(void)
{
	uint32_t n;
	get(&n, sizeof n);
	while (n--) {
		get(&to_board[to_head], 1);
		to_head = (to_head + 1) % MANY;
	}
	pump();
}

static void reset(void)
{
	to_head = to_tail = full = 0;
	avr_reset(avr);
	for (size_t i = 0; i < sizeof pins / sizeof *pins; i++) on_pin(NULL, 0, &pins[i]);
}

static void peek(void)
{
	struct { uint16_t address; uint8_t n; } __attribute__((packed)) what;
	get(&what, sizeof what);
	give(avr->data + what.address, what.n);
	fflush(replies);
}

static void poke(void)
{
	struct { uint16_t address; uint8_t value; } __attribute__((packed)) what;
	get(&what, sizeof what);
	avr->data[what.address] = what.value;
}

static void obey(int order)
{
	uint8_t pin[3];
	switch (order) {
	case 'R': run(); break;
	case 'W': feed(); break;
	case 'P': get(pin, 3), drive(pin[0], pin[1], pin[2]); break;
	case 'E': get(encoder_goal, sizeof encoder_goal); break;
	case 'X': reset(); break;
	case 'G': peek(); break;
	case 'S': poke(); break;
	default: exit(order == EOF ? 0 : 1);
	}
}

/* simavr enters an interrupt in no time, the chip in four cycles */
static void on_interrupt(avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq, (void)param;
	int entered = !avr->sreg[S_I] && avr->pc == value * avr->vector_size; /* else it returned */
	if (value && entered) avr->cycle += ENTRY;
}

static void wire(void)
{
	avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
		on_interrupt, NULL);
	uint32_t uart_flags = 0;
	avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &uart_flags);
	uart_flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
	avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &uart_flags);
	uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
	avr_irq_t *out = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT);
	avr_irq_register_notify(out, on_byte, NULL);
	out = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON);
	avr_irq_register_notify(out, on_ready, NULL);
	out = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF);
	avr_irq_register_notify(out, on_full, NULL);
	for (size_t i = 0; i < sizeof pins / sizeof *pins; i++) {
		avr_irq_t *irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(pins[i].port), pins[i].bit);
		avr_irq_register_notify(irq, on_pin, &pins[i]);
	}
}

int main(int count, char **words)
{
	elf_firmware_t firmware;
	replies = fdopen(dup(1), "wb");
	if (!replies || !freopen("/dev/null", "w", stdout)) return 2;
	memset(&firmware, 0, sizeof firmware);
	if (count != 2 || elf_read_firmware(words[1], &firmware)) return 2;
	avr = avr_make_mcu_by_name("atmega328p");
	if (!avr) return 2;
	avr_init(avr);
	firmware.frequency = FREQUENCY;
	avr_load_firmware(avr, &firmware);
	avr->log = LOG_ERROR;
	avr->sleep = no_sleep;
	/* PD2, PD3 are INT0, INT1: simavr 1.6 would poll a low pin at every cycle */
	avr_extint_set_strict_lvl_trig(avr, 0, 0);
	avr_extint_set_strict_lvl_trig(avr, 1, 0);
	wire();
	for (;;) obey(getchar());
}
