/* What the sensor makes of the present state, and its memory of it.  Part of stage.c. */

/* the carriage, or what an effect reports in its place */
static void find_report(stage *s)
{
    for (int i = 0; i < 2; i++)
        EACH {
            s->reported[i][l] = s->q[i][l];
            s->reported_velocity[i][l] = s->v[i][l];
            s->reported_acceleration[i][l] = (s->v[i][l] - s->before[i][l]) / s->step;
        }
    run_port(s, PORT_OUTPUT);
}

/* imposed motors: what they must give, their rotor's inertia apart */
static void find_torque(stage *s)
{
    const lane *back_emf = (const lane *)&s->parameter[PARAMETER_MOTOR_DAMPING_GAIN];
    for (int i = 0; i < 2; i++)
        EACH {
            const double v = s->v[2 + i][l], sign = v > 0 ? 1.0 : (v < 0 ? -1.0 : 0.0);
            const double lost = s->rotor_damping[i][l] + (s->drive == DC ? back_emf[0][l] : 0.0);
            const double needed = s->damping0[2 + i][l] * v + sign * s->bound0[2 + i][l] - s->force[2 + i][l];
            s->reported_torque[i][l] = s->released[i][l] > 0 ? s->torque[i][l] - lost * v : needed;
        }
}

static void sense(stage *s)
{
    find_report(s);
    run_port(s, PORT_SENSOR);
}

static void remember(stage *s)
{
    const double spacing = HISTORY / (RING - 8);
    const int last = (s->ring_head + RING - 1) % RING;
    if (s->ring_count && s->time < s->ring_time[last] + spacing) return;
    s->ring_time[s->ring_head] = s->time;
    for (int i = 0; i < 2; i++)
        EACH {
            s->ring[s->ring_head][i][l] = s->reported[i][l];
            s->ring[s->ring_head][2 + i][l] = s->reported_acceleration[i][l];
        }
    s->ring_head = (s->ring_head + 1) % RING;
    if (s->ring_count < RING) s->ring_count++;
}

/* linear between remembered samples, the present one closing the row; before the first: the first */
static void recall(stage *s, int l, double past)
{
    double later = s->time, *now[4];
    for (int i = 0; i < 2; i++) {
        now[i] = &s->reported[i][l];
        now[2 + i] = &s->reported_acceleration[i][l];
    }
    double value[4] = {*now[0], *now[1], *now[2], *now[3]};
    for (int n = 1; n <= s->ring_count; n++) {
        const int at = (s->ring_head + RING - n) % RING;
        const double earlier = s->ring_time[at];
        const int found = earlier <= past, oldest = n == s->ring_count;
        const double part = later > earlier ? larger((past - earlier) / (later - earlier), 0.0) : 0.0;
        if (found || oldest) {
            for (int i = 0; i < 4; i++)
                *now[i] = s->ring[at][i][l] + part * (value[i] - s->ring[at][i][l]);
            return;
        }
        later = earlier;
        for (int i = 0; i < 4; i++) value[i] = s->ring[at][i][l];
    }
}

static void delay_samples(stage *s)
{
    EACH s->lateness[0][l] = 0;
    run_port(s, PORT_SAMPLING);
    for (int l = 0; l < LANES; l++)
        if (s->lateness[0][l] > 0) recall(s, l, s->time - s->lateness[0][l]);
}

void stage_report(stage *s)
{
    sense(s);
    find_torque(s);
    if (s->has_history) delay_samples(s);
}

const lane *stage_output(const stage *s, int which)
{
    switch (which) {
    case OUT_X: case OUT_Y: return &s->reported[which - OUT_X];
    case OUT_VX: case OUT_VY: return &s->reported_velocity[which - OUT_VX];
    case OUT_AX: case OUT_AY: return &s->reported_acceleration[which - OUT_AX];
    case OUT_PHI1: case OUT_PHI2: return &s->q[2 + which - OUT_PHI1];
    case OUT_X_TRUE: case OUT_Y_TRUE: return &s->q[which - OUT_X_TRUE];
    case OUT_OMEGA1: case OUT_OMEGA2: return &s->v[2 + which - OUT_OMEGA1];
    case OUT_TORQUE1: case OUT_TORQUE2: return &s->reported_torque[which - OUT_TORQUE1];
    case OUT_V1: case OUT_V2: return &s->voltage[which - OUT_V1];
    default: return &s->tension[which - OUT_TENSION]; /* zero beyond the topology's sections */
    }
}

void stage_outputs(stage *s, lane *out)
{
    stage_report(s);
    for (int i = 0; i < OUT_TENSION; i += 2) /* outputs stand in pairs */
        memcpy(out[i], *stage_output(s, i), 2 * sizeof(lane));
    memcpy(out[OUT_TENSION], s->tension, sizeof s->tension);
}

/* laws that report another carriage than the true one, or nothing in registers: a row at a time */
int stage_sweeps(const stage *s)
{
    return s->plain && s->drive == STEPPER && s->sections && stage_shows(s);
}

int stage_shows(const stage *s)
{
    return !hooked(s, PORT_OUTPUT) && !hooked(s, PORT_SENSOR) && !s->has_history;
}

const lane *stage_seen(const stage *s, int which)
{
    switch (which) {
    case OUT_X: case OUT_Y: return &s->q[which - OUT_X];
    case OUT_VX: case OUT_VY: return &s->v[which - OUT_VX];
    case OUT_PHI1: case OUT_PHI2: return s->plain && s->drive != DC ? 0 : &s->q[2 + which - OUT_PHI1];
    case OUT_X_TRUE: case OUT_Y_TRUE: return &s->q[which - OUT_X_TRUE];
    default: return 0;
    }
}
