/* Instances in threads of their own, for the thread sanitizer: LIBRARY GUID URI. */
#include "fmu_driver.h"

#include <pthread.h>

enum { THREADS = 4, STEPS = 60, ROUNDS = 3 };
static fmi2String guid, uri;
static fmi2Real ends[THREADS][2];
#ifdef RACE /* the control: does the sanitizer see it? */
static int shared;
#define TOUCH() (shared++)
#else
#define TOUCH() ((void)0)
#endif

static void hear(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)name; (void)status; (void)category; (void)message;
    ++*(int *)e;
}

static void live(int which, fmi2Component c)
{
    const fmi2Real direction[2] = {1, 2};
    fmi2Real slope[2];
    fmi2FMUstate state = 0;
    initialised(c);
    TOUCH();
    for (int n = 0; n < STEPS; n++) {
        if (n == STEPS / 2) OK(fmu.fmi2GetFMUstate(c, &state));
        step(c, n, 1e-3, ends[which]);
        NO(fmu.fmi2DoStep(c, 0, -1, 1));
        OK(fmu.fmi2GetRealOutputDerivatives(c, OUT, 2, FIRST, slope));
        OK(fmu.fmi2GetDirectionalDerivative(c, OUT, 2, IN, 2, direction, slope));
    }
    OK(fmu.fmi2SetFMUstate(c, state));
    OK(fmu.fmi2FreeFMUstate(c, &state));
    for (int n = STEPS / 2; n < STEPS; n++) step(c, n, 1e-3, ends[which]);
    OK(fmu.fmi2Reset(c));
}

static void *run(void *which)
{
    int told = 0;
    fmi2CallbackFunctions callbacks = {hear, calloc, free, 0, &told};
    for (int n = 0; n < ROUNDS; n++) {
        fmi2Component c = fmu.fmi2Instantiate("one", fmi2CoSimulation, guid, uri, &callbacks, 0, fmi2True);
        IS(1, c != 0);
        live(*(int *)which, c);
        fmu.fmi2FreeInstance(c);
    }
    IS(1, told > ROUNDS * STEPS);
    return 0;
}

int main(int count, char **words)
{
    pthread_t threads[THREADS];
    int which[THREADS];
    if (count < 4) return 2;
    load_fmu(words[1]);
    guid = words[2];
    uri = words[3];
    for (int i = 0; i < THREADS; i++) which[i] = i, pthread_create(&threads[i], 0, run, &which[i]);
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], 0);
    for (int i = 1; i < THREADS; i++) IS(0, memcmp(ends[0], ends[i], sizeof ends[0]));
    printf("%.17g\n", ends[0][0]);
    return 0;
}
