/* What a step calls in the C library: every import that allocates, locks or writes is counted here.
 * LIBRARY GUID URI; compiled with -rdynamic, so that the library finds these in place of libc's. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include "fmu_driver.h"

#include <stdarg.h>

static int calls;
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void __libc_free(void *);

void *malloc(size_t size) { calls++; return __libc_malloc(size); }
void *calloc(size_t count, size_t size) { calls++; return __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { calls++; return __libc_realloc(old, size); }
void free(void *old) { calls++; __libc_free(old); }

int snprintf(char *to, size_t size, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int length = vsnprintf(to, size, format, list);
    va_end(list);
    calls++;
    return length;
}

int sprintf(char *to, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int length = vsnprintf(to, (size_t)1 << 30, format, list);
    va_end(list);
    calls++;
    return length;
}

FILE *fopen(const char *path, const char *mode)
{
    FILE *(*next)(const char *, const char *);
    *(void **)&next = dlsym(RTLD_NEXT, "fopen");
    calls++;
    return next(path, mode);
}

size_t fread(void *to, size_t size, size_t count, FILE *file)
{
    size_t (*next)(void *, size_t, size_t, FILE *);
    *(void **)&next = dlsym(RTLD_NEXT, "fread");
    calls++;
    return next(to, size, count, file);
}

int fclose(FILE *file)
{
    int (*next)(FILE *);
    *(void **)&next = dlsym(RTLD_NEXT, "fclose");
    calls++;
    return next(file);
}

/* calls of what a master does at a communication point */
static int in_steps(fmi2Component c, double h)
{
    const fmi2Real direction[2] = {1, 2};
    fmi2Real out[2];
    const int before = calls;
    for (int n = 0; n < 200; n++) step(c, n, h, out);
    OK(fmu.fmi2GetRealOutputDerivatives(c, OUT, 2, FIRST, out));
    OK(fmu.fmi2GetDirectionalDerivative(c, OUT, 2, IN, 2, direction, out));
    return calls - before;
}

static int in_refusal(fmi2Component c)
{
    const int before = calls;
    NO(fmu.fmi2DoStep(c, 0, -1, 1));
    return calls - before;
}

int main(int count, char **words)
{
    if (count < 4) return 2;
    load_fmu(words[1]);
    const int before = calls;
    fmi2Component c = fmu.fmi2Instantiate("one", fmi2CoSimulation, words[2], words[3], 0, 0, fmi2False);
    IS(1, c != 0);
    const int made = calls - before;
    initialised(c);
    const int steps = in_steps(c, 1e-3), refusal = in_refusal(c);
    printf("%d %d %d\n", made, steps, refusal);
    fmu.fmi2FreeInstance(c);
    return 0;
}
