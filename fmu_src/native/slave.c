/* Variables, their checks, the start and the step of a stage behind an FMU. */
#include "slave.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fmi2_variables.h"

#define REFUSE(...) return snprintf(why, SENTENCE, __VA_ARGS__), 0

static const double LONGEST_COUNT = 1e9; /* micro-steps in one communication step */

const char *slave_interface(void) { return INTERFACE; }

int slave_parameter_count(void) { return PARAMETER_COUNT; }

static const char *parameter_name(int place) { return VARIABLES[FIRST_PARAMETER + place].name; }

/* variables */

const struct variable *slave_variable(unsigned reference, int type, char *why)
{
    static const char *const types[] = {"Real", "Integer", "Integer (an enumeration)"};
    if (reference >= VARIABLE_COUNT) {
        snprintf(why, SENTENCE, "value reference %u is unknown, expected less than %d", reference,
                 VARIABLE_COUNT);
        return 0;
    }
    const struct variable *v = &VARIABLES[reference];
    if ((v->type == REAL) != (type == REAL)) {
        snprintf(why, SENTENCE, "%s is of type %s", v->name, types[v->type]);
        return 0;
    }
    return v;
}

const struct variable *slave_known(unsigned reference) { return &VARIABLES[reference]; }

/* an enumeration's first value is 1, in the kernel 0 */
static int base(const struct variable *v) { return v->type == ENUMERATION; }

double slave_get(const slave *s, const struct variable *v)
{
    switch (v->role) {
    case TIME: return s->stage.time;
    case INPUT: return s->input[v->place];
    case OUTPUT: return s->output[v->place][0];
    case CHOICE: return s->choice[v->place] + base(v);
    default: return s->stage.parameter[v->place][0] + base(v);
    }
}

int slave_may_set(const struct variable *v, double value, char *why)
{
    const char *bracket = *v->unit ? " [" : "", *end = *v->unit ? "]" : "";
    if (v->role == TIME || v->role == OUTPUT) REFUSE("%s: may not be set, it is calculated", v->name);
    if (!isfinite(value))
        REFUSE("%s: found %g, expected a finite number%s%s%s", v->name, value, bracket, v->unit, end);
    if (value != v->neutral && !(value >= v->lower && value <= v->upper))
        REFUSE("%s: found %.9g, expected a value from %g to %g%s%s%s", v->name, value, v->lower,
               v->upper, bracket, v->unit, end);
    return 1;
}

/* a commanded angle that is set anew stands still, unless its derivative came at the same instant */
void slave_set(slave *s, const struct variable *v, double value)
{
    if (v->role == INPUT) {
        s->input[v->place] = value;
        if (v->place < VOLTAGE && !s->slope_is_new[v->place]) s->has_slope[v->place] = 0;
    } else if (v->role == CHOICE) {
        s->choice[v->place] = (int)value - base(v);
    } else {
        s->stage.parameter[v->place][0] = value - base(v);
    }
    if (s->fresh && (v->role != INPUT || v->place < VOLTAGE)) s->fresh = 0;
}

/* inputs at once, as masters set them before each step; 0 and nothing set where one needs a closer look */
int slave_set_inputs(slave *s, const unsigned reference[], size_t count, const double value[])
{
    for (size_t n = 0; n < count; n++) {
        if (reference[n] >= VARIABLE_COUNT) return 0;
        const struct variable *v = &VARIABLES[reference[n]];
        const int within = value[n] >= v->lower && value[n] <= v->upper && fabs(value[n]) <= DBL_MAX;
        if (v->role != INPUT || v->type != REAL || !within) return 0;
    }
    for (size_t n = 0; n < count; n++) slave_set(s, &VARIABLES[reference[n]], value[n]);
    return 1;
}

/* only commanded angles ramp; voltages are held */
void slave_set_slope(slave *s, const struct variable *v, double value)
{
    if (v->role != INPUT || v->place >= VOLTAGE) return;
    s->slope[v->place] = value;
    s->has_slope[v->place] = s->slope_is_new[v->place] = 1;
}

/* a kernel parameter by its place, as a machine file holds it */
int slave_load_parameter(slave *s, int place, double value, char *why)
{
    const struct variable *v = &VARIABLES[FIRST_PARAMETER + place];
    if (!slave_may_set(v, value + base(v), why)) return 0;
    s->stage.parameter[place][0] = value;
    return 1;
}

/* what must hold between parameters */

static const char *const fidelities[] = {"full", "reduced", "kinematic", "condensed",
                                         "single_axis", "two_mass", "cartesian", "h_frame"};

static int check_effects(const slave *s, char *why)
{
    static const char *const drives[] = {"stepper", "dc"};
    for (int i = 0; i < CLAIM_COUNT; i++) {
        const struct claim *c = &CLAIMS[i];
        const int drive = s->choice[CHOICE_DRIVE], fidelity = s->choice[CHOICE_FIDELITY];
        if (s->stage.parameter[c->parameter][0] == c->neutral) continue;
        if (!(c->drives & (1 << drive)))
            REFUSE("%s is set, but drive %s does not know this effect, expected %g", c->name,
                   drives[drive], c->neutral);
        if (!(c->fidelities & (1 << fidelity)))
            REFUSE("%s is set, but fidelity %s does not know this effect, expected %g", c->name,
                   fidelities[fidelity], c->neutral);
    }
    return 1;
}

static int check_free_forms(const slave *s, char *why)
{
    for (int f = 0; f < FREE_FORMS; f++) {
        const int first = FREE_FORM_OFFSET + f * FREE_FORM_SIZE;
        const lane *p = &s->stage.parameter[first];
        for (int k = LAW_KNOTS + 1; k < LAW_KNOTS + (int)p[LAW_COUNT][0]; k++)
            if (!(p[k - 1][0] < p[k][0]))
                REFUSE("%s: not above %s, expected strictly increasing knots",
                       parameter_name(first + k), parameter_name(first + k - 1));
    }
    return 1;
}

int slave_check_parameters(const slave *s, char *why)
{
    const lane *p = s->stage.parameter;
    const int fidelity = s->choice[CHOICE_FIDELITY];
    if (s->choice[CHOICE_DRIVE] == DC && (fidelity == KINEMATIC || fidelity == CONDENSED))
        REFUSE("fidelity: %s knows no dc drive, expected full or reduced", fidelities[fidelity]);
    if (s->choice[CHOICE_DRIVE] != DC && (fidelity == SINGLE_AXIS || fidelity == TWO_MASS))
        REFUSE("drive: stepper, expected dc with fidelity %s", fidelities[fidelity]);
    if (!(p[PARAMETER_CLIP_SPACING][0] < p[PARAMETER_BRIDGE_PULLEY_SPACING][0]))
        REFUSE("%s: found %g m, expected less than %s = %g m", parameter_name(PARAMETER_CLIP_SPACING),
               p[PARAMETER_CLIP_SPACING][0], parameter_name(PARAMETER_BRIDGE_PULLEY_SPACING),
               p[PARAMETER_BRIDGE_PULLEY_SPACING][0]);
    return check_effects(s, why) && check_free_forms(s, why);
}

/* outputs once for each point in time, so that reading them twice changes nothing */

int slave_outputs(slave *s, char *why)
{
    int odd = 0;
    stage_outputs(&s->stage, s->output);
    for (int i = 0; i < OUT_COUNT; i++) odd |= !(fabs(s->output[i][0]) <= DBL_MAX);
    if (odd)
        REFUSE("the state is not finite at t = %.9g s: parameters or inputs leave what the model "
               "can resolve", s->stage.time);
    s->fresh = 1;
    return 1;
}

int slave_start(slave *s, char *why)
{
    const lane angles[2] = {{s->input[ANGLE]}, {s->input[ANGLE + 1]}}, rest[6] = {{0}};
    if (!slave_check_parameters(s, why)) return 0;
    s->stage.topology = s->choice[CHOICE_FIDELITY];
    s->stage.drive = s->choice[CHOICE_DRIVE];
    stage_begin(&s->stage, s->start, angles, rest);
    s->limit = stage_step_limit(&s->stage);
    memcpy(s->reached, angles, sizeof s->reached);
    return slave_outputs(s, why);
}

/* stepping */

int slave_check_step(const slave *s, double point, double duration, char *why)
{
    const double now = s->stage.time, scale = fabs(now) > 1 ? fabs(now) : 1;
    if (!(duration > 0) || !isfinite(duration))
        REFUSE("communicationStepSize: found %g s, expected a finite number above 0", duration);
    if (!isfinite(point) || fabs(point - now) > 1e-9 * scale + 1e-6 * duration)
        REFUSE("currentCommunicationPoint: found %.12g s, expected %.12g s where the last step ended", point, now);
    if (point + duration > s->stop + 1e-9 * scale + 1e-6 * duration)
        REFUSE("communicationStepSize: found %g s from %.12g s on, expected an end at stopTime = %.12g s or before",
               duration, point, s->stop);
    if (duration / s->limit > LONGEST_COUNT || !(point + duration > point))
        REFUSE("communicationStepSize: found %g s, expected one that micro-steps of %g s can resolve",
               duration, s->limit);
    return 1;
}

/* a commanded angle inside the step: it ramps with the rate that was given, or from where the last
 * step ended to the angle that was set */
static void apply_angle(slave *s, int i, double duration)
{
    const int ramped = s->choice[CHOICE_INTERPOLATION] == RAMPED && !s->has_slope[i];
    const double rate = s->has_slope[i] ? s->slope[i] : s->input[RATE + i];
    s->stage.input[i][0] = ramped ? s->reached[i] : s->input[ANGLE + i];
    s->stage.input_rate[i][0] = ramped ? (s->input[ANGLE + i] - s->reached[i]) / duration : rate;
    s->reached[i] = ramped ? s->input[ANGLE + i] : s->input[ANGLE + i] + rate * duration;
}

/* a dc machine's rotors start where the angles point and are free */
static void apply_inputs(slave *s, double duration)
{
    for (int i = 0; i < 2; i++) {
        s->stage.voltage[i][0] = s->input[VOLTAGE + i];
        if (s->choice[CHOICE_DRIVE] == STEPPER) apply_angle(s, i, duration);
    }
    s->stage.input_time = s->stage.time;
}

static void move_inputs(slave *s)
{
    for (int i = 0; i < 2; i++) {
        s->slope_is_new[i] = 0;
        if (s->choice[CHOICE_DRIVE] == STEPPER) s->input[ANGLE + i] = s->reached[i];
    }
}

/* a checked step.  Time is the master's: it is taken anew at each step and never summed up here */
int slave_step(slave *s, double point, double duration, char *why)
{
    s->stage.time = point;
    apply_inputs(s, duration);
    stage_advance(&s->stage, duration, s->limit);
    move_inputs(s);
    return slave_outputs(s, why);
}
