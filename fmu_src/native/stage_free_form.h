/* Free-form laws: piecewise linear forces or Coulomb frictions of an axis, or torques on a motor.
 * Part of stage.c. */
enum { FIRST_FRICTION = FORCE_OVER_T + 1, NO_LAW = -1, MIXED = -2 };

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

/* where a lane's x lies: behind `from`, up to `to`; the line there */
static void find_segment(struct segment *g, const lane *p, double x, int l)
{
    const lane *knots = p + 2, *values = p + 2 + KNOTS;
    const int count = (int)p[1][l];
    int i = 0; /* the knot ahead */
    while (i < count && x > knots[i][l]) i++;
    const int inside = i > 0 && i < count, near = i < count ? i : i - 1;
    g->from[l] = i > 0 ? knots[i - 1][l] : -INFINITY;
    g->to[l] = i < count ? knots[i][l] : INFINITY;
    g->first[l] = inside ? knots[i - 1][l] : 0.0;
    g->span[l] = inside ? knots[i][l] - knots[i - 1][l] : 1.0;
    g->value[l] = count ? values[inside ? i - 1 : near][l] : 0.0;
    g->rise[l] = inside ? values[i][l] - values[i - 1][l] : 0.0;
}

/* one law of the same kind in all lanes: mostly they stay in the segment of the step before */
static void add_law(struct segment *g, const lane *p, const lane x, lane to)
{
    int left = 0;
    EACH left |= !((x[l] > g->from[l]) & (x[l] <= g->to[l]));
    for (int l = 0; left && l < LANES; l++) find_segment(g, p, x[l], l);
    EACH to[l] += g->value[l] + g->rise[l] * (x[l] - g->first[l]) / g->span[l];
}

/* what each law of forces, or of frictions, says is added to a coordinate's */
static void add_laws(stage *s, int friction, lane *to, int laws)
{
    for (int f = 0; f < laws; f++) {
        const lane *p = (const lane *)&s->parameter[FREE_FORM_OFFSET + f * FREE_FORM_SIZE];
        const int common = s->law_kind[f];
        if (common == NO_LAW || (common >= 0 && (common >= FIRST_FRICTION) != friction)) continue;
        if (common >= 0) {
            const lane *argument = free_form_argument(s, common);
            lane now;
            EACH now[l] = s->now;
            add_law(&s->segment[f], p, argument ? *argument : now, to[f]);
            continue;
        }
        for (int l = 0; l < LANES; l++) {
            const int count = (int)p[1][l], kind = (int)p[0][l];
            if (count < 1 || (kind >= FIRST_FRICTION) != friction) continue;
            const lane *argument = free_form_argument(s, kind);
            const double x = argument ? (*argument)[l] : s->now;
            to[f][l] += interpolate(p + 2, p + 2 + KNOTS, count, x, l);
        }
    }
}

/* which laws there are; what changes from lane to lane is looked up lane by lane */
static void list_laws(stage *s)
{
    memset(s->segment, 0, sizeof s->segment);
    s->has_free_form = s->has_free_friction = 0;
    for (int f = 0; f < FREE_FORMS; f++) {
        const lane *p = (const lane *)&s->parameter[FREE_FORM_OFFSET + f * FREE_FORM_SIZE];
        int *common = &s->law_kind[f];
        *common = NO_LAW;
        for (int l = 0; l < LANES; l++) {
            if (!(p[1][l] > 0)) continue;
            const int kind = (int)p[0][l];
            *common = *common == NO_LAW || *common == kind ? kind : MIXED;
            s->has_free_form = 1;
            s->has_free_friction |= kind >= FIRST_FRICTION;
        }
    }
}
