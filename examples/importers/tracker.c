/* Tracker: a camera that takes x, y [m] every period and rounds them; between samples it holds. */
#include <math.h>

enum { X, Y, X_SEEN, Y_SEEN, PERIOD, RESOLUTION, LAST, VARIABLES };
#include "block.h"

static void set_start_values(block *b)
{
    b->value[PERIOD] = 0.025;   /* [s] */
    b->value[RESOLUTION] = 1e-5; /* [m] */
    b->value[LAST] = -1;        /* number of the last sample */
}

static void refresh(block *b)
{
    double *v = b->value;
    const double sample = floor(b->time / v[PERIOD] + 1e-9);
    if (sample <= v[LAST]) return;
    v[LAST] = sample;
    for (int i = 0; i < 2; i++) v[X_SEEN + i] = v[RESOLUTION] * floor(v[X + i] / v[RESOLUTION] + 0.5);
}
