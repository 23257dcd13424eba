/* An FMU that does nothing: what a master's calls cost by themselves.  Values are kept, that is all. */
#include "fmi2FunctionTypes.h" /* types only: what is never called takes no arguments here */

#include <stdlib.h>

enum { VARIABLES = 4096 };
typedef struct { fmi2Real value[VARIABLES]; } empty;

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name; (void)type; (void)guid; (void)location; (void)functions; (void)visible; (void)logging;
    return calloc(1, sizeof(empty));
}

void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop)
{
    (void)c; (void)has_tolerance; (void)tolerance; (void)start; (void)has_stop; (void)stop;
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    empty *e = c;
    for (size_t n = 0; n < nvr; n++) e->value[vr[n] % VARIABLES] = value[n];
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    empty *e = c;
    for (size_t n = 0; n < nvr; n++) value[n] = e->value[vr[n] % VARIABLES];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real duration, fmi2Boolean no_set)
{
    empty *e = c;
    (void)no_set;
    e->value[0] = point + duration;
    return fmi2OK;
}

#define NEVER(name) fmi2Status fmi2##name(void) { return fmi2Error; }
NEVER(SetDebugLogging) NEVER(GetInteger) NEVER(GetBoolean) NEVER(GetString) NEVER(SetInteger)
NEVER(SetBoolean) NEVER(SetString) NEVER(GetFMUstate) NEVER(SetFMUstate) NEVER(FreeFMUstate)
NEVER(SerializedFMUstateSize) NEVER(SerializeFMUstate) NEVER(DeSerializeFMUstate)
NEVER(GetDirectionalDerivative) NEVER(SetRealInputDerivatives) NEVER(GetRealOutputDerivatives)
NEVER(CancelStep) NEVER(GetStatus) NEVER(GetRealStatus) NEVER(GetIntegerStatus)
NEVER(GetBooleanStatus) NEVER(GetStringStatus)
