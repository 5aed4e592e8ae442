/* Types of variables and functions that this unit does not have. An importer may ask for none of them. */

#define ABSENT(NAME, EMPTY, ...) \
    EXPORT fmi3Status NAME(void *c, __VA_ARGS__) { \
        if (!is_allowed(c, #NAME, ANY)) return fmi3Error; \
        return (EMPTY) ? fmi3OK : fail(c, #NAME ": this unit does not have it"); \
    }
#define NONE(TYPE, VALUE) \
    ABSENT(fmi3Get##TYPE, n == 0, const uint32_t r[], size_t n, VALUE v[], size_t k) \
    ABSENT(fmi3Set##TYPE, n == 0, const uint32_t r[], size_t n, const VALUE v[], size_t k)

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
ABSENT(fmi3GetBinary, n == 0, const uint32_t r[], size_t n, size_t s[], const uint8_t *v[], size_t k)
ABSENT(fmi3SetBinary, n == 0, const uint32_t r[], size_t n, const size_t s[], const uint8_t *const v[], size_t k)
ABSENT(fmi3GetClock, n == 0, const uint32_t r[], size_t n, bool v[])
ABSENT(fmi3SetClock, n == 0, const uint32_t r[], size_t n, const bool v[])
ABSENT(fmi3GetIntervalDecimal, n == 0, const uint32_t r[], size_t n, double v[], int q[])
ABSENT(fmi3GetIntervalFraction, n == 0, const uint32_t r[], size_t n, uint64_t a[], uint64_t b[], int q[])
ABSENT(fmi3GetShiftDecimal, n == 0, const uint32_t r[], size_t n, double v[])
ABSENT(fmi3GetShiftFraction, n == 0, const uint32_t r[], size_t n, uint64_t a[], uint64_t b[])
ABSENT(fmi3SetIntervalDecimal, n == 0, const uint32_t r[], size_t n, const double v[])
ABSENT(fmi3SetIntervalFraction, n == 0, const uint32_t r[], size_t n, const uint64_t a[], const uint64_t b[])
ABSENT(fmi3SetShiftDecimal, n == 0, const uint32_t r[], size_t n, const double v[])
ABSENT(fmi3SetShiftFraction, n == 0, const uint32_t r[], size_t n, const uint64_t a[], const uint64_t b[])
ABSENT(fmi3GetOutputDerivatives, n == 0, const uint32_t r[], size_t n, const int32_t o[], double v[], size_t k)
ABSENT(fmi3GetNumberOfVariableDependencies, false, uint32_t r, size_t *n)
ABSENT(fmi3GetVariableDependencies, false, uint32_t r, size_t a[], uint32_t b[], size_t d[], int k[], size_t n)
ABSENT(fmi3GetDirectionalDerivative, false, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double s[], size_t ns, double v[],
       size_t nv)
ABSENT(fmi3GetAdjointDerivative, false, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double s[], size_t ns, double v[],
       size_t nv)
ABSENT(fmi3ActivateModelPartition, false, uint32_t r, double t)

EXPORT fmi3Status fmi3EnterConfigurationMode(void *c) {
    if (!is_allowed(c, "fmi3EnterConfigurationMode", ANY)) return fmi3Error;
    return fail(c, "fmi3EnterConfigurationMode: this unit has no structural parameters");
}

EXPORT fmi3Status fmi3ExitConfigurationMode(void *c) {
    if (!is_allowed(c, "fmi3ExitConfigurationMode", ANY)) return fmi3Error;
    return fail(c, "fmi3ExitConfigurationMode: this unit has no structural parameters");
}

EXPORT fmi3Status fmi3EvaluateDiscreteStates(void *c) {
    if (!is_allowed(c, "fmi3EvaluateDiscreteStates", ANY)) return fmi3Error;
    return fail(c, "fmi3EvaluateDiscreteStates: providesEvaluateDiscreteStates is false");
}
