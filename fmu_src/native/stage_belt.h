/* From positions to belt tensions.  Part of stage.c. */

INLINE void find_travel(stage *s, table *t)
{
    for (int i = 0; i < t->coordinates - 2; i++)
        EACH s->travel[i][l] = s->radius[0][l] * s->q[2 + i][l];
    if (!hooked(s, PORT_TRANSMISSION)) return;
    for (int i = 0; i < 2; i++)
        EACH s->gain[i][l] = s->radius[0][l];
    run_port(s, PORT_TRANSMISSION);
}

/* what laws of shape add to elongations */
INLINE void shape(stage *s, table *t)
{
    if (hooked(s, PORT_RUNOUT)) {
        memset(s->runout, 0, sizeof s->runout);
        memset(s->runout_slope, 0, sizeof s->runout_slope);
        run_port(s, PORT_RUNOUT);
        t->add_runout(s);
    }
    if (hooked(s, PORT_SHAPE)) run_port(s, PORT_SHAPE);
}

INLINE void find_elongation(stage *s, table *t)
{
    find_travel(s, t);
    t->elongate((const lane *)s->q, (const lane *)s->travel, s->elongation);
    shape(s, t);
}

/* stiffness laws of the sections; without any: the constants */
INLINE void find_stiffness(stage *s, table *t)
{
    memcpy(s->stiffness, s->stiffness0, sizeof s->stiffness);
    memset(s->slope, 0, sizeof s->slope);
    if (s->has_belt_damping)
        for (int i = 0; i < t->sections; i++)
            EACH s->belt_time[i][l] = s->damping_time[0][l];
    t->measure(s);
    run_port(s, PORT_BELT);
}

/* play at a motor: its belt side may stand off the rotor by an offset of travel */
INLINE void find_contact(stage *s, table *t)
{
    for (int i = 0; i < 2; i++)
        EACH s->offset[i][l] = 0;
    t->find_pull(s);
    run_port(s, PORT_CONTACT);
}

/* the same tensions and forces as `pull_idlers`, where a hook stands in between */
INLINE void find_tension(stage *s, table *t)
{
    for (int i = 0; i < t->sections; i++)
        for (int m = 0; m < 2; m++) {
            const double w = t->motor_weight[i][m];
            if (w != 0)
                EACH s->elongation[i][l] += w * s->offset[m][l];
        }
    for (int i = 0; i < t->sections; i++)
        EACH s->tension[i][l] = s->stiffness[i][l] * s->elongation[i][l];
    if (s->has_belt_damping)
        for (int i = 0; i < t->sections; i++)
            EACH s->tension[i][l] += s->stiffness[i][l] * s->belt_time[i][l] * s->rate[i][l];
    run_port(s, PORT_TENSION);
    t->collect(s);
    if (hooked(s, PORT_RUNOUT)) t->collect_runout(s);
}
