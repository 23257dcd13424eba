/* Reading resources/machine.txt.  Numbers are IEEE bits in hex: no locale can bend them.
 *
 *   corexy-machine 1
 *   interface {guid of the native FMU}
 *   name yin2018
 *   drive 1 stepper
 *   fidelity 1 full
 *   count 264
 *   0 3f747ae147ae147b pulley.radius 0.005 m
 *   ...
 *   checksum 0123456789abcdef           (FNV-1a, 64 bit, of all bytes above this line) */
#include "machine_file.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#define NOGDI
#define NOUSER /* it has an INPUT of its own */
#include <windows.h>
#endif

#define REFUSE(...) return snprintf(why, SENTENCE, __VA_ARGS__), 0
#define FILE_NAME "resources/machine.txt"

enum { LARGEST_FILE = 1 << 22, LONGEST_PATH = 4096 };

struct text { const char *at, *end; };

static int hex_digit(int c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* a file URI, or a plain path, as a path: the scheme and the host go, every %XX is decoded */
static char *path_of(const char *location, const char *file)
{
    const int is_uri = strncmp(location, "file:", 5) == 0;
    const char *from = location + (is_uri ? 5 : 0);
    if (is_uri && from[0] == '/' && from[1] == '/') {
        from = strchr(from + 2, '/');
        if (!from) return 0;
    }
#ifdef _WIN32
    if (is_uri && *from == '/') from++; /* file:///C:/... and file:/C:/... */
#endif
    char *path = malloc(strlen(from) + strlen(file) + 2), *to = path;
    if (!path) return 0;
    for (; *from; from++) {
        const int high = is_uri && *from == '%' ? hex_digit(from[1]) : -1;
        const int low = high < 0 ? -1 : hex_digit(from[2]);
        *to++ = (char)(low < 0 ? *from : 16 * high + low);
        if (low >= 0) from += 2;
    }
    if (to > path && to[-1] == '/') to--;
    sprintf(to, "/%s", file);
    return path;
}

/* a decoded URI is UTF-8, which fopen of Windows does not know */
static FILE *open_file(const char *path)
{
#ifdef _WIN32
    wchar_t wide[LONGEST_PATH];
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, LONGEST_PATH))
        return _wfopen(wide, L"rb");
#endif
    return fopen(path, "rb");
}

/* the whole file in memory, or 0 */
static char *slurp(const char *path, size_t *size)
{
    FILE *file = open_file(path);
    char *bytes = file ? malloc(LARGEST_FILE) : 0;
    *size = bytes ? fread(bytes, 1, LARGEST_FILE, file) : 0;
    if (file) fclose(file);
    return bytes;
}

/* the parts of a line */

static int take_word(struct text *t, const char *word)
{
    const size_t length = strlen(word);
    if ((size_t)(t->end - t->at) < length || memcmp(t->at, word, length)) return 0;
    t->at += length;
    return 1;
}

static int take_count(struct text *t, int *value)
{
    const char *first = t->at;
    for (*value = 0; t->at < t->end && *t->at >= '0' && *t->at <= '9' && t->at - first < 7; t->at++)
        *value = 10 * *value + (*t->at - '0');
    return t->at > first;
}

static int take_bits(struct text *t, uint64_t *bits)
{
    *bits = 0;
    for (int i = 0; i < 16; i++, t->at++) {
        const int digit = t->at < t->end ? hex_digit(*t->at) : -1;
        if (digit < 0) return 0;
        *bits = *bits << 4 | (uint64_t)digit;
    }
    return 1;
}

static int take_rest(struct text *t, char *rest, size_t size)
{
    size_t n = 0;
    for (; t->at < t->end && *t->at != '\n'; t->at++)
        if (n + 1 < size) rest[n++] = *t->at;
    rest[n] = 0;
    return take_word(t, "\n");
}

/* the checksum, then line by line */

static int check_sum(struct text *t, char *why)
{
    const char *last = t->end;
    uint64_t sum = 14695981039346656037u, written;
    for (int ends = 0; last > t->at; last--)
        if (last[-1] == '\n' && ++ends == 2) break;
    struct text line = {last, t->end};
    if (!take_word(&line, "checksum ") || !take_bits(&line, &written))
        REFUSE(FILE_NAME " is damaged: its last line is no checksum; unpack the FMU again");
    for (const char *c = t->at; c < last; c++) sum = (sum ^ (unsigned char)*c) * 1099511628211u;
    if (sum != written) REFUSE(FILE_NAME " is damaged: its checksum is wrong; unpack the FMU again");
    t->end = last;
    return 1;
}

static int parse_head(struct text *t, slave *s, char *name, int *count, char *why)
{
    char rest[MACHINE_NAME];
    if (!take_word(t, "corexy-machine 1\n"))
        REFUSE(FILE_NAME " is no machine of this format, expected corexy-machine 1");
    if (!take_word(t, "interface ") || !take_rest(t, rest, sizeof rest) || strcmp(rest, slave_interface()))
        REFUSE(FILE_NAME " belongs to an FMU with other variables, expected interface %s", slave_interface());
    const int whole = take_word(t, "name ") && take_rest(t, name, MACHINE_NAME)
        && take_word(t, "drive ") && take_count(t, &s->choice[CHOICE_DRIVE]) && take_rest(t, rest, sizeof rest)
        && take_word(t, "fidelity ") && take_count(t, &s->choice[CHOICE_FIDELITY])
        && take_rest(t, rest, sizeof rest)
        && take_word(t, "count ") && take_count(t, count) && take_word(t, "\n");
    const int known = whole && s->choice[CHOICE_DRIVE] >= 1 && s->choice[CHOICE_DRIVE] <= 2
        && s->choice[CHOICE_FIDELITY] >= 1 && s->choice[CHOICE_FIDELITY] <= STAGE_COUNT;
    if (!known) REFUSE(FILE_NAME ": found no name, drive, fidelity and count, expected them");
    for (int i = 0; i <= CHOICE_FIDELITY; i++) s->choice[i]--;
    return 1;
}

static int parse_parameter(struct text *t, slave *s, int place, char *why)
{
    char rest[MACHINE_NAME];
    uint64_t bits;
    int number;
    double value;
    const int whole = take_count(t, &number) && take_word(t, " ") && take_bits(t, &bits)
        && take_rest(t, rest, sizeof rest);
    if (!whole || number != place) REFUSE(FILE_NAME ": no line for parameter %d, expected it", place);
    memcpy(&value, &bits, sizeof value);
    return slave_load_parameter(s, place, value, why);
}

static int parse(struct text *t, slave *s, char *name, char *why)
{
    int count;
    if (!check_sum(t, why) || !parse_head(t, s, name, &count, why)) return 0;
    if (count != slave_parameter_count())
        REFUSE(FILE_NAME ": %d parameters, expected %d", count, slave_parameter_count());
    for (int place = 0; place < count; place++)
        if (!parse_parameter(t, s, place, why)) return 0;
    if (t->at != t->end) REFUSE(FILE_NAME ": more lines than parameters");
    return slave_check_parameters(s, why);
}

int read_machine(const char *location, slave *s, char name[MACHINE_NAME], char *why)
{
    size_t size = 0;
    char *path = location ? path_of(location, "machine.txt") : 0;
    char *bytes = path ? slurp(path, &size) : 0;
    struct text text = {bytes, bytes ? bytes + size : 0};
    int done = 0;
    if (!bytes) snprintf(why, SENTENCE, "%s cannot be read, expected the machine of this FMU there",
                         path ? path : "fmuResourceLocation is no file URI: " FILE_NAME);
    else done = parse(&text, s, name, why);
    free(bytes);
    free(path);
    return done;
}
