/* FMI 3.0 for one mechanism of scissordyn. What stands above is generated: the kernels (k_...), the data, `connect`, `place`.

   The names and types of the functions are those of the FMI standard 3.0 (https://fmi-standard.org). */

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
static const double LARGEST_DRIFT = 1e-9; /* of a state in model exchange, as a part of its size, beyond which it is projected */

static Fmu *made(const char *token, void *environment, LogMessage say, bool exchange, bool early) {
    Fmu *m;
    if (token == NULL || strcmp(token, TOKEN) != 0) {
        if (say) say(environment, fmi3Error, "logStatusError", "the instantiation token is that of another unit");
        return NULL;
    }
    m = calloc(1, sizeof(Fmu));
    if (m == NULL) return NULL;
    m->w = calloc(WORDS + 1, sizeof(word));
    if (m->w == NULL) {
        free(m);
        return NULL;
    }
    m->environment = environment;
    m->say = (void *)say;
    m->exchange = exchange;
    m->early = early;
    connect(m);
    begin(m);
    return m;
}

static fmi3Status failed(Fmu *m, const char *text) {
    char line[400];
    snprintf(line, sizeof line, "%s at t = %.9g s", text, m->time);
    if (m->say) ((LogMessage)m->say)(m->environment, fmi3Error, "logStatusError", line);
    return fmi3Error;
}

/* Steps across change points need the whole program. */
static fmi3Status singular(Fmu *m) {
    return failed(m, "a singular position ahead, where bodies become aligned, across which this unit makes no steps; scissordyn does,");
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

static void evaluate(Fmu *m) { /* the outputs at the present time and state */
    State *s = &m->integration.state;
    if (m->fresh) follow(m);
    if (m->outputs == EVALUATED) return;
    m->samples.time.p[0] = now(m);
    memcpy(m->samples.state.p, s->y.p, (size_t)s->y.n0 * sizeof(double));
    memcpy(m->samples.mode.p, s->mode.p, (size_t)s->mode.n0 * sizeof(int64_t));
    memcpy(m->samples.memory.p, s->memory.p, (size_t)s->memory.n0 * sizeof(double));
    memcpy(m->samples.reference.p, s->reference.p, (size_t)s->reference.n0 * sizeof(double));
    memcpy(m->observer.work.segment.p, m->system.work.segment.p, 2 * sizeof(double));
    memset(m->record.load.p, 0, (size_t)(m->record.load.n0 * m->record.load.n1 * m->record.load.n2) * sizeof(double));
    root_fill(&m->samples, &m->observer, &m->maps, &m->record, m->counted);
    m->outputs = EVALUATED;
}

/* Instances and modes. */

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) {
    (void)c; (void)on; (void)n; (void)categories;
    return fmi3OK;
}

EXPORT void *fmi3InstantiateModelExchange(
    const char *name, const char *token, const char *path, bool visible, bool logging, void *environment, LogMessage say) {
    (void)name; (void)path; (void)visible; (void)logging;
    if (SIGNALS > 0) {
        if (say) say(environment, fmi3Error, "logStatusError", "a controller that looks back needs the steps of this unit: co-simulation");
        return NULL;
    }
    return made(token, environment, say, true, false);
}

EXPORT void *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *path, bool visible, bool logging, bool events, bool early,
    const uint32_t required[], size_t n, void *environment, LogMessage say, void *update) {
    (void)name; (void)path; (void)visible; (void)logging; (void)events; (void)required; (void)n; (void)update;
    return made(token, environment, say, false, early);
}

EXPORT void *fmi3InstantiateScheduledExecution(
    const char *name, const char *token, const char *path, bool visible, bool logging, void *environment, LogMessage say, void *update,
    void *lock, void *unlock) {
    (void)name; (void)token; (void)path; (void)visible; (void)logging; (void)update; (void)lock; (void)unlock;
    if (say) say(environment, fmi3Error, "logStatusError", "there is no scheduled execution in this unit");
    return NULL;
}

EXPORT void fmi3FreeInstance(void *c) {
    Fmu *m = c;
    if (m == NULL) return;
    free(m->w);
    free(m);
}

EXPORT fmi3Status fmi3EnterInitializationMode(void *c, bool defined, double tolerance, double start, bool stops, double stop) {
    Fmu *m = c;
    (void)stops; (void)stop;
    if (start != 0.0) return failed(m, "the mechanism starts at t = 0 and at no other time");
    if (defined && tolerance > 0.0) {
        Work *w = &m->integration.work;
        double factor = tolerance / TOLERANCE;
        for (int64_t i = 0; i < w->rtol.n0; i++) {
            w->rtol.p[i] *= factor;
            w->atol.p[i] *= factor;
        }
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(void *c) {
    Fmu *m = c;
    double answer[2];
    if (m->fresh) follow(m);
    if (SIGNALS > 0) fill_history(m);
    root_accept(0.0, m->integration.state.y, &m->system, (F1_array){answer, 2});
    m->integration.state.clock.p[0].longest = answer[1];
    forget(m);
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterEventMode(void *c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3EnterStepMode(void *c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3EnterConfigurationMode(void *c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3ExitConfigurationMode(void *c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3Terminate(void *c) { (void)c; return fmi3OK; }

EXPORT fmi3Status fmi3Reset(void *c) {
    Fmu *m = c;
    memset(m->w, 0, WORDS * sizeof(word));
    memset(m->input, 0, sizeof m->input);
    memset(m->external, 0, sizeof m->external);
    m->time = 0.0;
    m->outputs = 0;
    connect(m);
    begin(m);
    return fmi3OK;
}

/* Values. */

EXPORT fmi3Status fmi3GetFloat64(void *c, const uint32_t references[], size_t n, double values[], size_t count) {
    Fmu *m = c;
    (void)count;
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
        if (found == NULL) return failed(m, "a value reference that is no Float64");
        values[k] = factor(references[k]) * *found;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(void *c, const uint32_t references[], size_t n, const double values[], size_t count) {
    Fmu *m = c;
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (references[k] < FIRST_INPUT || references[k] >= FIRST_INPUT + 3 * INPUTS) return failed(m, "a value that is no input");
        m->input[references[k] - FIRST_INPUT] = values[k];
        if (m->external[(references[k] - FIRST_INPUT) / 3]) m->fresh = 1;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetBoolean(void *c, const uint32_t references[], size_t n, bool values[], size_t count) {
    Fmu *m = c;
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (references[k] < FIRST_FLAG || references[k] >= FIRST_FLAG + INPUTS) return failed(m, "a value reference that is no Boolean");
        values[k] = m->external[references[k] - FIRST_FLAG];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetBoolean(void *c, const uint32_t references[], size_t n, const bool values[], size_t count) {
    Fmu *m = c;
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (references[k] < FIRST_FLAG || references[k] >= FIRST_FLAG + INPUTS) return failed(m, "a value reference that is no Boolean");
        m->external[references[k] - FIRST_FLAG] = values[k];
        m->fresh = 1;
    }
    return fmi3OK;
}

#define NONE(NAME, TYPE) \
    EXPORT fmi3Status fmi3Get##NAME(void *c, const uint32_t r[], size_t n, TYPE v[], size_t k) { \
        (void)r; (void)v; (void)k; \
        return n == 0 ? fmi3OK : failed(c, "there are no variables of type " #NAME); \
    } \
    EXPORT fmi3Status fmi3Set##NAME(void *c, const uint32_t r[], size_t n, const TYPE v[], size_t k) { \
        (void)r; (void)v; (void)k; \
        return n == 0 ? fmi3OK : failed(c, "there are no variables of type " #NAME); \
    }

NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(String, char *)

#define ABSENT(NAME, ...) \
    EXPORT fmi3Status NAME(void *c, __VA_ARGS__) { return failed(c, #NAME " is not part of this unit"); }

ABSENT(fmi3GetBinary, const uint32_t r[], size_t n, size_t s[], const uint8_t *v[], size_t k)
ABSENT(fmi3SetBinary, const uint32_t r[], size_t n, const size_t s[], const uint8_t *const v[], size_t k)
ABSENT(fmi3GetClock, const uint32_t r[], size_t n, bool v[])
ABSENT(fmi3SetClock, const uint32_t r[], size_t n, const bool v[])
ABSENT(fmi3GetNumberOfVariableDependencies, uint32_t r, size_t *n)
ABSENT(fmi3GetVariableDependencies, uint32_t r, size_t a[], uint32_t b[], size_t d[], int k[], size_t n)
ABSENT(fmi3GetDirectionalDerivative, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double s[], size_t ns, double v[], size_t nv)
ABSENT(fmi3GetAdjointDerivative, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double s[], size_t ns, double v[], size_t nv)
ABSENT(fmi3GetIntervalDecimal, const uint32_t r[], size_t n, double v[], int q[])
ABSENT(fmi3GetIntervalFraction, const uint32_t r[], size_t n, uint64_t a[], uint64_t b[], int q[])
ABSENT(fmi3GetShiftDecimal, const uint32_t r[], size_t n, double v[])
ABSENT(fmi3GetShiftFraction, const uint32_t r[], size_t n, uint64_t a[], uint64_t b[])
ABSENT(fmi3SetIntervalDecimal, const uint32_t r[], size_t n, const double v[])
ABSENT(fmi3SetIntervalFraction, const uint32_t r[], size_t n, const uint64_t a[], const uint64_t b[])
ABSENT(fmi3SetShiftDecimal, const uint32_t r[], size_t n, const double v[])
ABSENT(fmi3SetShiftFraction, const uint32_t r[], size_t n, const uint64_t a[], const uint64_t b[])
ABSENT(fmi3GetOutputDerivatives, const uint32_t r[], size_t n, const int32_t o[], double v[], size_t k)
ABSENT(fmi3ActivateModelPartition, uint32_t r, double t)

EXPORT fmi3Status fmi3EvaluateDiscreteStates(void *c) { (void)c; return fmi3OK; }

/* The whole state: the numbers of the instance lie in one block. */

typedef struct {
    double time, input[3 * INPUTS + 1];
    bool external[INPUTS + 1];
    int fresh;
    word w[];
} Kept;

EXPORT fmi3Status fmi3GetFMUState(void *c, void **kept) {
    Fmu *m = c;
    Kept *k = *kept ? *kept : malloc(sizeof(Kept) + WORDS * sizeof(word));
    if (k == NULL) return failed(m, "no memory");
    k->time = m->time;
    k->fresh = m->fresh;
    memcpy(k->input, m->input, sizeof k->input);
    memcpy(k->external, m->external, sizeof k->external);
    memcpy(k->w, m->w, WORDS * sizeof(word));
    *kept = k;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(void *c, void *kept) {
    Fmu *m = c;
    Kept *k = kept;
    m->time = k->time;
    m->fresh = k->fresh;
    m->outputs = 0;
    memcpy(m->input, k->input, sizeof k->input);
    memcpy(m->external, k->external, sizeof k->external);
    memcpy(m->w, k->w, WORDS * sizeof(word));
    root_activate(&m->system);
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(void *c, void **kept) {
    (void)c;
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(void *c, void *kept, size_t *size) {
    (void)c; (void)kept;
    *size = sizeof(Kept) + WORDS * sizeof(word);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(void *c, void *kept, uint8_t bytes[], size_t size) {
    if (size < sizeof(Kept) + WORDS * sizeof(word)) return failed(c, "too few bytes for the state");
    memcpy(bytes, kept, sizeof(Kept) + WORDS * sizeof(word));
    return fmi3OK;
}

EXPORT fmi3Status fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **kept) {
    if (size < sizeof(Kept) + WORDS * sizeof(word)) return failed(c, "too few bytes for the state");
    if (*kept == NULL) *kept = malloc(sizeof(Kept) + WORDS * sizeof(word));
    if (*kept == NULL) return failed(c, "no memory");
    memcpy(*kept, bytes, sizeof(Kept) + WORDS * sizeof(word));
    return fmi3OK;
}

/* Events: guards that have come to zero. */

static bool guard_fires(Fmu *m, int64_t k) {
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    double sign = s->mode.p[k] == 0 ? 1.0 : -1.0;
    return sign * w->value.p[k] > -w->precision.p[k] && sign * w->rate.p[k] > 0.0;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(
    void *c, bool *again, bool *terminate, bool *nominals, bool *values, bool *timed, double *next) {
    Fmu *m = c;
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    double data[3], answer[2];
    *again = *terminate = *nominals = *values = *timed = false;
    if (m->fresh) follow(m);
    if (m->exchange) {
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
    }
    return fmi3OK;
}

/* Model exchange. */

EXPORT fmi3Status fmi3EnterContinuousTimeMode(void *c) { (void)c; return fmi3OK; }

EXPORT fmi3Status fmi3CompletedIntegratorStep(void *c, bool final, bool *event, bool *terminate) {
    Fmu *m = c;
    State *s = &m->integration.state;
    Work *w = &m->integration.work;
    double answer[2], *near = m->system.work.near.p;
    (void)final;
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
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(void *c, double time) {
    Fmu *m = c;
    m->time = time;
    m->outputs = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetContinuousStates(void *c, const double states[], size_t n) {
    Fmu *m = c;
    memcpy(m->integration.state.y.p, states, n * sizeof(double));
    m->outputs = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(void *c, double states[], size_t n) {
    Fmu *m = c;
    memcpy(states, m->integration.state.y.p, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(void *c, double rates[], size_t n) {
    Fmu *m = c;
    F1_array slope = m->integration.work.slope;
    if (m->fresh) follow(m);
    root_rate(m->time, m->integration.state.y, &m->system, slope);
    for (size_t i = 0; i < n; i++) {
        rates[i] = slope.p[i];
        if (!isfinite(rates[i])) return fmi3Discard;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetEventIndicators(void *c, double indicators[], size_t n) {
    Fmu *m = c;
    if (n == 0) return fmi3OK;
    if (m->fresh) follow(m);
    root_guards(m->time, m->integration.state.y, &m->system, m->integration.work.value, m->integration.work.rate);
    memcpy(indicators, m->integration.work.value.p, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(void *c, double nominals[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) nominals[i] = NOMINAL[i];
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(void *c, size_t *n) { (void)c; *n = GUARDS; return fmi3OK; }
EXPORT fmi3Status fmi3GetNumberOfContinuousStates(void *c, size_t *n) { (void)c; *n = STATES; return fmi3OK; }

/* Co-simulation: the package's own loop. */

EXPORT fmi3Status fmi3DoStep(
    void *c, double from, double size, bool final, bool *event, bool *terminate, bool *early, double *reached) {
    Fmu *m = c;
    (void)final;
    *event = *terminate = *early = false;
    if (m->fresh) follow(m);
    State *s = &m->integration.state;
    s->clock.p[0].end = from + size;
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
            return failed(m, status == STEP_TOO_SMALL ? "the step size fell to round-off"
                             : status == NOT_FINITE   ? "a law or a position became infinite or not a number"
                             : status == HISTORY_FULL ? "a controller looks back over more steps than there is room for"
                                                      : "contacts and separations followed each other without any progress in time");
        } else if (m->early && s->counts.p[0].events > before) {
            *early = true;
            m->outputs = 0;
            return fmi3OK;
        }
    }
    return failed(m, "too many steps");
}
