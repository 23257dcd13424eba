/* How outputs change: along time after a step, and along a direction of what a run starts from. */
#include "slave.h"

#include <math.h>
#include <stdio.h>

#define REFUSE(...) return snprintf(why, SENTENCE, __VA_ARGS__), 0

static const double LONGEST_LOOK = 1e-4; /* [s] */
static const double SHARE = 1e-5;        /* of a value: near the cube root of what a double resolves */

/* a copy that goes on by one micro-step [s] as the last step did; inputs set since then do not count */
int slave_foresee(const slave *s, slave *trial, double *ahead, char *why)
{
    *trial = *s;
    *ahead = s->stage.step < LONGEST_LOOK ? s->stage.step : LONGEST_LOOK;
    stage_advance(&trial->stage, *ahead, *ahead);
    return slave_outputs(trial, why);
}

/* the part of a direction that changes none of its values by more than a small share */
double slave_part(const slave *s, const struct direction *d)
{
    double part = HUGE_VAL;
    for (size_t n = 0; n < d->count; n++) {
        const struct variable *v = slave_known(d->known[n]);
        const double size = fabs(slave_get(s, v)), scale = v->role == INPUT && size < 1 ? 1 : size;
        if (d->seed[n] == 0) continue;
        part = fmin(part, SHARE * (scale > 0 ? scale : 1) / fabs(d->seed[n]));
    }
    return part;
}

/* a copy whose run starts that far along the direction */
int slave_shift(const slave *s, slave *trial, const struct direction *d, double part, char *why)
{
    *trial = *s;
    for (size_t n = 0; n < d->count; n++) {
        const struct variable *v = slave_known(d->known[n]);
        const double value = slave_get(s, v) + part * d->seed[n];
        if (d->seed[n] == 0) continue;
        if (!(value >= v->lower && value <= v->upper))
            REFUSE("%s: %.9g stands at the end of its range or apart from it, expected a value that may "
                   "move both ways", v->name, slave_get(s, v));
        slave_set(trial, v, value);
    }
    return slave_start(trial, why);
}
