/* FMI 2.0: saved states are copies of the flat slave; a serialised one carries a head that is checked. */
#include "fmi2_instance.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEAD = 128 };
static const char BAD_STATE[] = "no state was given, expected one of fmi2GetFMUstate";

static uint64_t checksum(const void *bytes, size_t size)
{
    uint64_t sum = 14695981039346656037u;
    for (const unsigned char *c = bytes; size--; c++) sum = (sum ^ *c) * 1099511628211u;
    return sum;
}

/* what a serialised state begins with: format, size, interface, and a checksum that guards its indices */
static void write_head(char head[HEAD], const void *bytes)
{
    const uint64_t sum = checksum(bytes, sizeof(slave));
    memset(head, 0, HEAD);
    snprintf(head, HEAD, "corexy-state 1 %lu %s %08lx%08lx", (unsigned long)sizeof(slave), slave_interface(),
             (unsigned long)(sum >> 32), (unsigned long)(sum & 0xffffffffu));
}

static slave *copy_of(const void *bytes, fmi2FMUstate *state)
{
    slave *saved = *state ? *state : malloc(sizeof *saved);
    if (saved) memcpy(saved, bytes, sizeof *saved);
    return saved;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    instance *i = c;
    if (!in_phase(i, "fmi2GetFMUstate", READABLE)) return fmi2Error;
    if (!state) return refuse(i, "fmi2GetFMUstate", "a null pointer came instead of a place for the state");
    slave *saved = copy_of(&i->now, state);
    if (!saved) return refuse(i, "fmi2GetFMUstate", "no memory for a state");
    *state = saved;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    instance *i = c;
    if (!in_phase(i, "fmi2SetFMUstate", READABLE)) return fmi2Error;
    if (!state) return refuse(i, "fmi2SetFMUstate", BAD_STATE);
    memcpy(&i->now, state, sizeof i->now);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    if (!state) return fmi2OK;
    free(*state);
    *state = 0;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    instance *i = c;
    if (!in_phase(i, "fmi2SerializedFMUstateSize", READABLE)) return fmi2Error;
    if (!state || !size) return refuse(i, "fmi2SerializedFMUstateSize", BAD_STATE);
    *size = HEAD + sizeof(slave);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    instance *i = c;
    if (!in_phase(i, "fmi2SerializeFMUstate", READABLE)) return fmi2Error;
    if (!state || !bytes) return refuse(i, "fmi2SerializeFMUstate", BAD_STATE);
    if (size < HEAD + sizeof(slave)) return refuse(i, "fmi2SerializeFMUstate", "the buffer is too small for a state");
    write_head(bytes, state);
    memcpy(bytes + HEAD, state, sizeof(slave));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    instance *i = c;
    char head[HEAD];
    if (!in_phase(i, "fmi2DeSerializeFMUstate", READABLE)) return fmi2Error;
    const int sized = bytes && state && size == HEAD + sizeof(slave);
    if (sized) write_head(head, bytes + HEAD);
    if (!sized || memcmp(bytes, head, HEAD))
        return refuse(i, "fmi2DeSerializeFMUstate",
                      "these bytes are no state of this FMU, expected those of fmi2SerializeFMUstate");
    slave *saved = copy_of(bytes + HEAD, state);
    if (!saved) return refuse(i, "fmi2DeSerializeFMUstate", "no memory for a state");
    *state = saved;
    return fmi2OK;
}
