/* One instance of the FMU: its slave, its master's callbacks, and the order of calls. */
#ifndef COREXY_FMI2_INSTANCE_H
#define COREXY_FMI2_INSTANCE_H

#include "fmi2Functions.h"
#include "slave.h"

enum {
    INSTANTIATED = 1, INITIALIZING = 2, STEPPING = 4, TERMINATED = 8, FAILED = 16,
    READABLE = INSTANTIATED | INITIALIZING | STEPPING | TERMINATED | FAILED,
    SETTABLE = INSTANTIATED | INITIALIZING | STEPPING
};

typedef struct {
    slave now, first, trial;             /* first: as the machine file made it; trial: to look ahead */
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    int events;                          /* does the master want logEvents? */
    char why[SENTENCE], text[2 * SENTENCE + 64];
    char *name;
} instance;

/* log a sentence, whatever the master wants to hear, and give the status: fmi2Error, or another */
fmi2Status refuse(instance *i, const char *function, const char *why);
fmi2Status refuse_as(instance *i, fmi2Status status, const char *function, const char *why);

/* tell an event, where the master wants to hear of it */
void tell(instance *i, const char *sentence);

/* may this function be called now?  0 after a sentence */
int in_phase(instance *i, const char *function, unsigned phases);

/* are both arrays of a call there, is there such a variable, are outputs up to date?  0 after a sentence */
int arrays(instance *i, const char *function, size_t count, const void *a, const void *b);
const struct variable *find(instance *i, const char *function, fmi2ValueReference reference, int type);
int refresh(instance *i, const char *function);

#endif
