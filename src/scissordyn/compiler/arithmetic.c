/* Arithmetic of Python that C does not have: quotients towards minus infinity, the first of two equal numbers. */

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* Versions of a function for processors with and without wide vectors; the loader chooses one. Neither contracts products and
   sums, so that both give the same bits. GCC vectorizes loops over arrays that could overlap only with -O3, which makes loops
   that are written for whole vectors slower. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define VECTORIZED __attribute__((target_clones("avx2", "default")))
#define VECTORIZED_LOOPS __attribute__((target_clones("avx2", "default"), optimize("O3")))
#else
#define VECTORIZED
#define VECTORIZED_LOOPS
#endif

static double whole_power(double x, int64_t n) {
    double result = 1.0;
    for (; n > 0; n >>= 1) {
        if (n & 1) result *= x;
        x *= x;
    }
    return result;
}

static int64_t floor_division_whole(int64_t a, int64_t b) {
    int64_t quotient = a / b;
    return a % b != 0 && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

static int64_t remainder_whole(int64_t a, int64_t b) {
    int64_t rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

static double remainder_floats(double a, double b) {
    double rest = fmod(a, b);
    return rest != 0.0 && (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}

static double floor_division_floats(double a, double b) {
    double quotient = (a - remainder_floats(a, b)) / b, whole = floor(quotient);
    return quotient - whole > 0.5 ? whole + 1.0 : whole;
}

static int64_t whole_size(int64_t a) { return a < 0 ? -a : a; }
static double least_float(double a, double b) { return b < a ? b : a; }
static double largest_float(double a, double b) { return b > a ? b : a; }
static int64_t least_whole(int64_t a, int64_t b) { return b < a ? b : a; }
static int64_t largest_whole(int64_t a, int64_t b) { return b > a ? b : a; }
static double sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x; }
static double degrees(double x) { return x * (180.0 / 3.141592653589793); }
static double radians(double x) { return x * (3.141592653589793 / 180.0); }

/* a NaN stays one, as in numpy */
static double least_number(double a, double b) { return a < b || a != a ? a : b; }
static double largest_number(double a, double b) { return a > b || a != a ? a : b; }
