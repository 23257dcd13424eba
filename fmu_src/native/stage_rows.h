/* Rows of a recording one after the other, where no hook runs.  Part of stage.c. */

INLINE int64_t steps_in(double duration, double limit)
{
    return (int64_t)larger(ceil(duration / limit - 1e-9), 1.0);
}

/* the interval behind a row */
INLINE interval interval_of(const sweep *w, int row)
{
    const double start = w->time[row], duration = w->time[row + 1] - start;
    const int64_t count = steps_in(duration, w->limit);
    interval at = {.start = start, .duration = duration, .step = duration / (double)count,
                   .since = start, .count = count};
    lane next;
    for (int i = 0; i < 2; i++) {
        for (int l = 0; l < LANES; l++) at.angle[i][l] = w->input[i][l][row];
        for (int l = 0; l < LANES; l++) next[l] = w->input[i][l][row + 1];
        EACH at.rate[i][l] = (next[l] - at.angle[i][l]) / duration;
    }
    return at;
}

/* the constants of set_kick hold for steps that differ by rounding alone */
INLINE int same_kick(const stage *s, double h) { return fabs(h - s->kick_step) <= 1e-9 * h; }

/* go on to the next interval, and look for the one behind it meanwhile: its divisions take as long
 * as steps.  0: there is none, or set_kick is due */
INLINE int begin_interval(const stage *s, sweep *w)
{
    const int row = w->row + 1;
    w->turn = !w->turn;
    if (row + 1 >= w->rows) return 0;
    w->part[w->turn] = interval_of(w, row);
    return same_kick(s, w->part[w->turn].step);
}

/* end of the n-th micro-step */
INLINE double end_of_step(const interval *at, int64_t n)
{
    return at->start + (n < at->count ? (double)n * at->step : at->duration);
}

/* what is looked at, at the row that is now reached */
INLINE void reach_row(sweep *w)
{
    const size_t row = (size_t)++w->row;
    for (int c = 0; c < w->channels; c++) {
        const double *value = *w->seen[c];
        for (int l = 0; l < LANES; l++) w->out[l][(size_t)c * w->rows + row] = value[l];
    }
}
