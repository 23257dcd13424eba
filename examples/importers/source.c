/* Motion source: a rectangle at constant speed as motor angles [rad] with their rates [rad/s].
 *
 * Counter-clockwise from the origin, then at rest there.  A corner between two communication points
 * is cut by the straight line between them. */
enum { PHI1, PHI2, PHI1_RATE, PHI2_RATE, WIDTH, HEIGHT, SPEED, RADIUS, VARIABLES };
#include "block.h"

static void set_start_values(block *b)
{
    b->value[WIDTH] = 0.04;  /* [m] */
    b->value[HEIGHT] = 0.03; /* [m] */
    b->value[SPEED] = 0.1;   /* [m/s] */
    b->value[RADIUS] = 5e-3; /* [m] of the pulleys */
}

static void refresh(block *b)
{
    static const double turn[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    double *v = b->value, way = v[SPEED] * b->time, x = 0, y = 0, u = 0, w = 0;
    for (int side = 0; side < 4; side++) {
        const double length = side % 2 ? v[HEIGHT] : v[WIDTH], left = way < length ? way : length;
        const int here = way >= 0 && way < length * (1 - 1e-12);
        x += left * turn[side][0];
        y += left * turn[side][1];
        if (here) u = v[SPEED] * turn[side][0], w = v[SPEED] * turn[side][1];
        way -= length;
        if (here) break;
        if (way < 0) way = 0;
    }
    v[PHI1] = (x + y) / v[RADIUS];
    v[PHI2] = (x - y) / v[RADIUS];
    v[PHI1_RATE] = (u + w) / v[RADIUS];
    v[PHI2_RATE] = (u - w) / v[RADIUS];
}
