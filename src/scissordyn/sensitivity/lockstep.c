
/* Advance a run in doubles by single steps, and repeat each of them in dual numbers; return the status of either. */

typedef void (*advance_pointer)(int64_t *, int64_t, int64_t *, int64_t, int64_t *, int64_t, int64_t *, int64_t, int64_t, int64_t *, int64_t);
typedef int64_t (*follow_pointer)(int64_t, int64_t, int64_t, dual *, int64_t);

EXPORT int64_t lockstep(advance_pointer advance, follow_pointer follow, int64_t *run, int64_t watched, int64_t integration, int64_t system, dual *seed, int64_t most) {
    int64_t status = 0, followed = 0;
    for (; most > 0 && status == 0; most--) {
        advance(run, 1, run + 1, 1, run + 2, 1, run + 3, 1, 1, &status, 1);
        followed = follow(watched, integration, system, seed, 1);
        if (followed != 0) return -followed;
    }
    return status;
}
