/* FMI 3.0 for one mechanism of scissordyn. What stands above is generated: the kernels (k_...), the data, `connect`, `place`.

   The names and types of the functions are those of the FMI standard 3.0 (https://fmi-standard.org). */

#include <float.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*LogMessage)(void *environment, fmi3Status status, const char *category, const char *message);

enum { EVALUATED = 1, MOST_TRIALS = 100000000 };
static const double TIME_TOL = 1e-6; /* [steps] difference of the importer's time from this unit's, beside round-off */
static const double TOLERANCE_MIN = 1e-14, TOLERANCE_MAX = 0.01; /* range of `rtol` in [run] */
static const double LARGEST_DRIFT = 1e-9; /* of a state in model exchange, as a part of its size, beyond which it is projected */

/* States of the standard's state machine; an error leads to TERMINATED. */
enum { INSTANTIATED = 1, INITIALIZATION = 2, EVENT = 4, CONTINUOUS = 8, STEP = 16, TERMINATED = 32, ANY = 63 };
enum { SETTING = INSTANTIATED | INITIALIZATION }; /* where fixed parameters may be set */

static const char *mode_name(int mode) {
    switch (mode) {
        case INSTANTIATED: return "Instantiated";
        case INITIALIZATION: return "Initialization Mode";
        case EVENT: return "Event Mode";
        case CONTINUOUS: return "Continuous-Time Mode";
        case STEP: return "Step Mode";
        default: return "Terminated";
    }
}

/* Messages. */

static void log_message(Fmu *m, fmi3Status status, const char *format, va_list values) {
    char text[300], line[400];
    vsnprintf(text, sizeof text, format, values);
    snprintf(line, sizeof line, "%s (t = %.9g s)", text, m->time);
    if (m->say) ((LogMessage)m->say)(m->environment, status, status == fmi3Error ? "logStatusError" : "logStatusWarning", line);
}

static fmi3Status fail(Fmu *m, const char *format, ...) {
    va_list values;
    va_start(values, format);
    log_message(m, fmi3Error, format, values);
    va_end(values);
    m->mode = TERMINATED;
    return fmi3Error;
}

/* Log the reason of fmi3Warning or fmi3Discard, and return it. */
static fmi3Status warn(Fmu *m, fmi3Status status, const char *format, ...) {
    va_list values;
    va_start(values, format);
    if (m->warnings) log_message(m, status, format, values);
    va_end(values);
    return status;
}

/* Return whether a function may be called now. */
static bool is_allowed(Fmu *m, const char *function, int modes) {
    if (m == NULL) return false;
    if (m->mode & modes) return true;
    fail(m, "%s must not be called in state %s", function, mode_name(m->mode));
    return false;
}

/* Return whether a function of model exchange may be called now. */
static bool is_allowed_in_exchange(Fmu *m, const char *function, int modes) {
    if (m == NULL || m->exchange) return is_allowed(m, function, modes);
    fail(m, "%s is a function of model exchange", function);
    return false;
}

/* Return the difference that the importer's time may have from this unit's, as it adds up steps: [s] */
static double time_slack(double time, double step) { return TIME_TOL * fabs(step) + 8.0 * DBL_EPSILON * fabs(time); }

static fmi3Status null_pointer(Fmu *m, const char *function) { return fail(m, "%s: an argument is a null pointer", function); }

/* Steps across change points need the whole program. */
static fmi3Status singular(Fmu *m) {
    return fail(m, "a singular position ahead, where bodies become aligned, across which this unit makes no steps; scissordyn does");
}

/* The present time and state, of the instance or of its integrator. */

static double now(Fmu *m) { return m->exchange ? m->time : m->integration.state.clock.p[0].time; }

static void forget(Fmu *m) { /* what was evaluated for other inputs or another state */
    m->outputs = 0;
    m->system.work.instant.p[0] = NAN;
    m->observer.work.instant.p[0] = NAN;
    m->integration.state.clock.p[0].prepared = 0;
}

static void follow(Fmu *m) { /* the prescribed motions that come from inputs: angle + speed s + acceleration s^2 / 2 from here on */
    F2_array motion = m->system.parameters.motion;
    double t = now(m);
    for (int k = 0; k < INPUTS; k++) {
        const double *given = m->input + 3 * k;
        if (!m->external[k]) continue;
        for (int64_t row = m->system.parameters.motion_start.p[FUNCTION[k]]; row < m->system.parameters.motion_start.p[FUNCTION[k] + 1]; row++) {
            double *p = motion.p + row * motion.s;
            memset(p, 0, (size_t)motion.n1 * sizeof *p);
            p[0] = t;
            p[4] = 0.5 * given[2];
            p[5] = given[1];
            p[6] = given[0];
        }
    }
    m->fresh = 0;
    forget(m);
}

static void fill_history(Fmu *m) { /* before the start signals are constant: S = y + R S, by the answers to S = 0 and S = 1 */
    F1_array past = m->system.state.initial_history;
    double answers[2][SIGNALS + 1];
    for (int value = 0; value < 2; value++) {
        for (int k = 0; k < SIGNALS; k++) past.p[k] = value;
        root_record(0.0, m->integration.state.y, &m->system, (F1_array){answers[value], SIGNALS});
    }
    for (int k = 0; k < SIGNALS; k++) past.p[k] = answers[0][k] / (1.0 - (answers[1][k] - answers[0][k]));
}

static void evaluate(Fmu *m) { /* the outputs at the present time and state */
    State *s = &m->integration.state;
    if (m->fresh) follow(m);
    if (m->outputs == EVALUATED) return;
    m->samples.time.p[0] = now(m);
    memcpy(m->samples.state.p, s->y.p, (size_t)s->y.n0 * sizeof(double));
    memcpy(m->samples.mode.p, s->mode.p, (size_t)s->mode.n0 * sizeof(int64_t));
    memcpy(m->samples.memory.p, s->memory.p, (size_t)s->memory.n0 * sizeof(double));
    memcpy(m->samples.mass.p, s->mass.p, (size_t)s->mass.n0 * sizeof(double));
    memcpy(m->samples.reference.p, s->reference.p, (size_t)s->reference.n0 * sizeof(double));
    memcpy(m->observer.work.segment.p, m->system.work.segment.p, 2 * sizeof(double));
    memset(m->record.load.p, 0, (size_t)(m->record.load.n0 * m->record.load.n1 * m->record.load.n2) * sizeof(double));
    root_fill(&m->samples, &m->observer, &m->maps, &m->record, m->counted);
    m->outputs = EVALUATED;
}

/* Instances and modes. */

static Fmu *refuse(void *environment, LogMessage say, const char *text) {
    if (say) say(environment, fmi3Error, "logStatusError", text);
    return NULL;
}

static Fmu *create_instance(
    const char *name, const char *token, void *environment, LogMessage say, bool logging, bool exchange, bool early) {
    Fmu *m;
    if (name == NULL || name[strspn(name, " \t\r\n")] == '\0') return refuse(environment, say, "instanceName is empty");
    if (token == NULL || strcmp(token, TOKEN) != 0) return refuse(environment, say, "the instantiation token is that of another unit");
    m = calloc(1, sizeof(Fmu));
    if (m == NULL) return refuse(environment, say, "no memory");
    m->w = calloc(WORDS + 1, sizeof(word));
    if (m->w == NULL) {
        free(m);
        return refuse(environment, say, "no memory");
    }
    m->environment = environment;
    m->say = (void *)say;
    m->warnings = logging;
    m->exchange = exchange;
    m->early = early;
    connect(m);
    begin(m);
    m->mode = INSTANTIATED;
    return m;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3SetDebugLogging", ANY)) return fmi3Error;
    if (n > 0 && categories == NULL) return null_pointer(m, "fmi3SetDebugLogging");
    if (n == 0) m->warnings = on;
    for (size_t k = 0; k < n; k++) {
        if (categories[k] != NULL && strcmp(categories[k], "logStatusWarning") == 0) m->warnings = on;
        else if (categories[k] == NULL || strcmp(categories[k], "logStatusError") != 0) return fail(m, "unknown category of messages");
    }
    return fmi3OK;
}

EXPORT void *fmi3InstantiateModelExchange(
    const char *name, const char *token, const char *path, bool visible, bool logging, void *environment, LogMessage say) {
    (void)path; (void)visible;
    if (SIGNALS > 0) return refuse(environment, say, "a controller that looks back needs the steps of this unit: co-simulation");
    return create_instance(name, token, environment, say, logging, true, false);
}

EXPORT void *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *path, bool visible, bool logging, bool events, bool early,
    const uint32_t required[], size_t n, void *environment, LogMessage say, void *update) {
    (void)path; (void)visible; (void)required; (void)update;
    if (events) return refuse(environment, say, "eventModeUsed = true: this unit has no Event Mode in co-simulation");
    if (n > 0) return refuse(environment, say, "requiredIntermediateVariables: this unit has no Intermediate Update Mode");
    return create_instance(name, token, environment, say, logging, false, early);
}

EXPORT void *fmi3InstantiateScheduledExecution(
    const char *name, const char *token, const char *path, bool visible, bool logging, void *environment, LogMessage say, void *update,
    void *lock, void *unlock) {
    (void)name; (void)token; (void)path; (void)visible; (void)logging; (void)update; (void)lock; (void)unlock;
    return refuse(environment, say, "there is no scheduled execution in this unit");
}

EXPORT void fmi3FreeInstance(void *c) {
    Fmu *m = c;
    if (m == NULL) return;
    free(m->w);
    free(m);
}

EXPORT fmi3Status fmi3EnterInitializationMode(void *c, bool defined, double tolerance, double start, bool stops, double stop) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3EnterInitializationMode", INSTANTIATED)) return fmi3Error;
    if (start != 0.0) return fail(m, "startTime = %.9g: the mechanism starts at t = 0 and at no other time", start);
    if (stops && !(stop > start)) return fail(m, "stopTime = %.9g: must be greater than the start time 0", stop);
    if (defined && !(tolerance >= TOLERANCE_MIN && tolerance <= TOLERANCE_MAX))
        return fail(m, "tolerance = %.9g: must be a number from %g to %g", tolerance, TOLERANCE_MIN, TOLERANCE_MAX);
    if (defined) {
        Work *w = &m->integration.work;
        double factor = tolerance / TOLERANCE;
        for (int64_t i = 0; i < w->rtol.n0; i++) {
            w->rtol.p[i] *= factor;
            w->atol.p[i] *= factor;
        }
    }
    m->stop = stops ? stop : INFINITY;
    m->mode = INITIALIZATION;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(void *c) {
    Fmu *m = c;
    double answer[2];
    if (!is_allowed(m, "fmi3ExitInitializationMode", INITIALIZATION)) return fmi3Error;
    if (m->fresh) follow(m);
    if (SIGNALS > 0) fill_history(m);
    root_accept(0.0, m->integration.state.y, &m->system, (F1_array){answer, 2});
    m->integration.state.clock.p[0].longest = answer[1];
    forget(m);
    m->mode = m->exchange ? EVENT : STEP;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Terminate(void *c) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3Terminate", EVENT | CONTINUOUS | STEP)) return fmi3Error;
    m->mode = TERMINATED;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Reset(void *c) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3Reset", ANY)) return fmi3Error;
    memset(m->w, 0, WORDS * sizeof(word));
    memset(m->input, 0, sizeof m->input);
    memset(m->external, 0, sizeof m->external);
    memset(m->idle, 0, sizeof m->idle);
    m->time = m->completed = m->earliest = 0.0;
    m->outputs = 0;
    m->fresh = 0;
    connect(m);
    begin(m);
    m->mode = INSTANTIATED;
    return fmi3OK;
}

/* Values. */

/* Return whether `n` references go with `count` values that exist; every variable is a scalar. */
static bool check_values(Fmu *m, const char *function, const uint32_t references[], size_t n, const void *values, size_t count) {
    if (n != count) fail(m, "%s: %lu values of %lu variables", function, (unsigned long)count, (unsigned long)n);
    else if (n > 0 && (references == NULL || values == NULL)) null_pointer(m, function);
    else return true;
    return false;
}

EXPORT fmi3Status fmi3GetFloat64(void *c, const uint32_t references[], size_t n, double values[], size_t count) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3GetFloat64", ANY) || !check_values(m, "fmi3GetFloat64", references, n, values, count)) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        const double *found;
        if (references[k] == 0) {
            values[k] = now(m);
            continue;
        }
        if (references[k] >= FIRST_RATE && references[k] < FIRST_RATE + STATES) {
            if (m->fresh) follow(m);
            root_rate(now(m), m->integration.state.y, &m->system, m->integration.work.slope);
            m->integration.state.clock.p[0].prepared = 0;
        } else if (references[k] >= FIRST_GUARD && references[k] < FIRST_GUARD + GUARDS) {
            if (m->fresh) follow(m);
            root_guards(now(m), m->integration.state.y, &m->system, m->integration.work.value, m->integration.work.rate);
        } else if (references[k] >= FIRST_OUTPUT) {
            evaluate(m);
        }
        found = place(m, references[k]);
        if (found == NULL) return fail(m, "value reference %lu is no Float64", (unsigned long)references[k]);
        values[k] = factor(references[k]) * *found;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(void *c, const uint32_t references[], size_t n, const double values[], size_t count) {
    Fmu *m = c;
    fmi3Status status = fmi3OK;
    if (!is_allowed(m, "fmi3SetFloat64", ANY & ~TERMINATED)) return fmi3Error;
    if (!check_values(m, "fmi3SetFloat64", references, n, values, count)) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        unsigned long reference = references[k];
        bool input = reference >= FIRST_INPUT && reference < FIRST_INPUT + 3 * INPUTS;
        if (!input) return fail(m, "value reference %lu is no input", reference);
        if (!isfinite(values[k])) return fail(m, "input %lu = %g: must be a finite number", reference, values[k]);
    }
    for (size_t k = 0; k < n; k++) {
        unsigned place = references[k] - FIRST_INPUT, motion = place / 3;
        bool changed = m->input[place] != values[k];
        m->input[place] = values[k];
        if (m->external[motion]) {
            m->fresh = 1;
        } else if (changed && !(m->mode & SETTING) && !m->idle[motion]) {
            m->idle[motion] = true; /* one message is enough */
            status = warn(m, fmi3Warning, "input %lu has no effect: parameter %lu, '....external', must be true",
                          (unsigned long)references[k], (unsigned long)(FIRST_FLAG + motion));
        }
    }
    return status;
}

EXPORT fmi3Status fmi3GetBoolean(void *c, const uint32_t references[], size_t n, bool values[], size_t count) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3GetBoolean", ANY) || !check_values(m, "fmi3GetBoolean", references, n, values, count)) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        unsigned long reference = references[k];
        if (reference < FIRST_FLAG || reference >= FIRST_FLAG + INPUTS) return fail(m, "value reference %lu is no Boolean", reference);
        values[k] = m->external[reference - FIRST_FLAG];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetBoolean(void *c, const uint32_t references[], size_t n, const bool values[], size_t count) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3SetBoolean", ANY) || !check_values(m, "fmi3SetBoolean", references, n, values, count)) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        unsigned long reference = references[k];
        if (reference < FIRST_FLAG || reference >= FIRST_FLAG + INPUTS) return fail(m, "value reference %lu is no Boolean", reference);
        if (!(m->mode & SETTING))
            return fail(m, "parameter %lu is fixed: it must be set before fmi3ExitInitializationMode", reference);
    }
    for (size_t k = 0; k < n; k++) m->external[references[k] - FIRST_FLAG] = values[k];
    if (n > 0) m->fresh = 1;
    return fmi3OK;
}
