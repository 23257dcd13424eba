/* Time of communication steps of 1 ms in a bare host, [ns] each, the least of some rounds.
 *
 * host LIBRARY GUID RESOURCE_URI STEPS phi1 phi2 phi1_rate phi2_rate x y (references)
 * host kernel MACHINE_FILE_URI STEPS: the stage alone, without FMI, compiled in with -DKERNEL */
#define _GNU_SOURCE
#include "fmi2Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#ifdef KERNEL
#include "machine_file.h"
#endif

enum { ROUNDS = 41, HALF = 100 }; /* steps one way, then as many back */
static const double STEP = 1e-3, SPEED = 8.0; /* [s], [rad/s] */

/* a triangle: angle [rad] at a step and its rate */
static double rate_at(int n) { return n / HALF % 2 ? -SPEED : SPEED; }
static double angle_at(int n)
{
    const int in = n % (2 * HALF);
    return SPEED * STEP * (in < HALF ? in : 2 * HALF - in);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void told(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)e;
    fprintf(stderr, "%s %d %s: %s\n", name, (int)status, category ? category : "", message);
}

static fmi2CallbackFunctions callbacks = {told, calloc, free, 0, 0};

#define USE(name) name##TYPE *use_##name; *(void **)&use_##name = dlsym(library, #name)
#define MUST(call) if ((call) != fmi2OK) return fprintf(stderr, "%s\n", #call), 1

static int through_fmi(char **words)
{
    fmi2ValueReference in[4], out[2];
    fmi2Real value[4], seen[2] = {0, 0};
    const int steps = atoi(words[4]);
    double least = 1e300;
    void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 3;
    USE(fmi2Instantiate); USE(fmi2SetupExperiment); USE(fmi2EnterInitializationMode);
    USE(fmi2ExitInitializationMode); USE(fmi2SetReal); USE(fmi2GetReal); USE(fmi2DoStep);
    for (int i = 0; i < 4; i++) in[i] = (fmi2ValueReference)atoi(words[5 + i]);
    for (int i = 0; i < 2; i++) out[i] = (fmi2ValueReference)atoi(words[9 + i]);
    fmi2Component c = use_fmi2Instantiate("one", fmi2CoSimulation, words[2], words[3], &callbacks, 0, 0);
    if (!c) return 4;
    MUST(use_fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
    MUST(use_fmi2EnterInitializationMode(c));
    MUST(use_fmi2ExitInitializationMode(c));
    for (int round = 0, n = 0; round < ROUNDS; round++) {
        const double begun = now();
        for (int end = n + steps; n < end; n++) {
            value[0] = angle_at(n), value[1] = 0.0, value[2] = rate_at(n), value[3] = 0.0;
            MUST(use_fmi2SetReal(c, in, 4, value));
            MUST(use_fmi2DoStep(c, n * STEP, STEP, fmi2True));
            MUST(use_fmi2GetReal(c, out, 2, seen));
        }
        const double each = (now() - begun) / steps;
        if (each < least) least = each;
    }
    printf("%.17g %.17g %.17g\n", least, seen[0], seen[1]);
    fflush(stdout);
    _exit(0); /* pythonfmu's binary may abort a host that ends in good order */
}

#ifdef KERNEL
static int kernel_alone(char **words)
{
    static slave s;
    char name[MACHINE_NAME], why[SENTENCE];
    const int steps = atoi(words[3]);
    double least = 1e300;
    if (!read_machine(words[2], &s, name, why) || !slave_start(&s, why)) return fprintf(stderr, "%s\n", why), 4;
    stage *stage = &s.stage;
    for (int round = 0, n = 0; round < ROUNDS; round++) {
        const double begun = now();
        for (int end = n + steps; n < end; n++) {
            stage->input[0][0] = angle_at(n), stage->input[1][0] = 0.0;
            stage->input_rate[0][0] = rate_at(n), stage->input_rate[1][0] = 0.0;
            stage->input_time = stage->time = n * STEP;
            stage_advance(stage, STEP, s.limit);
            stage_report(stage);
        }
        const double each = (now() - begun) / steps;
        if (each < least) least = each;
    }
    printf("%.17g %.17g %.17g\n", least, **stage_output(stage, OUT_X), **stage_output(stage, OUT_Y));
    return 0;
}
#endif

int main(int count, char **words)
{
#ifdef KERNEL
    if (count == 4 && !strcmp(words[1], "kernel")) return kernel_alone(words);
#endif
    return count == 11 ? through_fmi(words) : 2;
}
