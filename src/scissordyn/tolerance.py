"""Base tolerances that several rooms share; all are relative. A limit of one room alone is in that room."""

# [-] Rounding of a few operations: the last correction of a converged iteration, the error of a direct formula.
CONVERGENCE_TOL = 1e-14

# [-] Residual of a constraint that holds, relative to its length, and change of a multiplier that has converged.
CONSTRAINT_TOL = 1e-13

# [-] Accumulated rounding of a solution, an assembly or a long sum: smaller differences are none, smaller values are zero.
ROUND_OFF_TOL = 1e-12

# [mechanism sizes, rad] Error of an assembled position: points and directions that are closer are the same.
ASSEMBLY_TOL = 1e-9

# [-] Error of the instant of an event, of a speed or of a force there, as a fraction of a step or of the largest value.
EVENT_TOL = 1e-9

# [-] Error of numbers that a user or another program has rounded to six or more digits.
DATA_TOL = 1e-6

NEWTON_STEPS_MAX = 50  # [steps] an iteration that has not converged by then has failed; a few are usual
