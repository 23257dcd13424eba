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

INLINE void find_elongation(stage *s, table *t)
{
    find_travel(s, t);
    t->elongate((const lane *)s->q, (const lane *)s->travel, s->elongation);
    if (hooked(s, PORT_RUNOUT)) {
        memset(s->runout, 0, sizeof s->runout);
        memset(s->runout_slope, 0, sizeof s->runout_slope);
        run_port(s, PORT_RUNOUT);
        t->add_runout(s);
    }
    if (hooked(s, PORT_SHAPE)) run_port(s, PORT_SHAPE);
}

INLINE void find_rate(stage *s, table *t)
{
    for (int i = 0; i < t->coordinates; i++)
        EACH s->middle_v[i][l] = middle_velocity(s, i, l);
    for (int i = 0; i < 2; i++) /* imposed rates are those of the middle */
        EACH s->middle_v[2 + i][l] = s->released[i][l] > 0 ? s->middle_v[2 + i][l] : s->v[2 + i][l];
    for (int i = 0; i < t->coordinates - 2; i++)
        EACH s->travel_rate[i][l] = (i < 2 ? s->gain[i][l] : s->radius[0][l]) * s->middle_v[2 + i][l];
    t->elongate((const lane *)s->middle_v, (const lane *)s->travel_rate, s->rate);
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
        EACH { s->offset[i][l] = 0; s->pull[i][l] = 0; s->pull_stiffness[i][l] = 0; }
    for (int i = 0; i < t->sections; i++)
        for (int m = 0; m < 2; m++) {
            const double w = t->motor_weight[i][m];
            if (w != 0)
                EACH {
                    s->pull[m][l] -= w * s->stiffness[i][l] * s->elongation[i][l];
                    s->pull_stiffness[m][l] += w * w * s->stiffness[i][l];
                }
        }
    run_port(s, PORT_CONTACT);
    for (int i = 0; i < t->sections; i++)
        for (int m = 0; m < 2; m++) {
            const double w = t->motor_weight[i][m];
            if (w != 0)
                EACH s->elongation[i][l] += w * s->offset[m][l];
        }
}

/* stiffness holds stiffness0 unless a belt law is active */
INLINE void find_tension(stage *s, table *t)
{
    if (hooked(s, PORT_BELT)) find_stiffness(s, t);
    if (hooked(s, PORT_CONTACT)) find_contact(s, t);
    if (s->has_belt_damping || hooked(s, PORT_TENSION)) find_rate(s, t);
    for (int i = 0; i < t->sections; i++)
        EACH s->tension[i][l] = s->stiffness[i][l] * s->elongation[i][l];
    if (s->has_belt_damping)
        for (int i = 0; i < t->sections; i++)
            EACH s->tension[i][l] += s->stiffness[i][l] * s->belt_time[i][l] * s->rate[i][l];
    if (hooked(s, PORT_TENSION)) run_port(s, PORT_TENSION);
}
