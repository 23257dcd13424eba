/* The functions of an FMU's library, loaded as an importer does; statuses that must be. */
#ifndef FMU_DRIVER_H
#define FMU_DRIVER_H

#include "fmi2Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EVERY(use) \
    use(fmi2Instantiate) use(fmi2FreeInstance) use(fmi2SetDebugLogging) use(fmi2SetupExperiment) \
    use(fmi2EnterInitializationMode) use(fmi2ExitInitializationMode) use(fmi2Terminate) use(fmi2Reset) \
    use(fmi2GetReal) use(fmi2GetInteger) use(fmi2GetBoolean) use(fmi2GetString) \
    use(fmi2SetReal) use(fmi2SetInteger) use(fmi2SetBoolean) use(fmi2SetString) \
    use(fmi2GetFMUstate) use(fmi2SetFMUstate) use(fmi2FreeFMUstate) use(fmi2SerializedFMUstateSize) \
    use(fmi2SerializeFMUstate) use(fmi2DeSerializeFMUstate) use(fmi2GetDirectionalDerivative) \
    use(fmi2SetRealInputDerivatives) use(fmi2GetRealOutputDerivatives) use(fmi2DoStep) use(fmi2CancelStep) \
    use(fmi2GetStatus) use(fmi2GetRealStatus) use(fmi2GetIntegerStatus) use(fmi2GetBooleanStatus) \
    use(fmi2GetStringStatus) use(fmi2GetVersion) use(fmi2GetTypesPlatform)

#define MEMBER(name) name##TYPE *name;
static struct { EVERY(MEMBER) } fmu;

#define FIND(name) *(void **)&fmu.name = dlsym(library, #name); \
    if (!fmu.name) exit((fprintf(stderr, "%s is not there\n", #name), 3));

static void load_fmu(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) exit((fprintf(stderr, "%s\n", dlerror()), 3));
    EVERY(FIND)
}

/* a status that is not as expected ends the driver */
#define IS(expected, call) \
    do { \
        const int found_ = (int)(call); \
        if (found_ != (expected)) \
            exit((fprintf(stderr, "line %d: %s: status %d, expected %d\n", __LINE__, #call, found_, expected), 1)); \
    } while (0)
#define OK(call) IS(fmi2OK, call)
#define NO(call) IS(fmi2Error, call)

/* references of variables, given by whoever compiles: PHI1, PHI2, X, VX, MASS, DRIVE, INTERPOLATION */
static const fmi2ValueReference IN[2] = {PHI1, PHI2}, OUT[2] = {X, VX}, WEIGHT[1] = {MASS}, CHOICE[1] = {DRIVE},
                                INTERPOLATED[1] = {INTERPOLATION};
static const fmi2Integer FIRST[2] = {1, 1};

static fmi2Component initialised(fmi2Component c)
{
    const fmi2Real angle[2] = {1.0, -2.0};
    OK(fmu.fmi2SetupExperiment(c, fmi2False, 0, 0.0, fmi2False, 0));
    OK(fmu.fmi2EnterInitializationMode(c));
    OK(fmu.fmi2SetReal(c, IN, 2, angle));
    OK(fmu.fmi2ExitInitializationMode(c));
    return c;
}

/* one communication step as a master makes it */
static void step(fmi2Component c, int n, double h, fmi2Real out[2])
{
    const fmi2Real angle[2] = {1.0 + 8.0 * n * h, -2.0}, rate[2] = {8.0, 0.0};
    OK(fmu.fmi2SetReal(c, IN, 2, angle));
    OK(fmu.fmi2SetRealInputDerivatives(c, IN, 2, FIRST, rate));
    OK(fmu.fmi2DoStep(c, n * h, h, fmi2True));
    OK(fmu.fmi2GetReal(c, OUT, 2, out));
}

#endif
