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
    int apart;                            /* each set has inputs of its own */
    const double *time, *input1, *input2; /* [rows]; [sets][rows]: angles, voltages [V] or references [rad] */
    double kp, kd, rate_weight;           /* gains of the loop, share of the reference's rate */
    double limit;                         /* longest micro-step [s] or 0 */
    double lead;                          /* [s] of motion at the first rate before the first row; 0: at rest */
    const double *parameter;              /* [sets][PARAMETER_COUNT] */
    const double *first;                  /* [sets][2] angles [rad] */
    const double *rest;                   /* [sets][6]: see stage_begin */
    const double *push;                   /* [sets][8] where a lead ends: see stage_push */
    const int *channel;                   /* outputs wanted, [channels] */
    int channels;
    double *out;                          /* [sets][channels][rows] */
    double step;                          /* longest micro-step of the last LANES sets [s] */
} batch;

typedef const double *course[2][LANES]; /* what drives each lane, [rows] */

/* slope of an input over the interval that starts at a row; 0 after the last */
static double slope(const batch *b, const double *input, int row)
{
    if (row + 1 >= b->rows) return 0.0;
    return (input[row + 1] - input[row]) / (b->time[row + 1] - b->time[row]);
}

/* the same in every lane */
static void slopes(const batch *b, const double *const *input, int row, double *rate)
{
    rate[0] = slope(b, input[0], row);
    for (int l = 1; l < LANES; l++) rate[l] = b->apart ? slope(b, input[l], row) : rate[0];
}

/* volts by which a loop follows a reference */
static double looped(const stage *s, const batch *b, int i, int l, double reference, double rate)
{
    return b->kp * (reference - s->q[2 + i][l]) + b->kd * (b->rate_weight * rate - s->v[2 + i][l]);
}

/* lanes from first up to end have one input; inlined, the compiler knows how many */
static inline void set_volts(stage *s, const batch *b, int i, const double *input, int row,
                             int first, const int end)
{
    const double u = input[row], rate = slope(b, input, row);
    for (int l = first; l < end; l++)
        s->voltage[i][l] = b->mode == VOLTAGES ? u : looped(s, b, i, l, u, rate);
}

static void set_voltage(stage *s, const batch *b, course input, int row)
{
    for (int i = 0; i < 2; i++)
        if (!b->apart) set_volts(s, b, i, input[i][0], row, 0, LANES);
        else for (int l = 0; l < LANES; l++) set_volts(s, b, i, input[i][l], row, l, l + 1);
}

static void set_angles(stage *s, const batch *b, course input, int row)
{
    for (int i = 0; i < 2; i++) {
        slopes(b, input[i], row, s->input_rate[i]);
        for (int l = 0; l < LANES; l++) s->input[i][l] = input[i][l][row];
    }
    s->input_time = b->time[row];
}

/* the set of a lane: lanes that are left over repeat the last one */
static size_t set_of(const batch *b, int first, int l)
{
    return (size_t)(first + l < b->sets ? first + l : b->sets - 1);
}

/* ``direct``: all channels are the stage's own state, nothing need be reported */
static void record(stage *s, const batch *b, double *const *out, int row, int direct)
{
    if (!direct) stage_report(s);
    for (int c = 0; c < b->channels; c++) {
        const int which = b->channel[c];
        const double *value = *(direct ? stage_seen(s, which) : stage_output(s, which));
        for (int l = 0; l < LANES; l++) out[l][(size_t)c * b->rows + row] = value[l];
    }
}

/* what drives the stage a while before the first row, as the first interval goes on backwards */
static void drive_before(stage *s, const batch *b, course input, double ahead)
{
    for (int i = 0; i < 2; i++) {
        slopes(b, input[i], 0, s->input_rate[i]);
        for (int l = 0; l < LANES; l++) {
            const double rate = s->input_rate[i][l], u = input[i][l][0] - rate * ahead;
            s->input[i][l] = u;
            if (b->mode == CLOSED_LOOP) s->voltage[i][l] = looped(s, b, i, l, u, rate);
        }
    }
    s->input_time = b->time[0] - ahead;
}

/* evenly up to the first row, by the loop's own clock, then off by as much as each set says */
static void lead_in(stage *s, const batch *b, course input, int first)
{
    lane rates[2];
    const int rows = b->mode == CLOSED_LOOP ? (int)(b->lead / (b->time[1] - b->time[0]) + 0.5) : 1;
    lane push[8];
    for (int i = 0; i < 2; i++) slopes(b, input[i], 0, rates[i]);
    stage_set_off(s, (const lane *)rates);
    for (int n = 0; n < rows; n++) {
        drive_before(s, b, input, b->lead * (rows - n) / rows);
        stage_advance(s, b->lead / rows, b->step);
    }
    s->time = s->begun = b->time[0];
    for (int i = 0; i < 8; i++)
        for (int l = 0; l < LANES; l++) push[i][l] = b->push[8 * set_of(b, first, l) + i];
    stage_push(s, (const lane *)push);
}

static void begin(stage *s, batch *b, course input, int first)
{
    const int leads = b->lead > 0 && b->rows > 1 && b->mode != VOLTAGES;
    const double ahead = leads ? b->lead : 0.0;
    lane angles[2], rest[6];
    memset(s, 0, offsetof(stage, ring_time));
    s->topology = b->topology;
    s->drive = b->drive;
    for (int l = 0; l < LANES; l++) {
        const size_t set = set_of(b, first, l);
        for (int i = 0; i < 2; i++)
            angles[i][l] = b->first[2 * set + i] - ahead * slope(b, input[i][l], 0);
        for (int i = 0; i < 6; i++) rest[i][l] = b->rest[6 * set + i];
        for (int i = 0; i < PARAMETER_COUNT; i++)
            s->parameter[i][l] = b->parameter[set * PARAMETER_COUNT + i];
    }
    stage_begin(s, b->time[0] - ahead, (const lane *)angles, (const lane *)rest);
    b->step = b->limit > 0 ? b->limit : stage_step_limit(s);
    if (leads) lead_in(s, b, input, first);
}

/* whether all rows may be run at once */
static int swept(const stage *s, const batch *b, course input, sweep *w)
{
    if (b->mode != ANGLES || b->channels > SEEN || !stage_sweeps(s)) return 0;
    for (int c = 0; c < b->channels; c++)
        if (!(w->seen[c] = stage_seen(s, b->channel[c]))) return 0;
    w->rows = b->rows;
    w->time = b->time;
    memcpy(w->input, input, sizeof w->input);
    w->apart = b->apart;
    w->limit = b->step;
    w->channels = b->channels;
    return 1;
}

/* whether all channels lie in the stage's own state */
static int all_seen(const stage *s, const batch *b)
{
    for (int c = 0; c < b->channels; c++)
        if (!stage_seen(s, b->channel[c])) return 0;
    return stage_shows(s);
}

static void run_row_by_row(stage *s, const batch *b, course input, double *const *out)
{
    const int direct = all_seen(s, b);
    for (int row = 0; row < b->rows; row++) {
        if (b->mode == ANGLES) set_angles(s, b, input, row);
        else set_voltage(s, b, input, row);
        record(s, b, out, row, direct);
        if (row + 1 < b->rows) {
            stage_advance(s, b->time[row + 1] - b->time[row], b->step);
            s->time = b->time[row + 1];
        }
    }
}

static void run(stage *s, batch *b, int first)
{
    sweep w = {0};
    course input;
    for (int l = 0; l < LANES; l++) {
        const size_t set = set_of(b, first, l), rows = (size_t)b->rows;
        w.out[l] = b->out + set * (size_t)b->channels * rows;
        input[0][l] = b->input1 + (b->apart ? set * rows : 0);
        input[1][l] = b->input2 + (b->apart ? set * rows : 0);
    }
    begin(s, b, input, first);
    if (!swept(s, b, input, &w)) {
        run_row_by_row(s, b, input, w.out);
        return;
    }
    record(s, b, w.out, 0, 0);
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
