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

/* a lane's argument; of laws over time it counts from their onset */
INLINE double argument_of(const stage *s, const lane *p, const lane *argument, int l)
{
    return argument ? (*argument)[l] : s->now - p[LAW_ONSET][l];
}

/* where a lane's x lies: behind `from`, up to `to`; the line there */
static void find_segment(struct segment *g, const lane *p, double x, int l)
{
    const lane *knots = p + LAW_KNOTS, *values = knots + KNOTS;
    const int count = (int)p[LAW_COUNT][l];
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

INLINE int leaves(const struct segment *g, double x, int l)
{
    return !((x > g->from[l]) & (x <= g->to[l]));
}

INLINE double line_of(const struct segment *g, double x, int l)
{
    return g->value[l] + g->rise[l] * (x - g->first[l]) / g->span[l];
}

/* a law of the same kind in all lanes: mostly they stay in the segment of the step before */
static void common_law(const stage *s, struct segment *g, const lane *p, int kind, lane value)
{
    const lane *argument = free_form_argument(s, kind);
    lane x;
    int left = 0;
    EACH x[l] = argument_of(s, p, argument, l);
    EACH left |= leaves(g, x[l], l);
    for (int l = 0; left && l < LANES; l++) find_segment(g, p, x[l], l);
    EACH value[l] = line_of(g, x[l], l);
}

/* laws of other kinds beside each other: 0 where a lane has none that acts so */
static void mixed_law(const stage *s, struct segment *g, const lane *p, int friction, lane value)
{
    for (int l = 0; l < LANES; l++) {
        const int kind = (int)p[LAW_KIND][l];
        value[l] = 0.0;
        if (p[LAW_COUNT][l] < 1 || (kind >= FIRST_FRICTION) != friction) continue;
        const double x = argument_of(s, p, free_form_argument(s, kind), l);
        if (leaves(g, x, l)) find_segment(g, p, x, l);
        value[l] = line_of(g, x, l);
    }
}

/* what each law of forces, or of frictions, says is added to a coordinate's */
static void add_laws(stage *s, int friction, lane *to, int laws)
{
    for (int f = 0; f < laws; f++) {
        const lane *p = (const lane *)&s->parameter[FREE_FORM_OFFSET + f * FREE_FORM_SIZE];
        const int common = s->law_kind[f];
        lane value;
        if (common == NO_LAW || (common >= 0 && (common >= FIRST_FRICTION) != friction)) continue;
        if (common >= 0) common_law(s, &s->segment[f], p, common, value);
        else mixed_law(s, &s->segment[f], p, friction, value);
        EACH to[f][l] += value[l];
        if (!friction || !s->has_viscous_law) continue;
        EACH s->damping[f][l] = larger(s->damping[f][l] + p[LAW_VISCOUS][l] * value[l], 0.0);
    }
}

/* which laws there are; what changes from lane to lane is looked up lane by lane */
static void list_laws(stage *s)
{
    memset(s->segment, 0, sizeof s->segment);
    s->has_free_form = s->has_free_friction = s->has_viscous_law = 0;
    for (int f = 0; f < FREE_FORMS; f++) {
        const lane *p = (const lane *)&s->parameter[FREE_FORM_OFFSET + f * FREE_FORM_SIZE];
        int *common = &s->law_kind[f];
        *common = NO_LAW;
        for (int l = 0; l < LANES; l++) {
            if (!(p[LAW_COUNT][l] > 0)) continue;
            const int kind = (int)p[LAW_KIND][l], friction = kind >= FIRST_FRICTION;
            *common = *common == NO_LAW || *common == kind ? kind : MIXED;
            s->has_free_form = 1;
            s->has_free_friction |= friction;
            s->has_viscous_law |= friction && p[LAW_VISCOUS][l] != 0;
        }
    }
}
