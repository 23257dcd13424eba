/* One micro-step of a belt stage: leap-frog with set-valued Coulomb friction in closed form.
 *
 *   q += h/2 v;  v* = [v (1 - h d/2m) + h Q/m] / (1 + h d/2m);  v = v* - clamp(v*, -c, c);  q += h/2 v
 *
 * It sticks exactly, second order in smooth motion.  Hooks of the active effects run port by port;
 * with none active nothing of them is evaluated.  The step is compiled once for each topology, so
 * that all its loops have constant lengths. */
#include "stage.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#if LANES > 1
#define EACH _Pragma("omp simd") for (int l = 0; l < LANES; l++)
#else
#define EACH for (int l = 0; l < LANES; l++)
#endif
#define INLINE static inline __attribute__((always_inline))

#include "stage_math.h"
#include "stage_wide.h"
#include "stage_rows.h"
#include "stage_friction.h"
#include "stage_generated.h"

typedef const struct topology table;
static const double NO_STIFFNESS = 1e-300; /* [N/m] */

/* one past the last place that this topology has of a call's */
static int end_of(const stage *s, const struct call *c)
{
    switch (c->port) {
    case PORT_START_SECTION: case PORT_SHAPE: case PORT_BELT: case PORT_TENSION:
        return c->end < s->sections ? c->end : s->sections;
    case PORT_RUNOUT: return c->end < s->pulleys ? c->end : s->pulleys;
    default: return c->end;
    }
}

static void run_port(stage *s, int port)
{
    for (int n = 0; n < s->active_count[port]; n++) {
        const struct call *c = &CALLS[s->active[port][n]];
        c->law(s, c->parameter, c->memory, c->held, c->memory_step, c->place, end_of(s, c));
    }
}

/* what laws find once for steps of one length */
static void hold_parts(stage *s)
{
    for (int port = 0; port < PORT_COUNT; port++)
        for (int n = 0; n < s->active_count[port]; n++) {
            const struct call *c = &CALLS[s->active[port][n]];
            if (c->hold) c->hold(s, c->parameter, c->held);
        }
}

INLINE int hooked(const stage *s, int port) { return s->active_count[port] > 0; }

#include "stage_free_form.h"
#include "stage_belt.h"
#include "stage_kick.h"
#include "stage_sense.h"

/* what is found once for steps of length h; rows differ by rounding alone */
static void set_step(stage *s, double h)
{
    if (same_step(s, h)) return;
    s->held_step = s->step = h;
    set_kick(s, h);
    hold_parts(s);
}

static void set_command(stage *s, double time)
{
    const double since = time - s->input_time;
    for (int i = 0; i < 2; i++)
        EACH {
            s->command[i][l] = s->input[i][l] + s->input_rate[i][l] * since;
            s->command_rate[i][l] = s->input_rate[i][l];
        }
    run_port(s, PORT_COMMAND);
}

/* motors that are not released take their command */
INLINE void impose_command(stage *s)
{
    for (int i = 0; i < 2; i++)
        EACH {
            const int released = s->released[i][l] > 0;
            s->q[2 + i][l] = pick(released, s->q[2 + i][l], s->command[i][l]);
            s->v[2 + i][l] = pick(released, s->v[2 + i][l], s->command_rate[i][l]);
        }
}

static void find_motor_torque(stage *s)
{
    const lane *gain = (const lane *)&s->parameter[PARAMETER_MOTOR_TORQUE_GAIN];
    for (int i = 0; i < 2; i++)
        EACH { s->torque[i][l] = 0; s->rotor_damping[i][l] = 0; s->applied[i][l] = s->voltage[i][l]; }
    run_port(s, PORT_MOTOR);
    for (int i = 0; i < 2; i++)
        EACH {
            s->torque[i][l] += s->drive == DC ? gain[0][l] * s->applied[i][l] : 0.0;
        }
    run_port(s, PORT_TORQUE);
    for (int i = 0; i < 2; i++)
        EACH s->force[2 + i][l] += s->torque[i][l];
}

/* motors in the middle of the step, and how far their pulleys carry the belts */
INLINE void turn_pulleys(stage *s, double half)
{
    for (int i = 0; i < 2; i++)
        EACH s->q[2 + i][l] = drifted(s->q[2 + i][l], s->v[2 + i][l], half);
    impose_command(s);
    for (int i = 0; i < 2; i++)
        EACH s->travel[i][l] = s->radius[0][l] * s->q[2 + i][l];
    if (!hooked(s, PORT_TRANSMISSION)) return;
    for (int i = 0; i < 2; i++)
        EACH s->gain[i][l] = s->radius[0][l];
    run_port(s, PORT_TRANSMISSION);
}

/* what the idlers' step changes, and what it finds */
typedef struct {
    lane q[COORDINATES], v[COORDINATES], before[COORDINATES], friction[COORDINATES];
    lane force[COORDINATES], tension[SECTIONS];
} belt_state;

static void keep_belts(const stage *s, belt_state *b)
{
    memcpy(b->q, s->q, sizeof s->q);
    memcpy(b->v, s->v, sizeof s->v);
    memcpy(b->before, s->before, sizeof s->before);
    memcpy(b->friction, s->friction, sizeof s->friction);
    memcpy(b->force, s->force, sizeof s->force);
    memcpy(b->tension, s->tension, sizeof s->tension);
}

/* ``tied_only``: in tied lanes without a law on their belts */
static void put_belts(stage *s, const belt_state *b, int tied_only)
{
    for (int i = 0; i < s->coordinates; i++)
        EACH {
            const int own = tied_only && !(s->tied[0][l] > s->lawful_belts[0][l]);
            s->q[i][l] = pick(own, s->q[i][l], b->q[i][l]);
            s->v[i][l] = pick(own, s->v[i][l], b->v[i][l]);
            s->before[i][l] = pick(own, s->before[i][l], b->before[i][l]);
            s->friction[i][l] = pick(own, s->friction[i][l], b->friction[i][l]);
            s->force[i][l] = pick(own, s->force[i][l], b->force[i][l]);
        }
    for (int i = 0; i < s->sections; i++)
        EACH {
            const int own = tied_only && !(s->tied[0][l] > s->lawful_belts[0][l]);
            s->tension[i][l] = pick(own, s->tension[i][l], b->tension[i][l]);
        }
}

/* positions in the middle of the step and belt forces; the idlers' whole step */
INLINE void find_forces(stage *s, table *t)
{
    const double half = 0.5 * s->step;
    turn_pulleys(s, half);
    t->stretch(s);
    shape(s, t);
    if (hooked(s, PORT_BELT)) find_stiffness(s, t);
    if (hooked(s, PORT_CONTACT)) find_contact(s, t);
    if (s->all_tied) {
        t->pull_tied(s);
        return;
    }
    if (s->has_belt_damping || hooked(s, PORT_TENSION)) t->find_rate(s);
    belt_state before, tied;
    if (s->implicit) {
        keep_belts(s, &before);
        t->pull_tied(s);
        keep_belts(s, &tied);
        put_belts(s, &before, 0);
    }
    if (!hooked(s, PORT_TENSION) && !hooked(s, PORT_RUNOUT)) {
        t->pull_idlers(s);
    } else {
        if (s->implicit) t->tie(s);
        find_tension(s, t);
        if (s->implicit) t->kick_tied(s);
        else kick_free(s, 4, t->coordinates, half);
    }
    if (s->implicit) put_belts(s, &tied, 1);
}

/* coordinates that effects bring with them; the belts turn the bridge by their pull at its ends */
static void move_structure(stage *s)
{
    EACH s->yaw_torque[0][l] = 0;
    for (int i = 0; i < s->sections; i++)
        EACH s->yaw_torque[0][l] -= 0.5 * s->spacing[0][l] * s->yaw_arm[i] * s->tension[i][l];
    run_port(s, PORT_STRUCTURE);
}

/* a motor fixed to its axis: its torque is the axis' force, its angle the axis' position */
INLINE void pull_along(stage *s, table *t)
{
    for (int i = 0; i < 2; i++)
        if (t->direct[i])
            EACH s->force[i][l] += s->force[2 + i][l] / s->radius[0][l];
}

INLINE void turn_along(stage *s, table *t, double step)
{
    for (int i = 0; i < 2; i++)
        if (t->direct[i])
            EACH {
                const double v = s->v[i][l] / s->radius[0][l];
                s->before[2 + i][l] = step > 0 ? s->before[i][l] / s->radius[0][l] : v;
                s->v[2 + i][l] = v;
                s->q[2 + i][l] = s->q[i][l] / s->radius[0][l];
            }
}

INLINE void move(stage *s, table *t)
{
    set_command(s, s->now);
    if (s->belt_hooks) find_forces(s, t);
    else t->find_forces(s); /* the same operations in the same order, in registers */
    if (s->has_torque_hooks) find_motor_torque(s);
    if (s->has_free_form) add_laws(s, 0, s->force, FREE_FORMS);
    pull_along(s, t);
    if (s->has_guide_hooks) kick_guides(s, 0.5 * s->step);
    else kick_free(s, 0, 2, 0.5 * s->step);
    kick_motors(s, 0.5 * s->step);
    turn_along(s, t, s->step);
    if (hooked(s, PORT_STRUCTURE)) move_structure(s);
}

/* eq. (1) in place of dynamics; play follows as if the belts pulled at nothing */
static void place_kinematic(stage *s)
{
    find_travel(s, &TOPOLOGIES[KINEMATIC]);
    for (int i = 0; i < 2; i++)
        EACH { s->offset[i][l] = 0; s->pull[i][l] = 0; s->pull_stiffness[i][l] = NO_STIFFNESS; }
    run_port(s, PORT_CONTACT);
    for (int i = 0; i < 2; i++)
        EACH {
            const double sign = i ? -1.0 : 1.0;
            const double first = s->travel[0][l] + s->offset[0][l];
            s->q[i][l] = 0.5 * (first + sign * (s->travel[1][l] + s->offset[1][l]));
        }
}

static void follow(stage *s, double end)
{
    lane old[2];
    set_command(s, end);
    impose_command(s);
    memcpy(old, s->offset, sizeof old);
    place_kinematic(s);
    for (int i = 0; i < 2; i++)
        EACH {
            const double seated = (s->offset[i][l] - old[i][l]) / s->step;
            s->travel_rate[i][l] = s->gain[i][l] * s->command_rate[i][l] + seated;
        }
    for (int i = 0; i < 2; i++)
        EACH {
            const double sign = i ? -1.0 : 1.0;
            s->v[i][l] = 0.5 * (s->travel_rate[0][l] + sign * s->travel_rate[1][l]);
            s->before[i][l] = s->v[i][l];
        }
}

static void micro_step(stage *s, double end)
{
    s->now = s->topology == KINEMATIC ? end : 0.5 * (s->time + end);
    s->elapsed = s->now - s->begun;
    switch (s->topology) {
    case FULL: move(s, &TOPOLOGIES[FULL]); break;
    case REDUCED:
    case CONDENSED: move(s, &TOPOLOGIES[REDUCED]); break; /* same sections, other constants */
    case SINGLE_AXIS: move(s, &TOPOLOGIES[SINGLE_AXIS]); break;
    case TWO_MASS: move(s, &TOPOLOGIES[TWO_MASS]); break;
    case CARTESIAN: move(s, &TOPOLOGIES[CARTESIAN]); break;
    case H_FRAME: move(s, &TOPOLOGIES[H_FRAME]); break;
    default: follow(s, end);
    }
    s->time = end;
    if (hooked(s, PORT_FILTER)) {
        find_report(s);
        run_port(s, PORT_FILTER);
    }
    if (s->has_history) {
        sense(s);
        remember(s);
    }
}

/* motors that are imposed, behind the last of the steps in registers */
static void set_motors(stage *s, double half)
{
    for (int i = 0; i < 2; i++)
        EACH {
            const double v = s->command_rate[i][l];
            s->before[2 + i][l] = v;
            s->v[2 + i][l] = v;
            s->q[2 + i][l] = drifted(s->command[i][l], v, half);
        }
}

/* what volts make of torque, which no hook changes */
static void set_torque(stage *s)
{
    const lane *gain = (const lane *)&s->parameter[PARAMETER_MOTOR_TORQUE_GAIN];
    for (int i = 0; i < 2; i++)
        EACH { s->applied[i][l] = s->voltage[i][l]; s->torque[i][l] = gain[0][l] * s->voltage[i][l]; }
}

/* intervals in registers, then the motors and the clock behind the last */
static void run_rows(stage *s, sweep *w)
{
    table *t = &TOPOLOGIES[s->topology == CONDENSED ? REDUCED : s->topology];
    if (s->drive == DC) {
        set_torque(s);
        if (s->smooth) t->advance_dc_smooth(s, w);
        else t->advance_dc(s, w);
    } else if (s->smooth) t->advance_smooth(s, w);
    else t->advance(s, w);
    const interval *at = &w->part[!w->turn];
    const double half = 0.5 * at->step, end = at->start + at->duration;
    const double before = at->count > 1 ? at->start + (double)(at->count - 1) * at->step : at->start;
    s->step = at->step;
    s->input_time = at->since;
    memcpy(s->input, at->angle, sizeof s->input);
    memcpy(s->input_rate, at->rate, sizeof s->input_rate);
    s->now = 0.5 * (before + end);
    s->elapsed = s->now - s->begun;
    set_command(s, s->now);
    if (s->drive != DC) set_motors(s, half);
    s->time = end;
}

void stage_sweep(stage *s, sweep *w)
{
    find_interval(w, w->row);
    set_step(s, w->part[w->turn].step);
    run_rows(s, w);
    s->time = w->time[w->row];
}

void stage_advance(stage *s, double duration, double limit)
{
    const double start = s->time;
    const int64_t count = steps_in(duration, limit);
    s->step = duration / (double)count;
    set_step(s, s->step);
    if (s->plain) {
        sweep one; /* of one interval, nothing looked at: the rest is not read */
        interval *at = &one.part[0];
        one.turn = one.row = one.rows = one.channels = 0;
        at->start = start, at->duration = duration, at->step = s->step;
        at->since = s->input_time, at->count = count;
        memcpy(at->angle, s->input, sizeof s->input);
        memcpy(at->rate, s->input_rate, sizeof s->input_rate);
        run_rows(s, &one);
        return;
    }
    for (int64_t n = 1; n <= count; n++) {
        s->last = n == count;
        micro_step(s, n == count ? start + duration : start + (double)n * s->step);
    }
}

#include "stage_begin.h"
