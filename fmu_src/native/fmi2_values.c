/* FMI 2.0: getting and setting values. */
#include "fmi2_instance.h"

#include <stdio.h>

/* outputs of initialisation follow from what is set so far */
static int refresh(instance *i, const char *function)
{
    if (i->now.fresh || !(i->now.phase & (INSTANTIATED | INITIALIZING))) return 1;
    if (slave_start(&i->now, i->why)) return 1;
    refuse(i, function, i->why);
    return 0;
}

static const struct variable *find(instance *i, const char *function, fmi2ValueReference reference, int type)
{
    const struct variable *v = slave_variable(reference, type, i->why);
    if (!v) refuse(i, function, i->why);
    return v;
}

/* both arrays of a call are there */
static int arrays(instance *i, const char *function, size_t count, const void *a, const void *b)
{
    if (count == 0 || (a && b)) return 1;
    refuse(i, function, "a null pointer came instead of an array");
    return 0;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    instance *i = c;
    if (!in_phase(i, "fmi2GetReal", READABLE) || !arrays(i, "fmi2GetReal", nvr, vr, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) {
        const struct variable *v = find(i, "fmi2GetReal", vr[n], REAL);
        if (!v || (v->role == OUTPUT && !refresh(i, "fmi2GetReal"))) return fmi2Error;
        value[n] = slave_get(&i->now, v);
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    instance *i = c;
    if (!in_phase(i, "fmi2GetInteger", READABLE) || !arrays(i, "fmi2GetInteger", nvr, vr, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) {
        const struct variable *v = find(i, "fmi2GetInteger", vr[n], INTEGER);
        if (!v) return fmi2Error;
        value[n] = (fmi2Integer)slave_get(&i->now, v);
    }
    return fmi2OK;
}

/* all values of a call are checked before the first one is set */

static const struct variable *settable(instance *i, const char *function, fmi2ValueReference reference,
                                       int type, double value)
{
    const struct variable *v = find(i, function, reference, type);
    if (!v) return 0;
    if (i->now.phase == STEPPING && v->role != INPUT && v->role != OUTPUT && v->role != TIME) {
        snprintf(i->why, SENTENCE, "%s: is fixed once initialised, expected it before %s", v->name,
                 "fmi2ExitInitializationMode");
        refuse(i, function, i->why);
        return 0;
    }
    if (slave_may_set(v, value, i->why)) return v;
    refuse(i, function, i->why);
    return 0;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    instance *i = c;
    if (!in_phase(i, "fmi2SetReal", SETTABLE) || !arrays(i, "fmi2SetReal", nvr, vr, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++)
        if (!settable(i, "fmi2SetReal", vr[n], REAL, value[n])) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) slave_set(&i->now, slave_variable(vr[n], REAL, i->why), value[n]);
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    instance *i = c;
    if (!in_phase(i, "fmi2SetInteger", SETTABLE) || !arrays(i, "fmi2SetInteger", nvr, vr, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++)
        if (!settable(i, "fmi2SetInteger", vr[n], INTEGER, value[n])) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) slave_set(&i->now, slave_variable(vr[n], INTEGER, i->why), value[n]);
    return fmi2OK;
}

/* there are no variables of these types */

static fmi2Status none(instance *i, const char *function, size_t nvr)
{
    if (!in_phase(i, function, READABLE)) return fmi2Error;
    return nvr ? refuse(i, function, "this FMU has no variables of that type") : fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    (void)vr; (void)value;
    return none(c, "fmi2GetBoolean", nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    (void)vr; (void)value;
    return none(c, "fmi2GetString", nvr);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    (void)vr; (void)value;
    return none(c, "fmi2SetBoolean", nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    (void)vr; (void)value;
    return none(c, "fmi2SetString", nvr);
}

/* derivatives: of inputs to first order, of outputs none */

static int slope_is_right(instance *i, const struct variable *v, fmi2Integer order, double value)
{
    const char *wrong = v->role != INPUT ? "is no input, expected phi1 or phi2"
        : order != 1 ? "only a derivative of order 1 is known"
        : value - value != 0 ? "expected a finite derivative" : 0;
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
    for (size_t n = 0; n < nvr; n++) slave_set_slope(&i->now, slave_variable(vr[n], REAL, i->why), value[n]);
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    (void)vr; (void)nvr; (void)order; (void)value;
    if (!in_phase(c, "fmi2GetRealOutputDerivatives", READABLE)) return fmi2Error;
    return refuse(c, "fmi2GetRealOutputDerivatives", "there are none, maxOutputDerivativeOrder is 0");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nUnknown,
                                        const fmi2ValueReference known[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    (void)unknown; (void)nUnknown; (void)known; (void)nKnown; (void)dvKnown; (void)dvUnknown;
    if (!in_phase(c, "fmi2GetDirectionalDerivative", READABLE)) return fmi2Error;
    return refuse(c, "fmi2GetDirectionalDerivative", "there are none, providesDirectionalDerivative is false");
}
