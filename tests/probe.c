/* Opens the kernel's step for tests: every coordinate, every force, one step at a time. */
#include "stage.c"

#include <stdlib.h>

#define EXPORT __attribute__((visibility("default")))

EXPORT stage *probe_new(int topology, int drive, const double *parameter, const double *angles)
{
    const lane first[2] = {{angles[0]}, {angles[1]}}, rest[6] = {{0}};
    stage *s = calloc(1, sizeof *s);
    s->topology = topology;
    s->drive = drive;
    for (int i = 0; i < PARAMETER_COUNT; i++) s->parameter[i][0] = parameter[i];
    stage_begin(s, 0.0, first, rest);
    return s;
}

EXPORT void probe_free(stage *s) { free(s); }

EXPORT void probe_set(stage *s, const double *q, const double *v)
{
    for (int i = 0; i < s->coordinates; i++) {
        s->q[i][0] = q[i];
        s->v[i][0] = s->before[i][0] = v[i];
    }
    for (int i = 0; i < 2; i++) s->input[i][0] = q[2 + i];
    s->input_time = s->time;
}

EXPORT void probe_drive(stage *s, const double *rates, const double *volts)
{
    for (int i = 0; i < 2; i++) {
        s->input[i][0] = s->q[2 + i][0];
        s->input_rate[i][0] = rates[i];
        s->voltage[i][0] = volts[i];
    }
    s->input_time = s->time;
}

EXPORT void probe_advance(stage *s, double duration, double limit) { stage_advance(s, duration, limit); }

EXPORT void probe_get(const stage *s, double *q, double *v)
{
    for (int i = 0; i < s->coordinates; i++) {
        q[i] = s->q[i][0];
        v[i] = s->v[i][0];
    }
}

/* the belts' elastic energy [J] at the last forces, stiffness laws included */
EXPORT double probe_elastic(const stage *s)
{
    double sum = 0;
    for (int i = 0; i < s->sections; i++)
        sum += 0.5 * s->tension[i][0] * s->tension[i][0] / s->stiffness[i][0];
    return sum;
}

EXPORT double probe_limit(const stage *s) { return stage_step_limit(s); }
EXPORT double probe_sine(double x) { return sine(x); }
EXPORT double probe_cosine(double x) { return cosine(x); }
EXPORT double probe_exponential(double x) { return exponential(x); }
