/* FMI 2.0: getting and setting values. */
#include "fmi2_instance.h"

#include <stdio.h>

/* outputs of initialisation follow from what is set so far */
int refresh(instance *i, const char *function)
{
    if (i->now.fresh || !(i->now.phase & (INSTANTIATED | INITIALIZING))) return 1;
    if (slave_start(&i->now, i->why)) return 1;
    refuse(i, function, i->why);
    return 0;
}

const struct variable *find(instance *i, const char *function, fmi2ValueReference reference, int type)
{
    const struct variable *v = slave_variable(reference, type, i->why);
    if (!v) refuse(i, function, i->why);
    return v;
}

/* both arrays of a call are there */
int arrays(instance *i, const char *function, size_t count, const void *a, const void *b)
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
    if (slave_set_inputs(&i->now, vr, nvr, value)) return fmi2OK;
    for (size_t n = 0; n < nvr; n++)
        if (!settable(i, "fmi2SetReal", vr[n], REAL, value[n])) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) slave_set(&i->now, slave_known(vr[n]), value[n]);
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    instance *i = c;
    if (!in_phase(i, "fmi2SetInteger", SETTABLE) || !arrays(i, "fmi2SetInteger", nvr, vr, value)) return fmi2Error;
    for (size_t n = 0; n < nvr; n++)
        if (!settable(i, "fmi2SetInteger", vr[n], INTEGER, value[n])) return fmi2Error;
    for (size_t n = 0; n < nvr; n++) slave_set(&i->now, slave_known(vr[n]), value[n]);
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
