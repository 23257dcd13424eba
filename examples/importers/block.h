/* The smallest FMI 2.0 co-simulation block: Real values, a start and a step that a model brings. */
#include "fmi2Functions.h"

#include <stdlib.h>
#include <string.h>

typedef struct { double time, value[VARIABLES]; } block;

/* the model's: values at a point in time, and after what lies between two points */
static void set_start_values(block *b);
static void refresh(block *b);

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    block *b = 0;
    (void)name; (void)location; (void)functions; (void)visible; (void)logging;
    if (type == fmi2CoSimulation && guid && !strcmp(guid, GUID)) b = calloc(1, sizeof *b);
    if (b) set_start_values(b);
    return b;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    ((block *)c)->time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { refresh(c); return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { refresh(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c)
{
    memset(c, 0, sizeof(block));
    set_start_values(c);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    for (size_t n = 0; n < nvr; n++) {
        if (vr[n] >= VARIABLES) return fmi2Error;
        value[n] = ((block *)c)->value[vr[n]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    for (size_t n = 0; n < nvr; n++) {
        if (vr[n] >= VARIABLES) return fmi2Error;
        ((block *)c)->value[vr[n]] = value[n];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real duration, fmi2Boolean no_set)
{
    block *b = c;
    (void)no_set;
    if (!(duration > 0)) return fmi2Error;
    b->time = point + duration;
    refresh(b);
    return fmi2OK;
}

/* what this block does not have; importers look for the names */
#define NOTHING (void)c; return fmi2Error
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String s[])
{ (void)c; (void)on; (void)n; (void)s; return fmi2OK; }
#define GET(Type) fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##Type v[]) \
{ (void)c; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; } \
fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##Type v[]) \
{ (void)c; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
GET(Integer) GET(Boolean) GET(String)
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { (void)s; NOTHING; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { (void)s; NOTHING; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { (void)s; NOTHING; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { (void)s; (void)n; NOTHING; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
{ (void)s; (void)b; (void)n; NOTHING; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
{ (void)s; (void)b; (void)n; NOTHING; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
                                        const fmi2ValueReference k[], size_t nk, const fmi2Real d[], fmi2Real v[])
{ (void)u; (void)nu; (void)k; (void)nk; (void)d; (void)v; NOTHING; }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer o[], const fmi2Real v[])
{ (void)vr; (void)n; (void)o; (void)v; NOTHING; }
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer o[], fmi2Real v[])
{ (void)vr; (void)n; (void)o; (void)v; NOTHING; }
fmi2Status fmi2CancelStep(fmi2Component c) { NOTHING; }
#define STATUS(Name, Type) fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind s, Type *v) \
{ (void)c; (void)s; (void)v; return fmi2Discard; }
STATUS(Status, fmi2Status) STATUS(RealStatus, fmi2Real) STATUS(IntegerStatus, fmi2Integer)
STATUS(BooleanStatus, fmi2Boolean) STATUS(StringStatus, fmi2String)
