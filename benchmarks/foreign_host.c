/* Run an FMU of another platform over a table of inputs: the host of benchmarks/platforms.py.
 *
 * host LIBRARY GUID RESOURCE_URI < table: step [s], then a row of phi1 phi2 [rad] and their rates for
 * each communication point.  Gives x_true y_true x y at each point, in full. */
#include "fmi2Functions.h"

#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) LoadLibraryA(path)
#define FIND(library, name) (void (*)(void))GetProcAddress(library, name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) (void (*)(void))dlsym(library, name)
#endif

#define USE(name) name##TYPE *use_##name = (name##TYPE *)FIND(library, #name)
#define MUST(call) if ((call) != fmi2OK) return fprintf(stderr, "%s\n", #call), 1

static void told(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)e;
    fprintf(stderr, "%s %d %s: %s\n", name, (int)status, category, message);
}

static fmi2CallbackFunctions callbacks = {told, calloc, free, 0, 0};

int main(int count, char **words)
{
    const fmi2ValueReference out[4] = {OUTPUTS}, in[4] = {INPUTS};
    if (count < 4) return fprintf(stderr, "expected LIBRARY GUID RESOURCE_URI\n"), 2;
    void *library = (void *)OPEN(words[1]);
    if (!library) return fprintf(stderr, "%s does not load\n", words[1]), 3;
    USE(fmi2Instantiate); USE(fmi2SetupExperiment); USE(fmi2EnterInitializationMode);
    USE(fmi2ExitInitializationMode); USE(fmi2SetReal); USE(fmi2GetReal); USE(fmi2DoStep);
    USE(fmi2Terminate); USE(fmi2FreeInstance);
    fmi2Component c = use_fmi2Instantiate("one", fmi2CoSimulation, words[2], words[3], &callbacks, 0, 0);
    double step, value[4];
    if (!c || scanf("%lf", &step) != 1) return 4;
    MUST(use_fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
    MUST(use_fmi2EnterInitializationMode(c));
    for (int row = 0; scanf("%lf %lf %lf %lf", value, value + 1, value + 2, value + 3) == 4; row++) {
        MUST(use_fmi2SetReal(c, in, 4, value));
        if (row == 0) MUST(use_fmi2ExitInitializationMode(c));
        MUST(use_fmi2GetReal(c, out, 4, value));
        printf("%.17g %.17g %.17g %.17g\n", value[0], value[1], value[2], value[3]);
        MUST(use_fmi2DoStep(c, row * step, step, 1));
    }
    MUST(use_fmi2Terminate(c));
    use_fmi2FreeInstance(c);
    return 0;
}
