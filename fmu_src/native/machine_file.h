/* The machine that travels inside the FMU: resources/machine.txt. */
#ifndef COREXY_MACHINE_FILE_H
#define COREXY_MACHINE_FILE_H

#include "slave.h"

enum { MACHINE_NAME = 128 };

/* set drive, fidelity and every parameter from the file below a resource location (a URI or a path);
 * 1, or 0 with a sentence in why[SENTENCE] */
int read_machine(const char *location, slave *s, char name[MACHINE_NAME], char *why);

#endif
