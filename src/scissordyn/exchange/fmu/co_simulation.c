/* Co-simulation: the package's own loop. */

static bool drop_history(Fmu *m) { /* what controllers no longer look back at; whether that gave room */
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    int64_t length = s->history_length.p[0], old = 0;
    double longest = 0.0;
    for (int64_t k = 0; k < w->delays.n0; k++) longest = fmax(longest, w->delays.p[k]);
    while (old < length) {
        const double *row = s->history.p + old * s->history.s;
        if (row[0] + row[1] >= s->clock.p[0].time - 1.001 * longest) break;
        old++;
    }
    memmove(s->history.p, s->history.p + old * s->history.s, (size_t)((length - old) * s->history.s) * sizeof(double));
    s->history_length.p[0] = length - old;
    return old > 0;
}

EXPORT fmi3Status fmi3DoStep(
    void *c, double from, double size, bool final, bool *event, bool *terminate, bool *early, double *reached) {
    Fmu *m = c;
    (void)final;
    if (m != NULL && m->exchange) return fail(m, "fmi3DoStep is a function of co-simulation");
    if (!is_allowed(m, "fmi3DoStep", STEP)) return fmi3Error;
    if (!event || !terminate || !early || !reached) return null_pointer(m, "fmi3DoStep");
    State *s = &m->integration.state;
    double time = s->clock.p[0].time, slack = time_slack(time, size), end = from + size;
    *event = *terminate = *early = false;
    *reached = time;
    if (!(fabs(from - time) <= slack))
        return fail(m, "currentCommunicationPoint = %.17g: must be %.17g; to repeat a step, call fmi3SetFMUState first", from, time);
    if (!(size > 0.0 && end > time && end < INFINITY)) return fail(m, "communicationStepSize = %.17g: must be greater than 0", size);
    if (end > m->stop + slack) return fail(m, "a step to %.17g: must not go beyond the stop time %.17g", end, m->stop);
    if (m->fresh) follow(m);
    s->clock.p[0].end = end;
    for (int64_t trial = 0; trial < MOST_TRIALS; trial++) {
        int64_t before = s->counts.p[0].events, status = root_advance(&m->system, &m->integration, 1);
        m->time = *reached = s->clock.p[0].time;
        if (status == FINISHED || (status == ADVANCING && s->clock.p[0].time >= s->clock.p[0].end)) {
            m->outputs = 0;
            return fmi3OK;
        }
        if (status == LOG_FULL) {
            s->counts.p[0].events = 0;
        } else if (status == HISTORY_FULL && drop_history(m)) {
            continue;
        } else if (status == CHANGE_POINT) {
            return singular(m);
        } else if (status != ADVANCING) {
            return fail(m, "%s", status == STEP_TOO_SMALL ? "the step size fell to round-off"
                                   : status == NOT_FINITE   ? "a law or a position became infinite or not a number"
                                   : status == HISTORY_FULL ? "a controller looks back over more steps than there is room for"
                                                            : "contacts and separations followed each other without any progress in time");
        } else if (m->early && s->counts.p[0].events > before) {
            *early = true;
            m->outputs = 0;
            return fmi3OK;
        }
    }
    return fail(m, "too many steps");
}
