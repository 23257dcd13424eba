/* One coordinate's kick: what a step's forces and friction make of a speed.  Part of stage.c. */

/* Coulomb friction F(v) = f min(x, a1 + b1 x, a2 + b2 x, 1), x = |v| / v_s: tanh within 2 %.  Being
 * concave, its implicit kick is in closed form: each line alone takes away gain |v| + lift, and the
 * least of them holds.  v_s = 0 is set-valued friction: gain 1, lift 0. */
static const double ROUND_START[2] = {0.194, 0.667}, ROUND_SLOPE[2] = {0.596, 0.1546};
typedef struct { double gain0, gain1, lift1, gain2, lift2; } rounding; /* names: arrays stay scalar */
/* c: what friction takes away of a fast one, s: the speed scale; one division for all three lines */
INLINE rounding rounded(double c, double s)
{
    const double steep = c * ROUND_SLOPE[0], flat = c * ROUND_SLOPE[1];
    const double own = s + c, first = s + steep, second = s + flat, both = first * second;
    const double part = 1.0 / (own * both), cut = c * s * (own * part);
    const rounding r = {
        pick(s > 0, c * (both * part), 1.0),
        pick(s > 0, steep * (own * second * part), 1.0), pick(s > 0, ROUND_START[0] * cut * second, 0.0),
        pick(s > 0, flat * (own * first * part), 1.0), pick(s > 0, ROUND_START[1] * cut * first, 0.0),
    };
    return r;
}
/* what Coulomb friction leaves of a speed; c is what it takes away of a fast one */
INLINE double slide(double v, double c, rounding r)
{
    const double size = fabs(v);
    const double slow = smaller(r.gain0 * size, c);
    const double fast = smaller(r.gain1 * size + r.lift1, r.gain2 * size + r.lift2);
    return v - copysign(smaller(slow, fast), v);
}
/* the same of set-valued friction */
INLINE double stop(double v, double c) { return v - larger(-c, smaller(v, c)); }

/* a step of length h: what stays of a speed, what a force adds, what friction takes away at most */
typedef struct { double keep, push, slip; } kick;
INLINE kick kick_of(double h, double mass, double damping, double bound)
{
    const double lag = 0.5 * h * damping, share = 1.0 / (mass + lag), push = h * share;
    const kick k = {(mass - lag) * share, push, push * bound};
    return k;
}

/* the kicks of constant damping and mass, for steps of length h */
static void set_kick(stage *s, double h)
{
    for (int i = 0; i < s->coordinates; i++)
        EACH {
            const kick k = kick_of(h, s->mass[i][l], s->damping0[i][l], s->bound0[i][l]);
            s->keep[i][l] = k.keep, s->push[i][l] = k.push, s->slip[i][l] = k.slip;
            if (!s->smooth) continue;
            const rounding r = rounded(k.slip, s->smoothing[i][l]);
            s->round_gain[0][i][l] = r.gain0, s->round_gain[1][i][l] = r.gain1, s->round_gain[2][i][l] = r.gain2;
            s->round_lift[0][i][l] = r.lift1, s->round_lift[1][i][l] = r.lift2;
        }
}

/* the kick of coordinate i with the constants of set_kick; ``smooth`` is s->smooth, known to the
 * compiler, so that set-valued friction costs nothing of the other */
INLINE double kicked_free(const stage *s, int i, int l, double v, double force, const int smooth)
{
    const double fast = s->keep[i][l] * v + s->push[i][l] * force;
    if (!smooth) return stop(fast, s->slip[i][l]);
    const rounding r = {s->round_gain[0][i][l], s->round_gain[1][i][l], s->round_lift[0][i][l],
                        s->round_gain[2][i][l], s->round_lift[1][i][l]};
    return slide(fast, s->slip[i][l], r);
}

/* the kick of a coordinate whose mass, damping or bound are not the constants of set_kick */
INLINE double kicked_by(const stage *s, int i, int l, double mass, double damping, double bound,
                        const int smooth)
{
    const kick k = kick_of(s->held_step, mass, damping, larger(bound, 0.0));
    const double fast = k.keep * s->v[i][l] + k.push * s->force[i][l];
    return smooth ? slide(fast, k.slip, rounded(k.slip, s->smoothing[i][l])) : stop(fast, k.slip);
}

/* the kick of a coordinate of which only the bound is not a constant of set_kick */
INLINE double kicked_within(const stage *s, int i, int l, double bound, const int smooth)
{
    const double slip = s->push[i][l] * larger(bound, 0.0);
    const double fast = s->keep[i][l] * s->v[i][l] + s->push[i][l] * s->force[i][l];
    return smooth ? slide(fast, slip, rounded(slip, s->smoothing[i][l])) : stop(fast, slip);
}

INLINE double drifted(double q, double v, double half) { return q + half * v; }

/* velocity in the middle of the coming step; exactly 0 while it sticks */
INLINE double middle_velocity(const stage *s, int i, int l)
{
    return pick(s->v[i][l] != 0, 1.5 * s->v[i][l] - 0.5 * s->before[i][l], 0.0);
}
