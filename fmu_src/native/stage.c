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
INLINE double drifted(double q, double v, double half) { return q + half * v; }

/* velocity in the middle of the coming step; exactly 0 while it sticks */
INLINE double middle_velocity(const stage *s, int i, int l)
{
    return pick(s->v[i][l] != 0, 1.5 * s->v[i][l] - 0.5 * s->before[i][l], 0.0);
}

#include "stage_rows.h"
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
        c->law(s, c->parameter, c->memory, c->memory_step, c->place, end_of(s, c));
    }
}

INLINE int hooked(const stage *s, int port) { return s->active_count[port] > 0; }

#include "stage_free_form.h"
#include "stage_belt.h"
#include "stage_sense.h"

/* a step of length h: what stays of a speed, what a force adds, what friction takes away at most */
typedef struct { double keep, push, slip; } kick;
INLINE kick kick_of(double h, double mass, double damping, double bound)
{
    const double lag = 0.5 * h * damping, share = 1.0 / (mass + lag), push = h * share;
    const kick k = {(mass - lag) * share, push, push * bound};
    return k;
}

/* the kicks of constant damping and mass, for steps of length h; rows differ by rounding alone */
static void set_kick(stage *s, double h)
{
    if (same_kick(s, h)) return;
    s->kick_step = h;
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

static void set_command(stage *s, double time)
{
    for (int i = 0; i < 2; i++) {
        const double angle = s->input[i] + s->input_rate[i] * (time - s->input_time);
        EACH {
            s->command[i][l] = angle;
            s->command_rate[i][l] = s->input_rate[i];
        }
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

/* the kick of a coordinate whose mass, damping or bound are not the constants of set_kick */
INLINE double kicked_by(const stage *s, int i, int l, double mass, double damping, double bound,
                        const int smooth)
{
    const kick k = kick_of(s->kick_step, mass, damping, larger(bound, 0.0));
    const double fast = k.keep * s->v[i][l] + k.push * s->force[i][l];
    return smooth ? slide(fast, k.slip, rounded(k.slip, s->smoothing[i][l])) : stop(fast, k.slip);
}

INLINE void kick_axes(stage *s, double half, const int smooth)
{
    for (int i = 0; i < 2; i++)
        EACH {
            const double v = kicked_by(s, i, l, s->moving[i][l], s->damping[i][l], s->bound[i][l], smooth);
            s->v[i][l] = v;
            s->q[i][l] = drifted(s->q[i][l], v, half);
        }
}

/* an axis whose friction or force a law changes */
static void kick_guides(stage *s, double half)
{
    for (int i = 0; i < 2; i++)
        EACH {
            s->bound[i][l] = s->bound0[i][l];
            s->damping[i][l] = s->damping0[i][l];
            s->moving[i][l] = s->mass[i][l];
            s->across[i][l] = s->force[1 - i][l];
            s->middle_v[i][l] = middle_velocity(s, i, l);
            s->before[i][l] = s->v[i][l];
        }
    run_port(s, PORT_GUIDE);
    run_port(s, PORT_STICK);
    if (s->smooth) kick_axes(s, half, 1);
    else kick_axes(s, half, 0);
}

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
            const double v = s->command_rate[i - 2][l];
            s->before[i][l] = v;
            s->v[i][l] = v;
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

/* positions in the middle of the step and belt forces; the idlers' whole step */
INLINE void find_forces(stage *s, table *t)
{
    const double half = 0.5 * s->step;
    turn_pulleys(s, half);
    t->stretch(s);
    shape(s, t);
    if (hooked(s, PORT_BELT)) find_stiffness(s, t);
    if (hooked(s, PORT_CONTACT)) find_contact(s, t);
    if (s->has_belt_damping || hooked(s, PORT_TENSION)) t->find_rate(s);
    if (!hooked(s, PORT_TENSION) && !hooked(s, PORT_RUNOUT)) {
        t->pull_idlers(s);
        return;
    }
    find_tension(s, t);
    kick_free(s, 4, t->coordinates, half);
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
    if (s->has_free_form) add_free_forms(s);
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

/* intervals in registers, then the motors and the clock behind the last */
static void run_rows(stage *s, sweep *w)
{
    TOPOLOGIES[s->topology == CONDENSED ? REDUCED : s->topology].advance(s, w);
    const interval *at = &w->part[!w->turn];
    const double half = 0.5 * at->step, end = at->start + at->duration;
    const double before = at->count > 1 ? at->start + (double)(at->count - 1) * at->step : at->start;
    s->step = at->step;
    s->input_time = at->since;
    for (int i = 0; i < 2; i++) { s->input[i] = at->angle[i]; s->input_rate[i] = at->rate[i]; }
    s->now = 0.5 * (before + end);
    s->elapsed = s->now - s->begun;
    set_command(s, s->now);
    for (int i = 0; i < 2; i++)
        EACH {
            const double v = s->command_rate[i][l];
            s->before[2 + i][l] = v;
            s->v[2 + i][l] = v;
            s->q[2 + i][l] = drifted(s->command[i][l], v, half);
        }
    s->time = end;
}

void stage_sweep(stage *s, sweep *w)
{
    w->part[w->turn] = interval_of(w, w->row);
    set_kick(s, w->part[w->turn].step);
    run_rows(s, w);
    s->time = w->time[w->row];
}

void stage_advance(stage *s, double duration, double limit)
{
    const double start = s->time;
    const int64_t count = steps_in(duration, limit);
    s->step = duration / (double)count;
    set_kick(s, s->step);
    if (s->plain) {
        sweep one = {.part = {{start, duration, s->step, {s->input[0], s->input[1]},
                               {s->input_rate[0], s->input_rate[1]}, s->input_time, count}}};
        run_rows(s, &one);
        return;
    }
    for (int64_t n = 1; n <= count; n++)
        micro_step(s, n == count ? start + duration : start + (double)n * s->step);
}

#include "stage_begin.h"
