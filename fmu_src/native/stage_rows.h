/* Rows of a recording one after the other, where no hook runs.  Part of stage.c. */

INLINE int64_t steps_in(double duration, double limit)
{
    return (int64_t)larger(ceil(duration / limit - 1e-9), 1.0);
}

/* angles at a row and their rates: the same in all lanes, or each its own */
INLINE void find_course(const sweep *w, int row, double duration, interval *at)
{
    lane next;
    for (int i = 0; i < 2; i++) {
        const double *const *input = w->input[i];
        if (!w->apart) {
            const double first = input[0][row], rate = (input[0][row + 1] - first) / duration;
            EACH { at->angle[i][l] = first; at->rate[i][l] = rate; }
            continue;
        }
        for (int l = 0; l < LANES; l++) { at->angle[i][l] = input[l][row]; next[l] = input[l][row + 1]; }
        EACH at->rate[i][l] = (next[l] - at->angle[i][l]) / duration;
    }
}

/* the interval behind a row */
INLINE void find_interval(sweep *w, int row)
{
    interval *at = &w->part[w->turn];
    at->start = at->since = w->time[row];
    at->duration = w->time[row + 1] - at->start;
    at->count = steps_in(at->duration, w->limit);
    at->step = at->duration / (double)at->count;
    find_course(w, row, at->duration, at);
}

/* what set_step found holds for steps that differ by rounding alone */
INLINE int same_step(const stage *s, double h) { return fabs(h - s->held_step) <= 1e-9 * h; }

/* go on to the next interval, and look for the one behind it meanwhile: its divisions take as long
 * as steps.  0: there is none, or set_step is due */
INLINE int begin_interval(const stage *s, sweep *w)
{
    const int row = w->row + 1;
    w->turn = !w->turn;
    if (row + 1 >= w->rows) return 0;
    find_interval(w, row);
    return same_step(s, w->part[w->turn].step);
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
