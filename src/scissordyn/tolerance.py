"""Tolerances and limits that several subpackages share; tolerances are relative."""

# [-] Round-off of a few operations, for example the last correction of a converged iteration.
CONVERGENCE_TOL = 1e-14

# [-] Largest residual of a satisfied constraint relative to its length, and largest change of a converged multiplier.
CONSTRAINT_TOL = 1e-13

# [-] Accumulated round-off of a solution, an assembly or a long sum; smaller differences and values are treated as zero.
ROUND_OFF_TOL = 1e-12

# [mechanism sizes, rad, largest forces] Error of an assembled position and its forces; closer points are treated as equal.
ASSEMBLY_TOL = 1e-9

# [-] Error of the instant of an event as a fraction of a step, and of speed or force there as a fraction of the largest.
EVENT_TOL = 1e-9

# [-] Error of numbers that a user or another program has rounded to at least six digits.
DATA_TOL = 1e-6

# [steps] Largest number of steps of an iteration; a few are usual, and bisection needs fifty.
NEWTON_STEPS_MAX = 60

# [-] Step of a finite difference, as a fraction of the size of the varied parameter.
DIFFERENCE_FRACTION = 1e-5

# [-] Short fraction of a step or time interval: size of a first step, and largest rest that is not a separate step.
SHORT_STEP_FRACTION = 1e-3

# [-] Smallest singular value of the unit gradients of constraints away from a singular position.
SINGULAR_VALUE_MIN = 1e-3

# [-] Smallest fraction of a size or value that reports and warnings mention.
REPORTED_FRACTION = 1e-3

CONFIDENCE_LEVEL = 0.95  # [-] probability that a confidence interval contains the value

STANDARD_ERRORS_MAX = 2.0  # [standard errors] two estimates with a smaller difference are treated as equal
