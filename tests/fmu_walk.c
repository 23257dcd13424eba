/* A walk through the whole life of instances, errors included, for valgrind: LIBRARY GUID URI. */
#include "fmu_driver.h"

#include <math.h>

static int told;
static char sentence[1200];

static void hear(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)e; (void)status; (void)category;
    told++;
    snprintf(sentence, sizeof sentence, "%s: %s", name, message);
}

static fmi2CallbackFunctions callbacks = {hear, calloc, free, 0, 0};
static fmi2String guid, uri;

static fmi2Component made(fmi2String name)
{
    return fmu.fmi2Instantiate(name, fmi2CoSimulation, guid, uri, &callbacks, fmi2False, fmi2True);
}

static void refused_instances(void)
{
    static fmi2CallbackFunctions silent;
    char elsewhere[8192];
    snprintf(elsewhere, sizeof elsewhere, "%s/not/here", uri);
    IS(0, fmu.fmi2Instantiate("a", fmi2CoSimulation, "{0}", uri, &callbacks, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate("a", fmi2CoSimulation, 0, uri, &callbacks, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate("a", fmi2ModelExchange, guid, uri, &callbacks, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate(0, fmi2CoSimulation, guid, elsewhere, &callbacks, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate("a", fmi2CoSimulation, guid, "file:", &callbacks, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate("a", fmi2CoSimulation, guid, "file://nowhere", &silent, 0, 0) != 0);
    IS(0, fmu.fmi2Instantiate("a", fmi2CoSimulation, guid, 0, 0, 0, 0) != 0);
}

static void refused_values(fmi2Component c)
{
    const fmi2ValueReference beyond[1] = {4000000000u};
    const fmi2Real one[1] = {1}, nothing[1] = {NAN};
    const fmi2Integer seven[1] = {7}, second[1] = {2};
    fmi2Real value[2];
    fmi2Integer whole[1];
    NO(fmu.fmi2GetReal(c, beyond, 1, value));
    NO(fmu.fmi2GetReal(c, CHOICE, 1, value));
    NO(fmu.fmi2GetReal(c, OUT, 1, 0));
    NO(fmu.fmi2GetInteger(c, OUT, 1, whole));
    NO(fmu.fmi2SetReal(c, beyond, 1, one));
    NO(fmu.fmi2SetReal(c, IN, 1, nothing));
    NO(fmu.fmi2SetReal(c, OUT, 1, one));
    NO(fmu.fmi2SetReal(c, 0, 1, one));
    NO(fmu.fmi2SetInteger(c, CHOICE, 1, seven));
    NO(fmu.fmi2SetString(c, beyond, 1, 0));
    NO(fmu.fmi2GetString(c, beyond, 1, 0));
    NO(fmu.fmi2SetBoolean(c, beyond, 1, 0));
    NO(fmu.fmi2GetBoolean(c, beyond, 1, 0));
    NO(fmu.fmi2SetRealInputDerivatives(c, IN, 1, second, one));
    NO(fmu.fmi2SetRealInputDerivatives(c, IN, 1, 0, one));
    NO(fmu.fmi2CancelStep(c));
}

static void refused_steps(fmi2Component c)
{
    NO(fmu.fmi2DoStep(c, 0, 0, 1));
    NO(fmu.fmi2DoStep(c, 0, -1, 1));
    NO(fmu.fmi2DoStep(c, 0, NAN, 1));
    NO(fmu.fmi2DoStep(c, 5, 1e-3, 1));
    NO(fmu.fmi2DoStep(c, NAN, 1e-3, 1));
    NO(fmu.fmi2DoStep(c, 0, 1e300, 1));
}

static void states(fmi2Component c, fmi2Component other)
{
    fmi2FMUstate state = 0, again = 0;
    fmi2Real out[2], same[2];
    size_t size;
    OK(fmu.fmi2GetFMUstate(c, &state));
    OK(fmu.fmi2GetFMUstate(c, &state));
    OK(fmu.fmi2SerializedFMUstateSize(c, state, &size));
    char *bytes = malloc(size);
    NO(fmu.fmi2SerializeFMUstate(c, state, bytes, size - 1));
    OK(fmu.fmi2SerializeFMUstate(c, state, bytes, size));
    step(c, 3, 1e-3, out);
    OK(fmu.fmi2DeSerializeFMUstate(other, bytes, size, &again));
    OK(fmu.fmi2SetFMUstate(other, again));
    step(other, 3, 1e-3, same);
    IS(0, memcmp(out, same, sizeof out));
    NO(fmu.fmi2DeSerializeFMUstate(other, bytes, size - 1, &again));
    bytes[size / 2] ^= 1;
    NO(fmu.fmi2DeSerializeFMUstate(other, bytes, size, &again));
    NO(fmu.fmi2SetFMUstate(c, 0));
    NO(fmu.fmi2GetFMUstate(c, 0));
    NO(fmu.fmi2SerializedFMUstateSize(c, 0, &size));
    OK(fmu.fmi2FreeFMUstate(c, &state));
    OK(fmu.fmi2FreeFMUstate(c, &state));
    OK(fmu.fmi2FreeFMUstate(other, &again));
    OK(fmu.fmi2FreeFMUstate(c, 0));
    free(bytes);
}

static void derivatives(fmi2Component c)
{
    const fmi2Real seed[2] = {1, 2};
    fmi2Real value[2];
    OK(fmu.fmi2GetDirectionalDerivative(c, OUT, 2, IN, 2, seed, value));
    OK(fmu.fmi2GetRealOutputDerivatives(c, OUT, 2, FIRST, value));
    NO(fmu.fmi2GetDirectionalDerivative(c, IN, 2, IN, 2, seed, value));
    NO(fmu.fmi2GetRealOutputDerivatives(c, IN, 2, FIRST, value));
}

static void statuses(fmi2Component c)
{
    fmi2Status status;
    fmi2Real time;
    fmi2Integer whole;
    fmi2Boolean yes;
    fmi2String text;
    IS(fmi2Discard, fmu.fmi2GetStatus(c, fmi2DoStepStatus, &status));
    IS(fmi2Discard, fmu.fmi2GetIntegerStatus(c, fmi2DoStepStatus, &whole));
    IS(fmi2Discard, fmu.fmi2GetStringStatus(c, fmi2PendingStatus, &text));
    OK(fmu.fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time));
    OK(fmu.fmi2GetBooleanStatus(c, fmi2Terminated, &yes));
}

/* an angle beyond all bounds: the step fails, a reset helps */
static void failed(fmi2Component c)
{
    const fmi2Real far[2] = {1e308, 1e308};
    fmi2Real out[2];
    OK(fmu.fmi2SetReal(c, IN, 2, far));
    NO(fmu.fmi2DoStep(c, 4e-3, 1e-3, 1));
    NO(fmu.fmi2DoStep(c, 5e-3, 1e-3, 1));
    NO(fmu.fmi2SetReal(c, IN, 2, far));
    OK(fmu.fmi2Reset(c));
    initialised(c);
    step(c, 0, 1e-3, out);
}

static void nothing_there(void)
{
    fmi2Real out[2];
    NO(fmu.fmi2DoStep(0, 0, 1e-3, 1));
    NO(fmu.fmi2GetReal(0, OUT, 2, out));
    NO(fmu.fmi2SetReal(0, IN, 2, out));
    NO(fmu.fmi2Reset(0));
    NO(fmu.fmi2Terminate(0));
    NO(fmu.fmi2SetupExperiment(0, 0, 0, 0, 0, 0));
    NO(fmu.fmi2GetFMUstate(0, 0));
    NO(fmu.fmi2GetRealStatus(0, fmi2LastSuccessfulTime, out));
    NO(fmu.fmi2GetRealOutputDerivatives(0, OUT, 2, FIRST, out));
    fmu.fmi2FreeInstance(0);
}

int main(int count, char **words)
{
    fmi2Real out[2];
    if (count < 4) return 2;
    load_fmu(words[1]);
    guid = words[2];
    uri = words[3];
    IS(0, strcmp(fmu.fmi2GetVersion(), "2.0"));
    IS(0, strcmp(fmu.fmi2GetTypesPlatform(), "default"));
    fmi2Component c = made("one"), other = made("other"), idle = made("idle");
    if (!c || !other || !idle) return fprintf(stderr, "%s\n", sentence), 4;
    refused_values(c);
    NO(fmu.fmi2DoStep(c, 0, 1e-3, 1));
    initialised(c);
    initialised(other);
    refused_values(c);
    refused_steps(c);
    for (int n = 0; n < 3; n++) step(c, n, 1e-3, out);
    derivatives(c);
    states(c, other);
    statuses(c);
    failed(c);
    OK(fmu.fmi2Terminate(c));
    NO(fmu.fmi2DoStep(c, 1e-3, 1e-3, 1));
    OK(fmu.fmi2SetupExperiment(idle, 0, 0, 0, 1, 1));
    OK(fmu.fmi2EnterInitializationMode(idle));
    derivatives(idle);
    fmu.fmi2FreeInstance(c);
    fmu.fmi2FreeInstance(other); /* in the middle of its run */
#ifndef FORGET /* the control: does valgrind see it? */
    fmu.fmi2FreeInstance(idle);
#endif
    refused_instances();
    nothing_there();
    printf("%d sentences\n", told);
    return 0;
}
