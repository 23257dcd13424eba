/* Whole recordings for LANES parameter sets at once: what the Python package calls. */
#include "stage.h"

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
    int rows, mode, topology, drive;
    const double *time, *input1, *input2; /* [rows]: angles [rad], voltages [V] or references [rad] */
    double kp, kd, rate_weight;           /* gains of the loop, share of the reference's rate */
    double limit, angle1, angle2;         /* longest micro-step [s] or 0, first angles [rad] */
    const double *parameter;              /* [LANES][PARAMETER_COUNT] */
    const double *rest;                   /* [LANES][4]: see stage_begin */
    const int *channel;                   /* outputs wanted, [channels] */
    int channels;
    double *out;                          /* [LANES][channels][rows] */
    double step;                          /* longest micro-step taken [s] */
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

static void record(stage *s, const batch *b, int row)
{
    stage_report(s);
    for (int c = 0; c < b->channels; c++) {
        const double *value = *stage_output(s, b->channel[c]);
        for (int l = 0; l < LANES; l++)
            b->out[((size_t)l * b->channels + c) * b->rows + row] = value[l];
    }
}

static void begin(stage *s, const batch *b)
{
    const double angles[2] = {b->angle1, b->angle2};
    lane rest[4];
    s->topology = b->topology;
    s->drive = b->drive;
    for (int l = 0; l < LANES; l++) {
        for (int i = 0; i < 4; i++) rest[i][l] = b->rest[4 * l + i];
        for (int i = 0; i < PARAMETER_COUNT; i++)
            s->parameter[i][l] = b->parameter[(size_t)l * PARAMETER_COUNT + i];
    }
    stage_begin(s, b->time[0], angles, (const lane *)rest);
}

static void run(stage *s, batch *b)
{
    begin(s, b);
    b->step = b->limit > 0 ? b->limit : stage_step_limit(s);
    for (int row = 0; row < b->rows; row++) {
        if (b->mode == ANGLES) set_angles(s, b, row);
        else set_voltage(s, b, row);
        record(s, b, row);
        if (row + 1 < b->rows) {
            stage_advance(s, b->time[row + 1] - b->time[row], b->step);
            s->time = b->time[row + 1];
        }
    }
}

EXPORT int batch_lanes(void) { return LANES; }

/* 0, or 1 where memory is short */
EXPORT int batch_run(batch *b)
{
    char *memory = calloc(1, sizeof(stage) + sizeof(lane));
    if (!memory) return 1;
    run((stage *)(memory + sizeof(lane) - (uintptr_t)memory % sizeof(lane)), b);
    free(memory);
    return 0;
}
