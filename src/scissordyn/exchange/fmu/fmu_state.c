/* The complete state of an instance: its numbers lie in one block. */

typedef struct {
    uint64_t digest; /* of the unit and of all that follows; set in a state that is written as bytes */
    double time, stop, earliest, completed, input[3 * INPUTS + 1];
    int64_t mode, fresh;
    bool exchange, external[INPUTS + 1];
    word w[];
} Kept;

enum { KEPT_BYTES = sizeof(Kept) + WORDS * sizeof(word) };

static uint64_t digest(const Kept *kept) { /* FNV-1a */
    const uint8_t *bytes = (const uint8_t *)kept;
    uint64_t sum = 0xcbf29ce484222325u;
    for (const char *letter = TOKEN; *letter; letter++) sum = (sum ^ (uint8_t)*letter) * 0x100000001b3u;
    for (size_t k = sizeof kept->digest; k < KEPT_BYTES; k++) sum = (sum ^ bytes[k]) * 0x100000001b3u;
    return sum;
}

EXPORT fmi3Status fmi3GetFMUState(void *c, void **kept) {
    Fmu *m = c;
    if (!is_allowed(m, "fmi3GetFMUState", ANY)) return fmi3Error;
    if (kept == NULL) return null_pointer(m, "fmi3GetFMUState");
    Kept *k = *kept ? *kept : calloc(1, KEPT_BYTES); /* gaps between members are zero, too */
    if (k == NULL) return fail(m, "no memory");
    k->time = m->time;
    k->stop = m->stop;
    k->earliest = m->earliest;
    k->completed = m->completed;
    k->mode = m->mode;
    k->fresh = m->fresh;
    k->exchange = m->exchange;
    memcpy(k->input, m->input, sizeof k->input);
    memcpy(k->external, m->external, sizeof k->external);
    memcpy(k->w, m->w, WORDS * sizeof(word));
    *kept = k;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(void *c, void *kept) {
    Fmu *m = c;
    Kept *k = kept;
    if (!is_allowed(m, "fmi3SetFMUState", ANY)) return fmi3Error;
    if (k == NULL) return null_pointer(m, "fmi3SetFMUState");
    if (k->exchange != m->exchange) return fail(m, "fmi3SetFMUState: a state of co-simulation is none of model exchange");
    m->time = k->time;
    m->stop = k->stop;
    m->earliest = k->earliest;
    m->completed = k->completed;
    m->mode = (int)k->mode;
    m->fresh = (int)k->fresh;
    m->outputs = 0;
    memcpy(m->input, k->input, sizeof k->input);
    memcpy(m->external, k->external, sizeof k->external);
    memcpy(m->w, k->w, WORDS * sizeof(word));
    root_activate(&m->system);
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(void *c, void **kept) {
    if (!is_allowed(c, "fmi3FreeFMUState", ANY)) return fmi3Error;
    if (kept != NULL) {
        free(*kept);
        *kept = NULL;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(void *c, void *kept, size_t *size) {
    if (!is_allowed(c, "fmi3SerializedFMUStateSize", ANY)) return fmi3Error;
    if (kept == NULL || size == NULL) return null_pointer(c, "fmi3SerializedFMUStateSize");
    *size = KEPT_BYTES;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(void *c, void *kept, uint8_t bytes[], size_t size) {
    if (!is_allowed(c, "fmi3SerializeFMUState", ANY)) return fmi3Error;
    if (kept == NULL || bytes == NULL) return null_pointer(c, "fmi3SerializeFMUState");
    if (size != KEPT_BYTES) return fail(c, "a state has %lu bytes, not %lu", (unsigned long)KEPT_BYTES, (unsigned long)size);
    uint64_t sum = digest(kept);
    memcpy(bytes, kept, KEPT_BYTES);
    memcpy(bytes, &sum, sizeof sum);
    return fmi3OK;
}

EXPORT fmi3Status fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **kept) {
    if (!is_allowed(c, "fmi3DeserializeFMUState", ANY)) return fmi3Error;
    if (bytes == NULL || kept == NULL) return null_pointer(c, "fmi3DeserializeFMUState");
    if (size != KEPT_BYTES) return fail(c, "a state has %lu bytes, not %lu", (unsigned long)KEPT_BYTES, (unsigned long)size);
    Kept *k = calloc(1, KEPT_BYTES);
    if (k == NULL) return fail(c, "no memory");
    memcpy(k, bytes, KEPT_BYTES);
    if (k->digest != digest(k)) {
        free(k);
        return fail(c, "fmi3DeserializeFMUState: the bytes are damaged, or of another unit");
    }
    free(*kept);
    *kept = k;
    return fmi3OK;
}
