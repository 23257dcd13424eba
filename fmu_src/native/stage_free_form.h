/* Free-form laws: piecewise linear forces or Coulomb frictions of an axis, or torques on a motor.
 * Part of stage.c. */
enum { FIRST_FRICTION = FORCE_OVER_T + 1 };

static const lane *free_form_argument(const stage *s, int kind)
{
    switch (kind) {
    case FORCE_OVER_VX: return &s->v[0];
    case FORCE_OVER_VY: return &s->v[1];
    case FORCE_OVER_X: case FRICTION_OVER_X: return &s->q[0];
    case FORCE_OVER_Y: case FRICTION_OVER_Y: return &s->q[1];
    case FORCE_OVER_PHI1: return &s->q[2];
    case FORCE_OVER_PHI2: return &s->q[3];
    default: return 0; /* time */
    }
}

static double interpolate(const lane *knots, const lane *values, int count, double x, int l)
{
    int i = 0;
    if (x <= knots[0][l]) return values[0][l];
    while (i < count - 1 && x > knots[i + 1][l]) i++;
    if (i >= count - 1) return values[count - 1][l];
    return values[i][l]
        + (values[i + 1][l] - values[i][l]) * (x - knots[i][l]) / (knots[i + 1][l] - knots[i][l]);
}

/* what each law of forces, or of frictions, says is added to a coordinate's */
static void add_laws(stage *s, int friction, lane *to, int laws)
{
    for (int f = 0; f < laws; f++) {
        const lane *p = (const lane *)&s->parameter[FREE_FORM_OFFSET + f * FREE_FORM_SIZE];
        for (int l = 0; l < LANES; l++) {
            const int count = (int)p[1][l], kind = (int)p[0][l];
            if (count < 1 || (kind >= FIRST_FRICTION) != friction) continue;
            const lane *argument = free_form_argument(s, kind);
            const double x = argument ? (*argument)[l] : s->now;
            to[f][l] += interpolate(p + 2, p + 2 + KNOTS, count, x, l);
        }
    }
}
