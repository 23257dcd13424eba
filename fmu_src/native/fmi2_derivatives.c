/* FMI 2.0: derivatives of inputs and outputs along time, and of outputs along what they depend on. */
#include "fmi2_instance.h"

#include <math.h>
#include <stdio.h>

enum { KNOWING = INITIALIZING | STEPPING | TERMINATED };

/* inputs, to first order */

static int slope_is_right(instance *i, const struct variable *v, fmi2Integer order, double value)
{
    const char *wrong = v->role != INPUT ? "is no input, expected phi1 or phi2"
        : order != 1 ? "only a derivative of order 1 is known"
        : !isfinite(value) ? "expected a finite derivative" : 0;
    if (!wrong) return 1;
    snprintf(i->why, SENTENCE, "%s: %s", v->name, wrong);
    refuse(i, "fmi2SetRealInputDerivatives", i->why);
    return 0;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    static const char function[] = "fmi2SetRealInputDerivatives";
    instance *i = c;
    if (!in_phase(i, function, SETTABLE)) return fmi2Error;
    if (!arrays(i, function, nvr, vr, value) || !arrays(i, function, nvr, order, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) {
        const struct variable *v = find(i, function, vr[n], REAL);
        if (!v || !slope_is_right(i, v, order[n], value[n])) return fmi2Error;
    }
    for (size_t n = 0; n < nvr; n++) slave_set_slope(&i->now, slave_known(vr[n]), value[n]);
    return fmi2OK;
}

static fmi2Status all_finite(instance *i, const char *function, size_t count, const fmi2Real value[])
{
    for (size_t n = 0; n < count; n++)
        if (!isfinite(value[n])) return refuse(i, function, "a derivative is beyond what a number can hold");
    return fmi2OK;
}

/* outputs, to first order */

static int output_is_right(instance *i, const char *function, const struct variable *v, fmi2Integer order)
{
    if (v->role == OUTPUT && order == 1) return 1;
    snprintf(i->why, SENTENCE, "%s: %s", v->name,
             v->role == OUTPUT ? "only a derivative of order 1 is known" : "is no output, expected one");
    refuse(i, function, i->why);
    return 0;
}

/* what the state holds is exact, the rest is found over the coming micro-step */
static double slope_of(const instance *i, const struct variable *v, double ahead)
{
    const stage *s = &i->now.stage;
    switch (v->place) {
    case OUT_X_TRUE: case OUT_Y_TRUE: return s->v[v->place - OUT_X_TRUE][0];
    case OUT_PHI1: case OUT_PHI2: return s->v[2 + v->place - OUT_PHI1][0];
    default: return (i->trial.output[v->place][0] - i->now.output[v->place][0]) / ahead;
    }
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    static const char function[] = "fmi2GetRealOutputDerivatives";
    instance *i = c;
    double ahead;
    if (!in_phase(i, function, KNOWING)) return fmi2Error;
    if (!arrays(i, function, nvr, vr, value) || !arrays(i, function, nvr, order, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) {
        const struct variable *v = find(i, function, vr[n], REAL);
        if (!v || !output_is_right(i, function, v, order[n])) return fmi2Error;
    }
    if (!refresh(i, function)) return fmi2Error;
    if (!slave_foresee(&i->now, &i->trial, &ahead, i->why)) return refuse(i, function, i->why);
    for (size_t n = 0; n < nvr; n++) value[n] = slope_of(i, slave_known(vr[n]), ahead);
    return all_finite(i, function, nvr, value);
}

/* outputs along a direction of inputs, and of parameters while they may be set */

static int direction_is_right(instance *i, const char *function, const struct direction *d)
{
    const int open = i->now.phase == INITIALIZING;
    for (size_t n = 0; n < d->count; n++) {
        const struct variable *v = find(i, function, d->known[n], REAL);
        if (!v) return 0;
        if (isfinite(d->seed[n]) && (v->role == INPUT || (open && v->role == PARAMETER))) continue;
        snprintf(i->why, SENTENCE, "%s: %s", v->name, !isfinite(d->seed[n]) ? "expected a finite seed"
                 : open ? "outputs do not follow it, expected inputs and parameters"
                 : "outputs do not follow it now, expected inputs");
        refuse(i, function, i->why);
        return 0;
    }
    return 1;
}

static int outputs_are_right(instance *i, const char *function, const fmi2ValueReference unknown[], size_t count)
{
    for (size_t n = 0; n < count; n++) {
        const struct variable *v = find(i, function, unknown[n], REAL);
        if (!v || !output_is_right(i, function, v, 1)) return 0;
    }
    return 1;
}

/* add or take away the outputs of a run that starts so far along the direction, each over `over` */
static int add_outputs(instance *i, const struct direction *d, double part, const fmi2ValueReference unknown[],
                       size_t count, double over, fmi2Real sum[])
{
    if (!slave_shift(&i->now, &i->trial, d, part, i->why)) return 0;
    for (size_t n = 0; n < count; n++)
        sum[n] += slave_get(&i->trial, slave_known(unknown[n])) / over;
    return 1;
}

/* once a run is going, no output follows an input before the next step: then all are zero */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nUnknown,
                                        const fmi2ValueReference known[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    static const char function[] = "fmi2GetDirectionalDerivative";
    instance *i = c;
    const struct direction d = {known, dvKnown, nKnown};
    if (!in_phase(i, function, KNOWING)) return fmi2Error;
    if (!arrays(i, function, nUnknown, unknown, dvUnknown) || !arrays(i, function, nKnown, known, dvKnown)
        || !outputs_are_right(i, function, unknown, nUnknown) || !direction_is_right(i, function, &d)) return fmi2Error;
    for (size_t n = 0; n < nUnknown; n++) dvUnknown[n] = 0;
    const double part = slave_part(&i->now, &d);
    if (i->now.phase != INITIALIZING || !isfinite(part)) return fmi2OK;
    if (add_outputs(i, &d, part, unknown, nUnknown, 2 * part, dvUnknown)
        && add_outputs(i, &d, -part, unknown, nUnknown, -2 * part, dvUnknown))
        return all_finite(i, function, nUnknown, dvUnknown);
    return refuse(i, function, i->why);
}
