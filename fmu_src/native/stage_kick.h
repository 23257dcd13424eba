/* The kicks of axes, rotors and idlers, hooks in between.  Part of stage.c. */

INLINE void kick_from(stage *s, int first, int end, double half, const int smooth)
{
    for (int i = first; i < end; i++)
        EACH {
            const double v = kicked_free(s, i, l, s->v[i][l], s->force[i][l], smooth);
            s->before[i][l] = s->v[i][l];
            s->v[i][l] = v;
            s->q[i][l] = drifted(s->q[i][l], v, half);
        }
}

/* coordinates whose friction no law changes */
INLINE void kick_free(stage *s, int first, int end, double half)
{
    if (s->smooth) kick_from(s, first, end, half, 1);
    else kick_from(s, first, end, half, 0);
}

/* ``bound_only``: masses and damping are the constants of set_kick */
INLINE void kick_axes(stage *s, double half, const int bound_only, const int smooth)
{
    for (int i = 0; i < 2; i++)
        EACH {
            const double v = bound_only
                ? kicked_within(s, i, l, s->bound[i][l], smooth)
                : kicked_by(s, i, l, s->moving[i][l], s->damping[i][l], s->bound[i][l], smooth);
            s->v[i][l] = v;
            s->q[i][l] = drifted(s->q[i][l], v, half);
        }
}

/* an axis whose friction or force a law changes */
static void kick_guides(stage *s, double half)
{
    const int needs = s->needs;
    for (int i = 0; i < 2; i++) {
        if (needs & (NEEDS_BOUND | NEEDS_INERTIA)) EACH s->bound[i][l] = s->bound0[i][l];
        if (needs & NEEDS_INERTIA)
            EACH { s->damping[i][l] = s->damping0[i][l]; s->moving[i][l] = s->mass[i][l]; }
        if (needs & NEEDS_ACROSS) EACH s->across[i][l] = s->force[1 - i][l];
        if (needs & NEEDS_MIDDLE) EACH s->middle_v[i][l] = middle_velocity(s, i, l);
        EACH s->before[i][l] = s->v[i][l];
    }
    if (s->has_free_friction) add_laws(s, 1, s->bound, 2);
    run_port(s, PORT_GUIDE);
    run_port(s, PORT_STICK);
    if (s->changes & CHANGES_INERTIA) {
        if (s->smooth) kick_axes(s, half, 0, 1);
        else kick_axes(s, half, 0, 0);
    } else if (s->changes & CHANGES_BOUND) {
        if (s->smooth) kick_axes(s, half, 1, 1);
        else kick_axes(s, half, 1, 0);
    } else
        kick_free(s, 0, 2, half);
}

/* a motor follows its command where it is not released */
INLINE void turn_motor(stage *s, int i, int l, double free, double half)
{
    const int released = s->released[i - 2][l] > 0;
    const double v = pick(released, free, s->command_rate[i - 2][l]);
    s->before[i][l] = pick(released, s->v[i][l], v);
    s->v[i][l] = v;
    s->q[i][l] = drifted(s->q[i][l], v, half);
}

INLINE void kick_rotors(stage *s, double half, const int damped, const int smooth)
{
    for (int i = 2; i < 4; i++)
        EACH {
            const double damping = s->damping0[i][l] + s->rotor_damping[i - 2][l];
            const double free = damped
                ? kicked_by(s, i, l, s->mass[i][l], damping, s->bound0[i][l], smooth)
                : kicked_free(s, i, l, s->v[i][l], s->force[i][l], smooth);
            turn_motor(s, i, l, free, half);
        }
}

/* motors that are released in no lane */
INLINE void carry_motors(stage *s, double half)
{
    for (int i = 2; i < 4; i++)
        EACH {
            const double v = s->v[i][l]; /* the command's rate */
            s->before[i][l] = v;
            s->q[i][l] = drifted(s->q[i][l], v, half);
        }
}

INLINE void kick_motors(stage *s, double half)
{
    const int damped = hooked(s, PORT_MOTOR);
    if (!s->frees_motors) carry_motors(s, half);
    else if (s->smooth && damped) kick_rotors(s, half, 1, 1);
    else if (s->smooth) kick_rotors(s, half, 0, 1);
    else if (damped) kick_rotors(s, half, 1, 0);
    else kick_rotors(s, half, 0, 0);
}
