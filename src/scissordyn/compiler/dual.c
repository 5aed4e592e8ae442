/* Dual numbers: a value, and its derivatives by DERIVATIVES parameters. Values are those of double arithmetic, bit for bit.

   The derivatives lie in vectors of PACKED doubles, the widest of the processor that divide the even number DERIVATIVES. They
   come first: compilers copy a struct from its start in the widest registers, and the processor waits for a number that is
   read in other pieces than it was written. */

#if defined(__AVX__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__) && DERIVATIVES % 8 == 0
#define PACKED 8
#elif defined(__AVX__) && DERIVATIVES % 4 == 0
#define PACKED 4
#else
#define PACKED 2
#endif

typedef double pack __attribute__((vector_size(8 * PACKED), aligned(8)));
typedef int64_t mask __attribute__((vector_size(8 * PACKED), aligned(8)));

#define PACKS (DERIVATIVES / PACKED)

typedef struct { pack d[PACKS]; double v; } dual;

/* a b + c for derivatives, rounded once where the processor can; values are never contracted */
static inline pack fused(pack a, double b, pack c) {
#if PACKED == 8
    return (pack)_mm512_fmadd_pd((__m512d)a, _mm512_set1_pd(b), (__m512d)c);
#elif PACKED == 4 && defined(__FMA__)
    return (pack)_mm256_fmadd_pd((__m256d)a, _mm256_set1_pd(b), (__m256d)c);
#else
    return a * b + c;
#endif
}

/* y(a, b), with the slope of each pack k; a part that does not change contributes nothing, even if its slope is infinite */
#define OPERATION(name, first, second, value, slope) \
    static inline dual name(first a, second b) { \
        dual y; \
        y.v = value; \
        for (int k = 0; k < PACKS; k++) y.d[k] = slope; \
        return y; \
    }
#define PART(slope, change) ((pack)((mask)((slope) * (change)) & ((change) != 0.0)))
#define FUNCTION(name, slope) \
    static inline dual name##_dual(dual a) { \
        dual y; \
        double x = a.v, f = name(x), s = slope; \
        y.v = f; \
        for (int k = 0; k < PACKS; k++) y.d[k] = PART(s, a.d[k]); \
        (void)x; \
        return y; \
    }
#define FUNCTION_OF_TWO(name, by_first, by_second) \
    static inline dual name##_dual(dual a, dual b) { \
        dual y; \
        double x = a.v, z = b.v, f = name(x, z), s = by_first, r = by_second; \
        y.v = f; \
        for (int k = 0; k < PACKS; k++) y.d[k] = PART(s, a.d[k]) + PART(r, b.d[k]); \
        return y; \
    }
#define CHOICE(name, second) \
    static inline dual name##_dual(dual a, dual b) { return second ? b : a; }

static inline dual as_dual(double x) {
    dual y;
    y.v = x;
    for (int k = 0; k < PACKS; k++) y.d[k] = (pack){0.0};
    return y;
}

/* Whether a pack has a number other than zero */
static inline int changes(pack d) {
#if PACKED == 8
    return _mm512_cmp_pd_mask((__m512d)d, _mm512_setzero_pd(), _CMP_NEQ_UQ) != 0;
#elif PACKED == 4
    return _mm256_movemask_pd(_mm256_cmp_pd((__m256d)d, _mm256_setzero_pd(), _CMP_NEQ_UQ)) != 0;
#else
    return d[0] != 0.0 || d[1] != 0.0;
#endif
}

static inline int equals(dual a, double value) {
    if (a.v != value) return 0;
    for (int k = 0; k < PACKS; k++)
        if (changes(a.d[k])) return 0;
    return 1;
}

static inline dual negative_dual(dual a) {
    a.v = -a.v;
    for (int k = 0; k < PACKS; k++) a.d[k] = -a.d[k];
    return a;
}

OPERATION(add_dd, dual, dual, a.v + b.v, a.d[k] + b.d[k])
OPERATION(add_df, dual, double, a.v + b, a.d[k])
OPERATION(add_fd, double, dual, a + b.v, b.d[k])
OPERATION(subtract_dd, dual, dual, a.v - b.v, a.d[k] - b.d[k])
OPERATION(subtract_df, dual, double, a.v - b, a.d[k])
OPERATION(subtract_fd, double, dual, a - b.v, -b.d[k])
OPERATION(multiply_dd, dual, dual, a.v * b.v, fused(a.d[k], b.v, a.v * b.d[k]))
OPERATION(multiply_df, dual, double, a.v * b, a.d[k] * b)
OPERATION(multiply_fd, double, dual, a * b.v, a * b.d[k])
OPERATION(divide_dd, dual, dual, a.v / b.v, fused(b.d[k], -y.v, a.d[k]) * (1.0 / b.v))
OPERATION(divide_df, dual, double, a.v / b, a.d[k] * (1.0 / b))
OPERATION(divide_fd, double, dual, a / b.v, (-y.v / b.v) * b.d[k])
OPERATION(floor_division_dual, dual, dual, floor_division_floats(a.v, b.v), (pack){0.0})
OPERATION(remainder_dual, dual, dual, remainder_floats(a.v, b.v), a.d[k] - floor_division_floats(a.v, b.v) * b.d[k])

static inline dual whole_power_dual(dual a, int64_t n) {
    dual y;
    double slope = n == 0 ? 0.0 : (double)n * whole_power(a.v, n - 1);
    y.v = whole_power(a.v, n);
    for (int k = 0; k < PACKS; k++) y.d[k] = slope * a.d[k];
    return y;
}

CHOICE(least_float, b.v < a.v)
CHOICE(largest_float, b.v > a.v)
CHOICE(least_number, !(a.v < b.v || a.v != a.v))
CHOICE(largest_number, !(a.v > b.v || a.v != a.v))
CHOICE(fmin, b.v < a.v || a.v != a.v)
CHOICE(fmax, b.v > a.v || a.v != a.v)

FUNCTION(fabs, sign(x))
FUNCTION(sign, 0.0)
FUNCTION(floor, 0.0)
FUNCTION(ceil, 0.0)
FUNCTION(trunc, 0.0)
FUNCTION(sqrt, 0.5 / f)
FUNCTION(cbrt, 1.0 / (3.0 * f * f))
FUNCTION(cos, -sin(x))
FUNCTION(sin, cos(x))
FUNCTION(tan, 1.0 + f * f)
FUNCTION(acos, -1.0 / sqrt((1.0 - x) * (1.0 + x)))
FUNCTION(asin, 1.0 / sqrt((1.0 - x) * (1.0 + x)))
FUNCTION(atan, 1.0 / (1.0 + x * x))
FUNCTION(cosh, sinh(x))
FUNCTION(sinh, cosh(x))
FUNCTION(tanh, 1.0 / (cosh(x) * cosh(x)))
FUNCTION(acosh, 1.0 / sqrt((x - 1.0) * (x + 1.0)))
FUNCTION(asinh, 1.0 / sqrt(1.0 + x * x))
FUNCTION(atanh, 1.0 / ((1.0 - x) * (1.0 + x)))
FUNCTION(exp, f)
FUNCTION(exp2, f * 0.6931471805599453)
FUNCTION(expm1, exp(x))
FUNCTION(log, 1.0 / x)
FUNCTION(log2, 1.4426950408889634 / x)
FUNCTION(log10, 0.4342944819032518 / x)
FUNCTION(log1p, 1.0 / (1.0 + x))
FUNCTION(erf, 1.1283791670955126 * exp(-x * x))
FUNCTION(erfc, -1.1283791670955126 * exp(-x * x))
FUNCTION(degrees, 180.0 / 3.141592653589793)
FUNCTION(radians, 3.141592653589793 / 180.0)
FUNCTION_OF_TWO(pow, z == 0.0 ? 0.0 : z * pow(x, z - 1.0), f == 0.0 ? 0.0 : f * log(x))
FUNCTION_OF_TWO(atan2, z / (x * x + z * z), -x / (x * x + z * z))
FUNCTION_OF_TWO(hypot, x / f, z / f)
FUNCTION_OF_TWO(fmod, 1.0, -trunc(x / z))
FUNCTION_OF_TWO(copysign, f == x ? 1.0 : -1.0, 0.0)
