/* The stage: state, parameters and step of a Core-XY model, for LANES parameter sets in lock-step.
 *
 * Everything that changes lives in one flat struct without pointers, so that saving the state is a
 * memcpy.  The equations of topology and effects are generated (stage_generated.h).  With more than
 * one lane the struct must lie at a multiple of sizeof(lane), so that a lane is one vector. */
#ifndef COREXY_STAGE_H
#define COREXY_STAGE_H

#include "stage_sizes.h"

#ifndef LANES
#define LANES 1
#endif

enum { RING = 512, FREE_FORMS = 4, KNOTS = 24 };
enum { LAW_KIND, LAW_COUNT, LAW_VISCOUS, LAW_ONSET, LAW_KNOTS, FREE_FORM_SIZE = LAW_KNOTS + 2 * KNOTS };
enum { SEEN = 8 }; /* channels of a sweep at most */
enum { STEPPER = 0, DC = 1 };
enum { FULL = 0, REDUCED = 1, KINEMATIC = 2, CONDENSED = 3, SINGLE_AXIS = 4,
       TWO_MASS = 5, CARTESIAN = 6, H_FRAME = 7, STAGE_COUNT = 8 };
enum { OUT_X, OUT_Y, OUT_VX, OUT_VY, OUT_AX, OUT_AY, OUT_PHI1, OUT_PHI2, OUT_X_TRUE, OUT_Y_TRUE,
       OUT_OMEGA1, OUT_OMEGA2, OUT_TORQUE1, OUT_TORQUE2, OUT_V1, OUT_V2, OUT_TENSION,
       OUT_COUNT = OUT_TENSION + SECTIONS };

typedef double lane[LANES] __attribute__((aligned(8 * LANES)));

/* where the argument of a free-form law lies among its knots */
struct segment { lane from, to, first, span, value, rise; };

typedef struct {
    int topology, drive, coordinates, sections, pulleys;
    int active_count[PORT_COUNT];
    short active[PORT_COUNT][CALL_COUNT];
    int smooth; /* Coulomb friction is rounded in some lane */
    int plain; /* no hook runs in a micro-step, a lane is one register */
    int has_free_form, has_free_friction, has_viscous_law, has_belt_damping, has_history, has_torque_hooks, has_guide_hooks, belt_hooks, changes;
    int law_kind[FREE_FORMS]; /* of all lanes that have one */
    int needs; /* what laws of guides read, see stage_kick.h */
    int keeps_tensions, last; /* laws read tensions; the last micro-step before somebody looks */
    int frees_motors; /* some lane moves a rotor by its forces */
    int bent; /* sections may change their stiffness, or be damped */
    int implicit, all_tied; /* some lane is tied; all are, and no law acts on belts */
    double now, step;            /* middle of the running micro-step [s], its length [s] */
    double begun, elapsed;       /* [s] when the run began, and since then in the middle of the step */
    double time;                 /* [s] of the state below */
    double input_time;
    lane input[2], input_rate[2]; /* commanded angles, ramping from input_time */
    lane parameter[PARAMETER_COUNT];
    lane memory[MEMORY_COUNT + 1];
    struct segment segment[FREE_FORMS];
    /* constants that follow from the parameters */
    lane radius[1], damping_time[1], spacing[1], damping_gain[1], back_emf[1];
    lane mass[COORDINATES], damping0[COORDINATES], bound0[COORDINATES], released[2];
    lane smoothing[COORDINATES]; /* speed scale of Coulomb friction [m/s, rad/s] */
    lane lawful_belts[1]; /* laws of a lane act on runout (1) or on tensions (2) */
    lane tied[1]; /* belts are damped so much that idlers' rates are found with their speeds */
    lane inverse_mass[COORDINATES], half_rate[COORDINATES]; /* 1 / m and d / 2m */
    lane stiffness0[SECTIONS], length0[SECTIONS], stiffest[SECTIONS];
    double belt_sign[SECTIONS], side[SECTIONS], yaw_arm[SECTIONS];
    double held_step;            /* [s] that the next lines are for; 0: none */
    lane held[HELD_COUNT + 1];   /* what laws find once for steps of that length */
    lane keep[COORDINATES], push[COORDINATES], slip[COORDINATES];
    lane round_gain[3][COORDINATES], round_lift[2][COORDINATES]; /* of smooth Coulomb friction */
    /* state */
    lane q[COORDINATES], v[COORDINATES], before[COORDINATES]; /* before: v one micro-step ago */
    lane friction[COORDINATES], lawful[COORDINATES]; /* [N m] on idlers in the last micro-step, where tied: their friction, what laws on runout added */
    /* working variables of a micro-step */
    lane command[2], command_rate[2], voltage[2], applied[2], torque[2], rotor_damping[2];
    lane even[COORDINATES], lawless[COORDINATES]; /* idlers in the middle of the step without new laws, and their belts' torque */
    lane travel[PULLEYS], travel_rate[PULLEYS], gain[2], runout[PULLEYS], runout_slope[PULLEYS];
    lane elongation[SECTIONS], rate[SECTIONS], tension[SECTIONS];
    lane stiffness[SECTIONS], slope[SECTIONS], belt_time[SECTIONS], length[SECTIONS];
    lane offset[2], pull[2], pull_stiffness[2];
    lane force[COORDINATES], bound[2], damping[2], middle_v[COORDINATES];
    lane moving[2], across[2], yaw_torque[1];
    lane reported[2], reported_velocity[2], reported_acceleration[2], reported_torque[2];
    lane lateness[1];
    /* what the sensor saw, for samples that come late */
    int ring_head, ring_count;
    double ring_time[RING];
    lane ring[RING][4];
} stage;

/* from one row to the next: motors turn evenly */
typedef struct {
    double start, duration, step;    /* [s] */
    double since;                    /* [s], when the angles were */
    lane angle[2], rate[2];          /* [rad], [rad/s] */
    long long count;                 /* of micro-steps */
} interval;

/* rows of a recording whose motors turn evenly from each to the next */
typedef struct {
    interval part[2];                /* in turns the one that runs, and the one behind it */
    int turn;                        /* which of them is the one behind */
    int row, rows;                   /* the row that is reached, how many there are */
    const double *time, *input[2][LANES]; /* [rows] [s], motor angles [rad] */
    int apart;                       /* each lane has angles of its own */
    double limit;                    /* longest micro-step [s] */
    int channels;
    const lane *seen[SEEN];          /* what is kept of each row, [channels] */
    double *out[LANES];              /* [channels][rows] */
} sweep;

/* begin a run at rest: parameters are set, inputs hold the first angles [rad]; rest: how far x and
 * y are off [m], then, motor by motor, how much of their friction its last turn left the idlers, and
 * how far it is off its command [rad], the axes along */
void stage_begin(stage *s, double time, const lane *angles, const lane *rest);

/* from where it rests into even motion: motors at these rates [rad/s], belts neither pull nor give */
void stage_set_off(stage *s, const lane *rates);

/* off by so much, idlers along: x, y, both motors in place [m, rad], then in speed */
void stage_push(stage *s, const lane *push);

/* advance by duration [s] in micro-steps no longer than limit [s] */
void stage_advance(stage *s, double duration, double limit);

/* whether a sensor shows the carriage as it is; where a channel, OUT_X .., then lies: 0 where only a
 * report finds it, or a sweep leaves it out; whether a sweep does what stage_advance would */
int stage_shows(const stage *s);
const lane *stage_seen(const stage *s, int which);
int stage_sweeps(const stage *s);

/* advance over the rows behind the one that is reached, as far as they are equally long */
void stage_sweep(stage *s, sweep *w);

/* longest micro-step [s] that resolves the fastest pole of every lane, after stage_begin */
double stage_step_limit(const stage *s);

/* find what the sensor reports of the present state; stage_output is valid until the next step */
void stage_report(stage *s);

/* one output, OUT_X .., of the last report */
const lane *stage_output(const stage *s, int which);

/* report, and all outputs at the present state: out[OUT_COUNT] */
void stage_outputs(stage *s, lane *out);

/* the constants that follow from s->parameter, topology and drive; lists the active effects */
void stage_derive(stage *s);

#endif
