/* Model exchange: the importer integrates. */

static bool guard_fires(Fmu *m, int64_t k) { /* whether a guard has come to zero */
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    double sign = s->mode.p[k] == 0 ? 1.0 : -1.0;
    return sign * w->value.p[k] > -w->precision.p[k] && sign * w->rate.p[k] > 0.0;
}

/* Return whether an array of `n` values exists and has the length `length`. */
static bool has_length(Fmu *m, const char *function, const void *values, size_t n, size_t length) {
    if (n != length) fail(m, "%s: expected %lu values, got %lu", function, (unsigned long)length, (unsigned long)n);
    else if (n > 0 && values == NULL) null_pointer(m, function);
    else return true;
    return false;
}

EXPORT fmi3Status fmi3EnterEventMode(void *c) {
    Fmu *m = c;
    if (!is_allowed_in_exchange(m, "fmi3EnterEventMode", CONTINUOUS)) return fmi3Error;
    m->earliest = m->completed = m->time; /* the modes of contacts are those of this instant from here on */
    m->mode = EVENT;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterStepMode(void *c) {
    if (!is_allowed(c, "fmi3EnterStepMode", ANY)) return fmi3Error;
    return fail(c, "fmi3EnterStepMode: this unit has no Event Mode in co-simulation");
}

EXPORT fmi3Status fmi3EnterContinuousTimeMode(void *c) {
    Fmu *m = c;
    if (!is_allowed_in_exchange(m, "fmi3EnterContinuousTimeMode", EVENT)) return fmi3Error;
    m->mode = CONTINUOUS;
    return fmi3OK;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(
    void *c, bool *again, bool *terminate, bool *nominals, bool *values, bool *timed, double *next) {
    Fmu *m = c;
    double data[3], answer[2];
    if (!is_allowed_in_exchange(m, "fmi3UpdateDiscreteStates", EVENT)) return fmi3Error;
    if (!again || !terminate || !nominals || !values || !timed || !next) return null_pointer(m, "fmi3UpdateDiscreteStates");
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    *again = *terminate = *nominals = *values = *timed = false;
    if (m->fresh) follow(m);
    memcpy(w->saved.p, s->y.p, (size_t)s->y.n0 * sizeof(double));
    root_accept(m->time, s->y, &m->system, (F1_array){answer, 2});
    root_guards(m->time, s->y, &m->system, w->value, w->rate);
    for (int64_t k = 0; k < GUARDS; k++) {
        if (guard_fires(m, k) && root_reset(m->time, s->y, k, &m->system, (F1_array){data, 3})) {
            root_guards(m->time, s->y, &m->system, w->value, w->rate);
        }
    }
    *values = memcmp(w->saved.p, s->y.p, (size_t)s->y.n0 * sizeof(double)) != 0;
    for (int64_t k = 0; k < m->system.parameters.breaks.n0; k++) {
        double at = m->system.parameters.breaks.p[k];
        if (at > m->time + 1e-12 * at && (!*timed || at < *next)) {
            *timed = true;
            *next = at;
        }
    }
    forget(m);
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(void *c, bool final, bool *event, bool *terminate) {
    Fmu *m = c;
    (void)final;
    if (!is_allowed_in_exchange(m, "fmi3CompletedIntegratorStep", CONTINUOUS)) return fmi3Error;
    if (!event || !terminate) return null_pointer(m, "fmi3CompletedIntegratorStep");
    if (m->time > m->stop + time_slack(m->stop, m->time - m->completed))
        return fail(m, "a step to %.17g: must not go beyond the stop time %.17g", m->time, m->stop);
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    double answer[2], *near = m->system.work.near.p;
    *event = *terminate = false;
    if (m->fresh) follow(m);
    memcpy(w->saved.p, s->y.p, (size_t)s->y.n0 * sizeof(double));
    double before = near[1], step = m->time - near[2];
    root_accept(m->time, w->saved, &m->system, (F1_array){answer, 2});
    /* the importer's next step may cross it */
    if (answer[1] < 0.0 || (near[1] != before && answer[1] < 0.5 * step)) return singular(m);
    for (int64_t i = 0; i < s->y.n0; i++) {
        if (fabs(w->saved.p[i] - s->y.p[i]) > LARGEST_DRIFT * NOMINAL[i]) *event = true;
    }
    forget(m);
    m->earliest = m->completed;
    m->completed = m->time;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(void *c, double time) {
    Fmu *m = c;
    if (!is_allowed_in_exchange(m, "fmi3SetTime", EVENT | CONTINUOUS)) return fmi3Error;
    if (!(time >= m->earliest - time_slack(m->earliest, m->completed - m->earliest) && time < INFINITY))
        return fail(m, "time = %.17g: must be at least %.17g, the last event or the step before the last", time, m->earliest);
    m->time = time;
    m->outputs = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetContinuousStates(void *c, const double states[], size_t n) {
    Fmu *m = c;
    const char *name = "fmi3SetContinuousStates";
    if (!is_allowed_in_exchange(m, name, CONTINUOUS) || !has_length(m, name, states, n, STATES)) return fmi3Error;
    memcpy(m->integration.state.y.p, states, n * sizeof(double));
    m->outputs = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(void *c, double states[], size_t n) {
    Fmu *m = c;
    const char *name = "fmi3GetContinuousStates";
    if (!is_allowed_in_exchange(m, name, ~INSTANTIATED) || !has_length(m, name, states, n, STATES)) return fmi3Error;
    memcpy(states, m->integration.state.y.p, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(void *c, double rates[], size_t n) {
    Fmu *m = c;
    const char *name = "fmi3GetContinuousStateDerivatives";
    if (!is_allowed_in_exchange(m, name, ~INSTANTIATED) || !has_length(m, name, rates, n, STATES)) return fmi3Error;
    F1_array slope = m->integration.work.slope;
    if (m->fresh) follow(m);
    root_rate(m->time, m->integration.state.y, &m->system, slope);
    for (size_t i = 0; i < n; i++) {
        rates[i] = slope.p[i];
        if (!isfinite(rates[i])) return warn(m, fmi3Discard, "derivative %lu is not finite", (unsigned long)i + 1);
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetEventIndicators(void *c, double indicators[], size_t n) {
    Fmu *m = c;
    const char *name = "fmi3GetEventIndicators";
    if (!is_allowed_in_exchange(m, name, ~INSTANTIATED) || !has_length(m, name, indicators, n, GUARDS)) return fmi3Error;
    if (n == 0) return fmi3OK;
    if (m->fresh) follow(m);
    root_guards(m->time, m->integration.state.y, &m->system, m->integration.work.value, m->integration.work.rate);
    memcpy(indicators, m->integration.work.value.p, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(void *c, double nominals[], size_t n) {
    Fmu *m = c;
    const char *name = "fmi3GetNominalsOfContinuousStates";
    if (!is_allowed_in_exchange(m, name, ~INSTANTIATED) || !has_length(m, name, nominals, n, STATES)) return fmi3Error;
    for (size_t i = 0; i < n; i++) nominals[i] = NOMINAL[i];
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(void *c, size_t *n) {
    if (!is_allowed_in_exchange(c, "fmi3GetNumberOfEventIndicators", ANY)) return fmi3Error;
    if (n == NULL) return null_pointer(c, "fmi3GetNumberOfEventIndicators");
    *n = GUARDS;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(void *c, size_t *n) {
    if (!is_allowed_in_exchange(c, "fmi3GetNumberOfContinuousStates", ANY)) return fmi3Error;
    if (n == NULL) return null_pointer(c, "fmi3GetNumberOfContinuousStates");
    *n = STATES;
    return fmi3OK;
}
