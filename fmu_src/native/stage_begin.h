/* The begin of a run: constants, active effects, the idlers' rest, the step.  Part of stage.c. */

static int differs(const stage *s, const struct instance *e)
{
    int on = 0;
    for (int l = 0; l < LANES; l++) on |= e->on(s, e->parameter, l);
    return on;
}

static void list_active(stage *s)
{
    memset(s->active_count, 0, sizeof s->active_count);
    memset(s->lawful_belts, 0, sizeof s->lawful_belts);
    s->has_history = s->changes = s->needs = 0;
    int last = -1, on = 0; /* the calls of an instance stand together */
    for (int n = 0; n < CALL_COUNT; n++) {
        const struct call *c = &CALLS[n];
        const struct instance *e = &INSTANCES[c->instance];
        if (c->instance != last) { last = c->instance; on = differs(s, e); }
        if (!on || c->place >= end_of(s, c)) continue;
        if (!(e->drives & c->drives & (1 << s->drive)) || !(e->fidelities & (1 << s->topology))) continue;
        s->active[c->port][s->active_count[c->port]++] = (short)n;
        s->has_history |= e->history;
        s->changes |= c->changes;
        s->needs |= c->needs;
        for (int l = 0; l < LANES && (c->port == PORT_TENSION || c->port == PORT_RUNOUT); l++)
            if (e->on(s, e->parameter, l))
                s->lawful_belts[0][l] = larger(s->lawful_belts[0][l], c->port == PORT_TENSION ? 2 : 1);
        for (int i = c->place; e->frees_rotor && i < c->end; i++)
            for (int l = 0; l < LANES; l++)
                if (e->on(s, e->parameter, l)) s->released[i][l] = 1;
    }
}

/* what is read off at a row alone runs in no micro-step */
static int no_hook(const stage *s)
{
    for (int port = 0; port < PORT_COUNT; port++)
        switch (port) {
        case PORT_ROTOR: case PORT_START: case PORT_START_AXIS: case PORT_START_SECTION: case PORT_START_SENSOR:
        case PORT_OUTPUT: case PORT_SENSOR: break;
        default: if (hooked(s, port)) return 0;
        }
    return !s->has_history && !s->has_free_form && !s->has_belt_damping;
}

static void derive_constants(stage *s, table *t)
{
    t->derive(s);
    s->smooth = 0;
    for (int i = 0; i < t->coordinates; i++)
        EACH {
            s->smooth |= s->smoothing[i][l] > 0;
            s->inverse_mass[i][l] = 1.0 / s->mass[i][l];
            s->half_rate[i][l] = 0.5 * s->damping0[i][l] * s->inverse_mass[i][l];
        }
    for (int i = 0; i < t->sections; i++) {
        s->belt_sign[i] = t->belt_sign[i];
        s->side[i] = t->side[i];
        s->yaw_arm[i] = t->yaw_arm[i];
        EACH s->belt_time[i][l] = s->damping_time[0][l];
    }
    memcpy(s->stiffness, s->stiffness0, sizeof s->stiffness);
    for (int i = 0; i < 2; i++)
        EACH { s->gain[i][l] = s->radius[0][l]; s->released[i][l] = s->drive == DC; }
}

void stage_derive(stage *s)
{
    table *t = &TOPOLOGIES[s->topology];
    s->coordinates = t->coordinates;
    s->sections = t->sections;
    s->pulleys = t->coordinates - 2;
    s->held_step = 0;
    s->has_belt_damping = 0;
    derive_constants(s, t);
    EACH s->has_belt_damping |= s->damping_time[0][l] > 0;
    list_laws(s);
    list_active(s);
    s->has_belt_damping |= !!(s->changes & CHANGES_BELT_RATES);
    if (s->has_free_friction) s->changes |= CHANGES_BOUND;
    if (s->has_viscous_law) s->changes |= CHANGES_INERTIA;
    s->needs |= s->changes;
    s->keeps_tensions = hooked(s, PORT_STRUCTURE);
    s->has_torque_hooks = s->drive == DC || hooked(s, PORT_MOTOR) || hooked(s, PORT_TORQUE);
    s->has_guide_hooks = hooked(s, PORT_GUIDE) || hooked(s, PORT_STICK) || s->has_free_friction;
    s->plain = WIDE_STEPS && no_hook(s) && s->topology != KINEMATIC
        && (s->drive == STEPPER || (s->sections && !t->direct[0] && !t->direct[1]));
    s->frees_motors = 0;
    for (int i = 0; i < 2; i++)
        EACH s->frees_motors |= s->released[i][l] > 0;
    s->bent = s->has_belt_damping || hooked(s, PORT_BELT);
    s->implicit = s->all_tied = 0;
    memset(s->tied, 0, sizeof s->tied);
    if (!hooked(s, PORT_CONTACT)) memset(s->offset, 0, sizeof s->offset);
    memset(s->slope, 0, sizeof s->slope);
    s->belt_hooks = s->has_belt_damping;
    for (int port = PORT_TRANSMISSION; port <= PORT_TENSION; port++) s->belt_hooks |= hooked(s, port);
}

/* dense Gauss elimination of n unknowns; a is n by n + 1, destroyed */
static void solve(int n, double a[COORDINATES][COORDINATES + 1])
{
    for (int i = 0; i < n; i++)
        for (int r = 0; r < n; r++) {
            if (r == i || a[r][i] == 0) continue;
            const double f = a[r][i] / a[i][i];
            for (int c = i; c <= n; c++) a[r][c] -= f * a[i][c];
        }
}

static void section_row(const stage *s, int section, int l, double *row)
{
    for (int i = 0; i < s->coordinates; i++)
        row[i] = TOPOLOGIES[s->topology].weight[section][i] * (i < 2 ? 1.0 : s->radius[0][l]);
}

/* static equilibrium between the motors under a torque on each idler: of the idlers alone, or with
 * the axes behind them */
static void settle(stage *s, const lane *torque, int axes)
{
    const int idlers = s->coordinates - 4, count = idlers + axes;
    if (idlers < 1) return;
    EACH {
        double a[COORDINATES][COORDINATES + 1] = {{0}}, row[COORDINATES + 2];
        for (int n = 0; n < s->sections; n++) {
            double fixed = 0;
            section_row(s, n, l, row);
            for (int i = axes; i < 4; i++) fixed += row[i] * s->q[i][l];
            memcpy(row + s->coordinates, row, axes * sizeof *row);
            for (int i = 0; i < count; i++) {
                if (row[4 + i] == 0) continue;
                for (int j = 0; j < count; j++) a[i][j] += s->stiffness0[n][l] * row[4 + i] * row[4 + j];
                a[i][count] -= s->stiffness0[n][l] * row[4 + i] * fixed;
            }
        }
        for (int i = 0; i < idlers; i++) a[i][count] += torque[i][l];
        solve(count, a);
        for (int i = 0; i < count; i++)
            s->q[i < idlers ? 4 + i : i - idlers][l] = a[i][count] / a[i][i];
    }
}

/* what dry friction keeps of each idler's torque since the motors last turned (1, -1: all it can),
 * and where the axes balance it */
static void hold_idlers(stage *s, const table *t, const lane *held, lane *torque, lane *balance)
{
    int any = 0;
    memset(torque, 0, COORDINATES * sizeof *torque);
    memset(balance, 0, 2 * sizeof *balance);
    for (int i = 0; i < 2; i++) EACH any |= held[i][l] != 0;
    if (!any) return;
    for (int i = 0; i < 2; i++)
        EACH {
            s->q[2 + i][l] = held[i][l];
            s->q[i][l] = s->radius[0][l] * (t->rest[i][0] * held[0][l] + t->rest[i][1] * held[1][l]);
        }
    settle(s, (const lane *)torque, 0);
    for (int i = 4; i < s->coordinates; i++)
        EACH torque[i - 4][l] = -s->bound0[i][l] * larger(-1.0, smaller(s->q[i][l], 1.0));
    memset(s->q, 0, sizeof s->q);
    settle(s, (const lane *)torque, 2);
    memcpy(balance, s->q, 2 * sizeof *balance);
}

/* positions at rest: the motors' angles, the axes displaced from them, idlers held by friction */
static void place_at(stage *s, double time, const lane *angles, const lane *rest)
{
    table *t = &TOPOLOGIES[s->topology];
    lane torque[COORDINATES], balance[2];
    hold_idlers(s, t, rest + 2, torque, balance);
    s->time = s->now = s->input_time = s->begun = time;
    s->elapsed = 0;
    memcpy(s->input, angles, sizeof s->input);
    memset(s->input_rate, 0, sizeof s->input_rate);
    set_command(s, time);
    for (int i = 0; i < 2; i++) EACH s->q[2 + i][l] = s->command[i][l];
    run_port(s, PORT_ROTOR);
    for (int i = 0; i < 2; i++) EACH s->q[2 + i][l] += rest[4 + i][l];
    for (int i = 0; i < 2; i++)
        EACH {
            double angle = 0;
            for (int j = 0; j < 2; j++)
                angle += t->rest[i][j] * (angles[j][l] + (s->q[2 + j][l] - s->command[j][l]));
            s->q[i][l] = s->radius[0][l] * angle + balance[i][l] + rest[i][l];
        }
    turn_along(s, t, 0.0);
    settle(s, (const lane *)torque, 0);
}

/* belt laws where sections that change are a quarter of their length: what the step must bear */
static void find_stiffest(stage *s, table *t)
{
    if (hooked(s, PORT_BELT)) {
        find_stiffness(s, t);
        for (int i = 0; i < t->sections; i++)
            EACH s->length[i][l] = 0.25 * s->length0[i][l];
        memcpy(s->stiffness, s->stiffness0, sizeof s->stiffness);
        run_port(s, PORT_BELT);
    }
    memcpy(s->stiffest, s->stiffness, sizeof s->stiffest);
}

static void tie_idlers(stage *s);

void stage_begin(stage *s, double time, const lane *angles, const lane *rest)
{
    table *t = &TOPOLOGIES[s->topology];
    stage_derive(s);
    memset(s->q, 0, sizeof s->q);
    memset(s->v, 0, sizeof s->v);
    memset(s->before, 0, sizeof s->before);
    memset(s->friction, 0, sizeof s->friction);
    memset(s->lawful, 0, sizeof s->lawful);
    memset(s->memory, 0, sizeof s->memory);
    memset(s->offset, 0, sizeof s->offset);
    memset(s->voltage, 0, sizeof s->voltage);
    memset(s->torque, 0, sizeof s->torque);
    memset(s->rotor_damping, 0, sizeof s->rotor_damping);
    memset(s->force, 0, sizeof s->force);
    memset(s->tension, 0, sizeof s->tension);
    s->ring_head = s->ring_count = 0;
    s->step = 1;
    hold_parts(s);
    place_at(s, time, angles, rest);
    find_travel(s, t);
    run_port(s, PORT_START);
    run_port(s, PORT_START_AXIS);
    if (s->topology == KINEMATIC) place_kinematic(s);
    else {
        find_elongation(s, t);
        run_port(s, PORT_START_SECTION);
        find_stiffest(s, t);
        tie_idlers(s);
    }
    find_report(s);
    run_port(s, PORT_START_SENSOR);
    if (s->has_history) { sense(s); remember(s); }
}

/* all coordinates as idlers follow the ends (x, y, motors) without pull */
static void go_along(stage *s, const lane *ends, lane *all)
{
    static const lane none[COORDINATES];
    lane kept[COORDINATES];
    memcpy(kept, s->q, sizeof kept);
    memset(s->q, 0, sizeof s->q);
    memcpy(s->q, ends, 4 * sizeof *ends);
    settle(s, none, 0);
    memcpy(all, s->q, sizeof kept);
    memcpy(s->q, kept, sizeof kept);
}

void stage_set_off(stage *s, const lane *rates)
{
    table *t = &TOPOLOGIES[s->topology];
    lane ends[4];
    for (int i = 0; i < 2; i++)
        EACH {
            ends[2 + i][l] = rates[i][l];
            ends[i][l] = s->radius[0][l] * (t->rest[i][0] * rates[0][l] + t->rest[i][1] * rates[1][l]);
        }
    go_along(s, (const lane *)ends, s->v);
    memcpy(s->before, s->v, sizeof s->before);
    turn_along(s, t, 0.0);
}

void stage_push(stage *s, const lane *push)
{
    lane along[2][COORDINATES];
    for (int k = 0; k < 2; k++) go_along(s, push + 4 * k, along[k]);
    for (int i = 0; i < s->coordinates; i++)
        EACH {
            s->q[i][l] += along[0][i][l];
            s->v[i][l] += along[1][i][l];
            s->before[i][l] += along[1][i][l];
        }
    turn_along(s, &TOPOLOGIES[s->topology], 0.0);
}

/* the longest step */

static int imposed(const stage *s, int i, int l)
{
    return (i == 2 || i == 3) && !(s->released[i - 2][l] > 0);
}

/* Gershgorin's bound of the fastest natural frequency of the first coordinates, squared */
static double fastest_square(const stage *s, int l, int count)
{
    double k[COORDINATES][COORDINATES] = {{0}}, row[COORDINATES], worst = 1.0;
    for (int n = 0; n < s->sections; n++) {
        section_row(s, n, l, row);
        for (int i = 0; i < count; i++)
            for (int j = 0; row[i] != 0 && j < count; j++)
                k[i][j] += s->stiffest[n][l] * fabs(row[i] * row[j]);
    }
    for (int i = 0; i < count; i++) {
        double sum = 0;
        if (imposed(s, i, l)) continue;
        for (int j = 0; j < count; j++)
            if (k[i][j] != 0 && !imposed(s, j, l)) sum += k[i][j] / sqrt(s->mass[i][l] * s->mass[j][l]);
        worst = larger(worst, sum);
    }
    return worst;
}

/* viscous friction is stepped implicitly and may be three times faster than the step resolves */
static double viscous_pole(const stage *s, int l)
{
    double pole = 0.0;
    for (int i = 0; i < s->coordinates; i++)
        if (!imposed(s, i, l)) pole = larger(pole, 2.0 * s->half_rate[i][l] * STEP_RESOLUTION / 3.0);
    return pole;
}

/* a belt damped by t seconds turns a frequency w into a pole of t w^2, of the first coordinates */
static double damped_pole(const stage *s, int l, int count)
{
    double time = 0.0;
    for (int i = 0; i < s->sections; i++) time = larger(time, s->belt_time[i][l]);
    return time * fastest_square(s, l, count);
}

/* of axes and rotors alone where idlers are tied */
static double fastest_pole(const stage *s, int l)
{
    const double square = fastest_square(s, l, s->coordinates);
    const double damped = damped_pole(s, l, s->tied[0][l] > 0 ? 4 : s->coordinates);
    const double pole = larger(viscous_pole(s, l), damped);
    return larger(square, pole * pole);
}

/* sticking and slipping is first order: lightly damped idlers do it often and take the short step */
static double longest(const stage *s, int l)
{
    double rate = s->coordinates > 4 ? STEP_CALM : 0.0;
    for (int i = 4; i < s->coordinates; i++) rate = smaller(rate, 2.0 * s->half_rate[i][l]);
    return STEP_LONGEST * (1.0 + 2.0 * rate / STEP_CALM);
}

/* extrapolated rates of the idlers would ask for a step much shorter than the machine's own */
static void tie_idlers(stage *s)
{
    if (!s->has_belt_damping || s->coordinates < 5) return;
    s->all_tied = 1;
    for (int l = 0; l < LANES; l++) {
        const double square = fastest_square(s, l, s->coordinates), viscous = viscous_pole(s, l);
        const double own = STEP_RESOLUTION / sqrt(larger(square, viscous * viscous));
        const double rated = STEP_RESOLUTION / larger(damped_pole(s, l, s->coordinates), 1e-9);
        int more = 0; /* than the machine's own damping: what a law adds */
        for (int i = 0; i < s->sections; i++) more |= s->belt_time[i][l] > s->damping_time[0][l];
        s->tied[0][l] = more && s->lawful_belts[0][l] < 2 && rated * TIED < smaller(own, longest(s, l));
        s->implicit |= s->tied[0][l] > 0;
        s->all_tied &= s->tied[0][l] > 0 && !(s->lawful_belts[0][l] > 0);
    }
}

double stage_step_limit(const stage *s)
{
    double limit = 1.0;
    if (s->topology == KINEMATIC) return limit;
    EACH {
        const double square = larger(fastest_pole(s, l), fastest_effect(s, l));
        limit = smaller(limit, smaller(STEP_RESOLUTION / sqrt(square), longest(s, l)));
    }
    return limit;
}
