"""Base tolerances and limits that several rooms share; tolerances are relative. A limit of one room alone is in that room."""

# [-] Rounding of a few operations: the last correction of a converged iteration, the error of a direct formula.
CONVERGENCE_TOL = 1e-14

# [-] Residual of a constraint that holds, relative to its length, and change of a multiplier that has converged.
CONSTRAINT_TOL = 1e-13

# [-] Accumulated rounding of a solution, an assembly or a long sum: smaller differences are none, smaller values are zero.
ROUND_OFF_TOL = 1e-12

# [mechanism sizes, rad, largest forces] Error of an assembled position and of forces there: closer points are the same.
ASSEMBLY_TOL = 1e-9

# [-] Error of the instant of an event, of a speed or of a force there, as a fraction of a step or of the largest value.
EVENT_TOL = 1e-9

# [-] Error of numbers that a user or another program has rounded to six or more digits.
DATA_TOL = 1e-6

# [steps] An iteration that has not converged by then has failed; a few are usual, and bisection alone needs fifty.
NEWTON_STEPS_MAX = 60

# [-] Step of a numerical derivative, as a fraction of the size of what is varied.
DIFFERENCE_FRACTION = 1e-5

# [-] Short part of a step or of an interval of time: a first step without a known size, a rest that is not worth a step.
SHORT_STEP_FRACTION = 1e-3

# [-] Smallest singular value of independent unit gradients; a mechanism with a smaller one is near a singular position.
SINGULAR_VALUE_MIN = 1e-3

# [-] Smallest share of a size or of a value that is worth a line in a report or a warning.
REPORTED_FRACTION = 1e-3

CONFIDENCE_LEVEL = 0.95  # [-] probability that an interval contains the value

STANDARD_ERRORS_MAX = 2.0  # [standard errors] largest difference of two estimates that count as equal
