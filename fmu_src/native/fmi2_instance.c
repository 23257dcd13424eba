/* Log messages and the order of calls. */
#include "fmi2_instance.h"

#include <stdio.h>
#include <string.h>

/* the logger reads its message like printf: percent signs, and FMI's #, are doubled */
static void escape(const char *from, char *to, size_t size)
{
    size_t n = 0;
    for (; *from && n + 3 < size; from++) {
        if (*from == '%' || *from == '#') to[n++] = *from;
        to[n++] = *from;
    }
    to[n] = 0;
}

static void send(instance *i, fmi2Status status, const char *category, const char *sentence)
{
    if (!i->logger) return;
    escape(sentence, i->text, sizeof i->text);
    i->logger(i->environment, i->name, status, category, i->text);
}

fmi2Status refuse_as(instance *i, fmi2Status status, const char *function, const char *why)
{
    char sentence[SENTENCE + 64];
    snprintf(sentence, sizeof sentence, "%s: %s", function, why);
    send(i, status, status == fmi2Discard ? "logStatusDiscard" : "logStatusError", sentence);
    return status;
}

fmi2Status refuse(instance *i, const char *function, const char *why)
{
    return refuse_as(i, fmi2Error, function, why);
}

void tell(instance *i, const char *sentence)
{
    if (i->events) send(i, fmi2OK, "logEvents", sentence);
}

static const char *phase_name(unsigned phase)
{
    switch (phase) {
    case INSTANTIATED: return "instantiated";
    case INITIALIZING: return "initialization mode";
    case STEPPING: return "initialized";
    case TERMINATED: return "terminated";
    default: return "failed";
    }
}

/* the phases that would be right, in words */
static void name_phases(unsigned phases, char *words, size_t size)
{
    size_t n = 0;
    for (unsigned phase = INSTANTIATED; phase <= FAILED; phase *= 2)
        if ((phases & phase) && n < size)
            n += (size_t)snprintf(words + n, size - n, "%s%s", n ? " or " : "", phase_name(phase));
}

int in_phase(instance *i, const char *function, unsigned phases)
{
    char words[128] = "";
    if (!i) return 0;
    if (i->now.phase & phases) return 1;
    name_phases(phases, words, sizeof words);
    snprintf(i->why, sizeof i->why, "called while %s, expected %s", phase_name(i->now.phase), words);
    refuse(i, function, i->why);
    return 0;
}
