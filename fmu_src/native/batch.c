/* Whole recordings for any number of parameter sets, LANES at once: what the Python package calls. */
#include "stage.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { ANGLES = 0, VOLTAGES = 1, CLOSED_LOOP = 2 };

typedef struct {
    int rows, mode, topology, drive, sets;
    const double *time, *input1, *input2; /* [rows]: angles [rad], voltages [V] or references [rad] */
    double kp, kd, rate_weight;           /* gains of the loop, share of the reference's rate */
    double limit, angle1, angle2;         /* longest micro-step [s] or 0, first angles [rad] */
    double lead;                          /* [s] of motion at the first rate before the first row; 0: at rest */
    const double *parameter;              /* [sets][PARAMETER_COUNT] */
    const double *rest;                   /* [sets][4]: see stage_begin */
    const double *push;                   /* [sets][8] where a lead ends: see stage_push */
    const int *channel;                   /* outputs wanted, [channels] */
    int channels;
    double *out;                          /* [sets][channels][rows] */
    double step;                          /* longest micro-step of the last LANES sets [s] */
} batch;

/* slope of an input over the interval that starts at a row; 0 after the last */
static double slope(const batch *b, const double *input, int row)
{
    if (row + 1 >= b->rows) return 0.0;
    return (input[row + 1] - input[row]) / (b->time[row + 1] - b->time[row]);
}

static void set_voltage(stage *s, const batch *b, int row)
{
    const double *input[2] = {b->input1, b->input2};
    for (int i = 0; i < 2; i++) {
        const double u = input[i][row], rate = slope(b, input[i], row);
        for (int l = 0; l < LANES; l++)
            s->voltage[i][l] = b->mode == VOLTAGES
                ? u
                : b->kp * (u - s->q[2 + i][l]) + b->kd * (b->rate_weight * rate - s->v[2 + i][l]);
    }
}

static void set_angles(stage *s, const batch *b, int row)
{
    const double *input[2] = {b->input1, b->input2};
    for (int i = 0; i < 2; i++) {
        s->input[i] = input[i][row];
        s->input_rate[i] = slope(b, input[i], row);
    }
    s->input_time = b->time[row];
}

/* the set of a lane: lanes that are left over repeat the last one */
static size_t set_of(const batch *b, int first, int l)
{
    return (size_t)(first + l < b->sets ? first + l : b->sets - 1);
}

static void record(stage *s, const batch *b, double *const *out, int row)
{
    stage_report(s);
    for (int c = 0; c < b->channels; c++) {
        const double *value = *stage_output(s, b->channel[c]);
        for (int l = 0; l < LANES; l++) out[l][(size_t)c * b->rows + row] = value[l];
    }
}

/* what drives the stage a while before the first row, as the first interval goes on backwards */
static void drive_before(stage *s, const batch *b, double ahead)
{
    const double *input[2] = {b->input1, b->input2};
    for (int i = 0; i < 2; i++) {
        const double rate = slope(b, input[i], 0), u = input[i][0] - rate * ahead;
        s->input[i] = u;
        s->input_rate[i] = rate;
        for (int l = 0; l < LANES && b->mode == CLOSED_LOOP; l++)
            s->voltage[i][l] = b->kp * (u - s->q[2 + i][l]) + b->kd * (b->rate_weight * rate - s->v[2 + i][l]);
    }
    s->input_time = b->time[0] - ahead;
}

/* evenly up to the first row, by the loop's own clock, then off by as much as each set says */
static void lead_in(stage *s, const batch *b, int first)
{
    const double rates[2] = {slope(b, b->input1, 0), slope(b, b->input2, 0)};
    const int rows = b->mode == CLOSED_LOOP ? (int)(b->lead / (b->time[1] - b->time[0]) + 0.5) : 1;
    lane push[8];
    stage_set_off(s, rates);
    for (int n = 0; n < rows; n++) {
        drive_before(s, b, b->lead * (rows - n) / rows);
        stage_advance(s, b->lead / rows, b->step);
    }
    s->time = s->begun = b->time[0];
    for (int i = 0; i < 8; i++)
        for (int l = 0; l < LANES; l++) push[i][l] = b->push[8 * set_of(b, first, l) + i];
    stage_push(s, (const lane *)push);
}

static void begin(stage *s, batch *b, int first)
{
    const int leads = b->lead > 0 && b->rows > 1 && b->mode != VOLTAGES;
    const double ahead = leads ? b->lead : 0.0;
    const double angles[2] = {b->angle1 - ahead * slope(b, b->input1, 0),
                              b->angle2 - ahead * slope(b, b->input2, 0)};
    lane rest[4];
    memset(s, 0, offsetof(stage, ring_time));
    s->topology = b->topology;
    s->drive = b->drive;
    for (int l = 0; l < LANES; l++) {
        const size_t set = set_of(b, first, l);
        for (int i = 0; i < 4; i++) rest[i][l] = b->rest[4 * set + i];
        for (int i = 0; i < PARAMETER_COUNT; i++)
            s->parameter[i][l] = b->parameter[set * PARAMETER_COUNT + i];
    }
    stage_begin(s, b->time[0] - ahead, angles, (const lane *)rest);
    b->step = b->limit > 0 ? b->limit : stage_step_limit(s);
    if (leads) lead_in(s, b, first);
}

/* whether all rows may be run at once */
static int swept(const stage *s, const batch *b, sweep *w)
{
    if (b->mode != ANGLES || b->channels > SEEN || !stage_sweeps(s)) return 0;
    for (int c = 0; c < b->channels; c++)
        if (!(w->seen[c] = stage_seen(s, b->channel[c]))) return 0;
    w->rows = b->rows;
    w->time = b->time;
    w->input[0] = b->input1;
    w->input[1] = b->input2;
    w->limit = b->step;
    w->channels = b->channels;
    return 1;
}

static void run_row_by_row(stage *s, const batch *b, double *const *out)
{
    for (int row = 0; row < b->rows; row++) {
        if (b->mode == ANGLES) set_angles(s, b, row);
        else set_voltage(s, b, row);
        record(s, b, out, row);
        if (row + 1 < b->rows) {
            stage_advance(s, b->time[row + 1] - b->time[row], b->step);
            s->time = b->time[row + 1];
        }
    }
}

static void run(stage *s, batch *b, int first)
{
    sweep w = {0};
    for (int l = 0; l < LANES; l++)
        w.out[l] = b->out + set_of(b, first, l) * (size_t)b->channels * (size_t)b->rows;
    begin(s, b, first);
    if (!swept(s, b, &w)) {
        run_row_by_row(s, b, w.out);
        return;
    }
    record(s, b, w.out, 0);
    while (w.row + 1 < w.rows) stage_sweep(s, &w);
}

EXPORT int batch_lanes(void) { return LANES; }

/* 0, or 1 where memory is short */
EXPORT int batch_run(batch *b)
{
    char *memory = malloc(sizeof(stage) + sizeof(lane));
    if (!memory) return 1;
    stage *s = (stage *)(memory + sizeof(lane) - (uintptr_t)memory % sizeof(lane));
    for (int first = 0; first < b->sets; first += LANES) run(s, b, first);
    free(memory);
    return 0;
}
