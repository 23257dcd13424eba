/* Errors of simulated channels, whitened: what the Python package fits (engine/fitting/whitening.py). */
#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { BLOCK = 1024, ORDER = 8, SUMS = 8 };

typedef struct {
    int64_t count, order, starts; /* samples, of the filter, samples at which it begins anew */
    int64_t first;                /* row of the first sample, where index is NULL */
    const int64_t *index;         /* [count]: row of each sample, or NULL: one after the other */
    const double *value;          /* [count]: what was measured, or NULL: rows are errors already */
    const int64_t *start;         /* [starts] */
    const double *coefficient;    /* [order]: e_n = sum_j a_j e_{n-j} + w_n */
    double innovation, marginal;  /* standard deviations of w and of e */
    const double *offset;         /* [count]: of unit length, projected out; or NULL */
} whitening;

static double error_at(const whitening *f, const double *row, int64_t n)
{
    const double shown = row[f->index ? f->index[n] : f->first + n];
    return f->value ? f->value[n] - shown : shown;
}

/* errors of n samples from at on */
static void errors(const whitening *f, const double *row, int64_t at, int64_t n, double *e)
{
    if (f->index)
        for (int64_t i = 0; i < n; i++) e[i] = row[f->index[at + i]];
    else
        for (int64_t i = 0; i < n; i++) e[i] = row[f->first + at + i];
    if (f->value)
        for (int64_t i = 0; i < n; i++) e[i] = f->value[at + i] - e[i];
}

/* n samples of innovations; ``order`` is known to the compiler, so that one pass does it */
static inline void innovations(const double *e, const double *a, double share, int order, int64_t n,
                               double *restrict w)
{
    for (int64_t i = 0; i < n; i++) {
        double sum = share * e[i];
        for (int k = 1; k <= order; k++) sum -= a[k - 1] * e[i - k];
        w[i] = sum;
    }
}

static void filter(const whitening *f, const double *row, double *white)
{
    double buffer[ORDER + BLOCK] = {0.0}, *e = buffer + ORDER;
    double a[ORDER] = {0.0};
    const double share = 1.0 / f->innovation;
    for (int64_t k = 0; k < f->order; k++) a[k] = f->coefficient[k] * share;
    for (int64_t at = 0; at < f->count; at += BLOCK) {
        const int64_t n = f->count - at < BLOCK ? f->count - at : BLOCK;
        double *w = white + at;
        errors(f, row, at, n, e);
        if (f->order == 0) innovations(e, a, share, 0, n, w);
        else if (f->order <= 2) innovations(e, a, share, 2, n, w);
        else if (f->order <= 4) innovations(e, a, share, 4, n, w);
        else innovations(e, a, share, ORDER, n, w);
        for (int k = 1; k <= ORDER; k++) e[-k] = e[n - k];
    }
    for (int64_t k = 0; k < f->starts; k++)
        white[f->start[k]] = error_at(f, row, f->start[k]) / f->marginal;
}

static void project(int64_t count, const double *one, double *white)
{
    double sum[SUMS] = {0.0}, total = 0.0;
    int64_t n = 0;
    for (; n + SUMS <= count; n += SUMS)
        for (int i = 0; i < SUMS; i++) sum[i] += white[n + i] * one[n + i];
    for (; n < count; n++) sum[0] += white[n] * one[n];
    for (int i = 0; i < SUMS; i++) total += sum[i];
    for (n = 0; n < count; n++) white[n] -= total * one[n];
}

/* rows [sets], ``stride`` apart, into the arrays that ``white`` points to */
EXPORT void whiten(const whitening *f, int64_t sets, const double *row, int64_t stride, double *const *white)
{
    for (int64_t s = 0; s < sets; s++) {
        filter(f, row + s * stride, white[s]);
        if (f->offset) project(f->count, f->offset, white[s]);
    }
}
