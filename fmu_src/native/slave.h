/* The stage as its FMU shows it: variables by number, each checked when it is set, and steps.
 *
 * Everything lives in one flat struct without pointers: a saved state is a copy of it. */
#ifndef COREXY_SLAVE_H
#define COREXY_SLAVE_H

#include "stage.h"

#include <stddef.h>

enum { SENTENCE = 512 };
enum { REAL, INTEGER, ENUMERATION };
enum { TIME, INPUT, OUTPUT, CHOICE, PARAMETER };
enum { ANGLE, VOLTAGE = 2, RATE = 4, INPUTS = 6 };
enum { CHOICE_DRIVE, CHOICE_FIDELITY, CHOICE_INTERPOLATION, CHOICES };
enum { HELD, RAMPED };                       /* commanded angles that come without a rate */

/* a variable: its place in the array of its role, the range that it may be set to, neutral too */
struct variable {
    const char *name, *unit;
    int type, role, place;
    double lower, upper, neutral;
};

typedef struct {
    stage stage;
    unsigned phase;                          /* of the order of calls */
    int fresh;                               /* outputs follow from parameters and inputs */
    int choice[CHOICES];                     /* drive, fidelity, input interpolation */
    double start, stop, limit;               /* first and last time, longest micro-step [s] */
    double input[INPUTS];                    /* angles [rad], voltages [V], rates [rad/s] */
    double slope[2];                         /* rates that came as input derivatives [rad/s] */
    double reached[2];                       /* angles where the last step ended [rad] */
    int has_slope[2], slope_is_new[2];
    lane output[OUT_COUNT];
} slave;

/* hash of the variable table: the GUID */
const char *slave_interface(void);

/* number of the parameters that a machine file holds */
int slave_parameter_count(void);

/* a variable that slave_variable has found before */
const struct variable *slave_known(unsigned reference);

/* all of these give 1, or 0 with a sentence in why[SENTENCE] */
const struct variable *slave_variable(unsigned reference, int type, char *why);
int slave_may_set(const struct variable *v, double value, char *why);
int slave_load_parameter(slave *s, int place, double value, char *why);
int slave_check_parameters(const slave *s, char *why);
int slave_start(slave *s, char *why);
int slave_check_step(const slave *s, double point, double duration, char *why);
int slave_step(slave *s, double point, double duration, char *why);
int slave_outputs(slave *s, char *why);
int slave_foresee(const slave *s, slave *trial, double *ahead, char *why);

double slave_get(const slave *s, const struct variable *v);
void slave_set(slave *s, const struct variable *v, double value);
int slave_set_inputs(slave *s, const unsigned reference[], size_t count, const double value[]);
void slave_set_slope(slave *s, const struct variable *v, double value);

/* a direction in the space of what may be set before a run starts */
struct direction {
    const unsigned *known;
    const double *seed;
    size_t count;
};
int slave_shift(const slave *s, slave *trial, const struct direction *d, double part, char *why);
double slave_part(const slave *s, const struct direction *d);

#endif
