/* FMI 2.0 for co-simulation: life cycle, steps and status.  Values and states are in files beside. */
#include "fmi2_instance.h"
#include "machine_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

/* instantiation: the right FMU, and its machine read and checked */

static int is_ours(fmi2Type type, fmi2String guid, char *why)
{
    if (type != fmi2CoSimulation)
        return snprintf(why, SENTENCE, "this FMU is for co-simulation, not for model exchange"), 0;
    if (!guid || strcmp(guid, slave_interface()))
        return snprintf(why, SENTENCE, "fmuGUID: found %.60s, expected %s", guid ? guid : "none",
                        slave_interface()), 0;
    return 1;
}

static int load(instance *i, fmi2String location)
{
    char machine[MACHINE_NAME] = "", sentence[MACHINE_NAME + 32];
    if (!read_machine(location, &i->first, machine, i->why)) return 0;
    i->first.phase = INSTANTIATED;
    i->first.stop = HUGE_VAL;
    i->now = i->first;
    snprintf(sentence, sizeof sentence, "machine %s", machine);
    tell(i, sentence);
    return 1;
}

static instance *new_instance(fmi2String name, const fmi2CallbackFunctions *callbacks, fmi2Boolean events)
{
    instance *i = calloc(1, sizeof *i);
    const char *known = name ? name : "";
    if (!i) return 0;
    i->logger = callbacks ? callbacks->logger : 0;
    i->environment = callbacks ? callbacks->componentEnvironment : 0;
    i->events = events != fmi2False;
    i->name = malloc(strlen(known) + 1);
    if (i->name) strcpy(i->name, known);
    return i;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    instance *i = new_instance(instanceName, functions, loggingOn);
    (void)visible;
    if (!i) return 0;
    if (i->name && is_ours(fmuType, fmuGUID, i->why) && load(i, fmuResourceLocation)) return i;
    refuse(i, "fmi2Instantiate", i->name ? i->why : "no memory");
    fmi2FreeInstance(i);
    return 0;
}

void fmi2FreeInstance(fmi2Component c)
{
    instance *i = c;
    if (!i) return;
    free(i->name);
    free(i);
}

/* errors are always told; events where logging is on for them or for all */
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    instance *i = c;
    int events = nCategories == 0;
    if (!in_phase(i, "fmi2SetDebugLogging", READABLE)) return fmi2Error;
    for (size_t n = 0; n < nCategories; n++) {
        const char *name = categories[n] ? categories[n] : "";
        const int wide = !strcmp(name, "logEvents") || !strcmp(name, "logAll");
        events |= wide;
        if (wide || !strncmp(name, "logStatus", 9)) continue;
        snprintf(i->why, SENTENCE, "category %.60s is unknown, expected %s", name,
                 "logEvents, logStatusError, logStatusDiscard or logAll");
        return refuse(i, "fmi2SetDebugLogging", i->why);
    }
    if (events) i->events = loggingOn != fmi2False;
    return fmi2OK;
}

/* initialisation */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    instance *i = c;
    (void)toleranceDefined; (void)tolerance;
    if (!in_phase(i, "fmi2SetupExperiment", INSTANTIATED)) return fmi2Error;
    if (!isfinite(startTime)) return refuse(i, "fmi2SetupExperiment", "startTime: expected a finite number [s]");
    if (stopTimeDefined && !(stopTime >= startTime))
        return refuse(i, "fmi2SetupExperiment", "stopTime: expected a number that is not below startTime [s]");
    i->now.start = i->now.stage.time = startTime;
    i->now.stop = stopTimeDefined ? stopTime : HUGE_VAL;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    instance *i = c;
    if (!in_phase(i, "fmi2EnterInitializationMode", INSTANTIATED)) return fmi2Error;
    i->now.phase = INITIALIZING;
    i->now.fresh = 0;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    instance *i = c;
    if (!in_phase(i, "fmi2ExitInitializationMode", INITIALIZING)) return fmi2Error;
    if (!slave_start(&i->now, i->why)) return refuse(i, "fmi2ExitInitializationMode", i->why);
    i->now.phase = STEPPING;
    snprintf(i->why, SENTENCE, "micro-steps of at most %.4g s", i->now.limit);
    tell(i, i->why);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    instance *i = c;
    if (!in_phase(i, "fmi2Terminate", STEPPING | FAILED)) return fmi2Error;
    i->now.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    instance *i = c;
    if (!in_phase(i, "fmi2Reset", READABLE)) return fmi2Error;
    i->now = i->first;
    return fmi2OK;
}

/* a refused step leaves everything as it was; a state that blew up can only be reset or restored */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    instance *i = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!in_phase(i, "fmi2DoStep", STEPPING)) return fmi2Error;
    if (!slave_check_step(&i->now, currentCommunicationPoint, communicationStepSize, i->why))
        return refuse(i, "fmi2DoStep", i->why);
    if (slave_step(&i->now, currentCommunicationPoint, communicationStepSize, i->why)) return fmi2OK;
    i->now.phase = FAILED;
    return refuse(i, "fmi2DoStep", i->why);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    if (!in_phase(c, "fmi2CancelStep", STEPPING)) return fmi2Error;
    return refuse(c, "fmi2CancelStep", "a step is complete when fmi2DoStep returns");
}

/* status: steps are never pending */

static fmi2Status discard(instance *i, const char *function)
{
    if (!in_phase(i, function, READABLE)) return fmi2Error;
    return refuse_as(i, fmi2Discard, function, "a step is never pending, so there is nothing to tell");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s; (void)value;
    return discard(c, "fmi2GetStatus");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    instance *i = c;
    if (!i || !value || s != fmi2LastSuccessfulTime) return discard(i, "fmi2GetRealStatus");
    *value = i->now.stage.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    (void)s; (void)value;
    return discard(c, "fmi2GetIntegerStatus");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    instance *i = c;
    if (!i || !value || s != fmi2Terminated) return discard(i, "fmi2GetBooleanStatus");
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s; (void)value;
    return discard(c, "fmi2GetStringStatus");
}
