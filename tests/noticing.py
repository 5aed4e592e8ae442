"""Tables of `mutate`: subpackages in which changes are drawn, tests that must notice them, and changes without effect."""

from fnmatch import fnmatch

__all__ = ["DRAWN_CHANGES", "EQUIVALENT", "NAMED", "SAME_ANSWER", "SEED", "UNNOTICED_MAX", "tests_of"]

SEED = 22  # Seed with which changes are drawn

DRAWN_CHANGES = {"integrate": 16, "mechanics": 16, "components/port": 6, "kinematics": 11, "run": 11}
"""Number of changes that are drawn in each subpackage."""

UNNOTICED_MAX = 3  # Largest number of drawn changes that no test notices

NAMED = (
    ("mechanics/guard.py", "lock", "plus", "lost += 0.5 * W.A[i] * W.A[i]"),
    ("mechanics/guard.py", "impulsive_work", "plus", "total -= W.work[M.timed[i]] * W.value[1, M.timed[i]]"),
    ("plan/bodies.py", "_unknowns", "sign", "-x"),
    ("plan/quadratic_constraints.py", "_moving_guides", "plus", "across[0] * guide.through[0] + across[1] * guide.through[1]"),
    ("components/port/frame.py", "curvature", "plus", "K[2, 3] -= torque"),
    ("components/port/line.py", "gradients", "plus", "vx - along * nx"),
    ("integrate/event.py", "all_far", "bound", "max(abs(w.left_rate[k]), abs(w.end_rate[k]))"),
    ("integrate/event.py", "may_rise", "dropped", "cubic(place, a, slope_a, b, slope_b)[0] + bump"),
)
"""Changes that a test must notice, because no test noticed them once: file, function, kind and expression."""

EQUIVALENT: dict[tuple[str | int, ...], str] = {
    ("components/force.py", "parameters", "float(self.follows)"): "a switch",
    ("components/beam.py", "force", "damping"): "its sign",
    ("components/beam.py", "force", "strength"): "its sign",
    **dict.fromkeys(
        (("components/tape_spring.py", "_work", end, *which) for end in ("start", "end") for which in ((), (1,), (3,))),
        "which angles of the table lie between, of which one at an end has no area; and which end is larger",
    ),
    ("laws/elastic/quadrature.py", "quadrature_energy", "1.0"): "only in the tolerance",
    ("laws/damping/exact.py", "", "700.0"): "end of a bracket far beyond the root",
    ("laws/damping/exact.py", "", "0.1"): "where a series takes over that agrees to rounding",
    ("laws/damping/none.py", "parameters", "self.factor"): "zero",
    ("laws/friction/bristle.py", "", "1000000.0"): "constant damping to rounding, either way",
    ("laws/friction/dahl.py", "force", "shape"): "shortcut for n = 1",
    ("laws/friction/dahl.py", "force", "1.0", 2): "shortcut for n = 1",
    ("laws/friction/stribeck.py", "sliding_coefficient", "stribeck_exponent"): "shortcut for gamma = 2",
    ("laws/friction/stribeck.py", "sliding_coefficient", "2.0"): "shortcut for gamma = 2",
}
"""Reasons why a changed number changes no result beyond round-off, by file, function, number and count of its occurrence."""

# Test files of the integrator
INTEGRATE = ("integrate/test_event.py", "integrate/test_monitored_rows.py", "integrate/test_advance.py")
# Test files of the equations of motion
MECHANICS = (
    "mechanics/test_linearisation.py",
    "mechanics/test_plane_contact.py",
    "mechanics/test_impulses.py",
    "mechanics/test_elements.py",
)
# Test files of hard contacts
HARD = ("run/test_hard_contact.py", "run/test_hard_answers.py", "run/test_hard_examples.py", "run/test_hard_turning.py")
# Reason why a change of the grouping of cases changes no result
GROUPED = "how many cases are done together: no number depends on it"
# Reason why a change in the search for a maximum changes no result
BRENT = "which points Brent's parabola goes through: another way to the same maximum"

# Test files of kinematics
KINEMATICS = (
    *("kinematics/test_closure.py", "run/test_singular.py", "run/test_closed_limits.py"),
    *("test_linkages.py", "validation/test_singular_positions.py"),
)

NOTICING: dict[str, tuple[str, ...]] = {
    "integrate/dormand_prince.py": ("integrate/test_tableau.py",),
    "integrate/rodas.py": ("integrate/test_tableau.py",),
    "integrate/tableau.py": ("integrate/test_tableau.py",),
    "integrate/history.py": ("integrate/test_history.py",),
    "integrate/monitor.py": ("integrate/test_monitored_rows.py",),
    "integrate/event.py": ("integrate/test_event.py",),
    "integrate/control.py": ("integrate/test_control.py", *INTEGRATE),
    "integrate/crossing.py": ("integrate/test_crossing.py", *INTEGRATE),
    "integrate/dense.py": ("integrate/test_dense.py", *INTEGRATE),
    "integrate/step.py": ("integrate/test_step.py", *INTEGRATE),
    "integrate/time_stepping.py": ("integrate/test_time_stepping.py", *HARD, "run/test_fixed_steps.py", "run/test_cut.py"),
    "integrate/*": (*INTEGRATE, "test_run.py"),
    "components/port/*": ("mechanics/test_ports.py", "components/test_symbols.py"),
    "mechanics/band.py": ("mechanics/test_band.py", *MECHANICS),
    "plan/elimination.py": ("mechanics/test_elimination.py",),
    "mechanics/monitored.py": ("mechanics/test_track_deviation.py", "mechanics/test_entries_read.py", *MECHANICS),
    "mechanics/reactions.py": ("mechanics/test_reactions.py", *MECHANICS),
    "mechanics/time_function.py": ("mechanics/test_time_functions.py", *MECHANICS),
    "mechanics/reaction_slopes.py": (
        "mechanics/test_reaction_slopes.py",
        "test_reference.py",
        "test_transmissions.py",
        "run/test_statics.py",
    ),
    "mechanics/hard_*": (*HARD, "test_clearance_guide.py"),
    "mechanics/impulse_solver.py": ("mechanics/test_impulse_solver.py", *HARD, "test_clearance_guide.py"),
    "mechanics/pivoting.py": HARD,
    "mechanics/compliant_contact.py": (*HARD, "run/test_fixed_steps.py"),
    "mechanics/flexible_bar*": ("test_heated_bars.py", "test_rollers.py", "test_bending.py", "test_modes.py"),
    "mechanics/body_maps.py": ("mechanics/test_reactions.py", "test_run.py"),
    "mechanics/guard.py": ("mechanics/test_impulses.py", *MECHANICS),
    "mechanics/constraint_solver.py": ("run/test_singular.py", "validation/test_change_points.py", "test_run.py", *MECHANICS),
    "mechanics/*": ("test_run.py", *MECHANICS),
    "kinematics/bending.py": ("test_kinked_bars.py", *KINEMATICS),
    "kinematics/path.py": ("kinematics/test_path.py", *KINEMATICS),
    "kinematics/*": KINEMATICS,
    "plan/*": ("mechanics/test_moving_guides.py",),
    "run/ideal.py": ("plot/test_preview.py", "run/test_closed_limits.py", "kinematics/test_path.py"),
    "run/engine.py": ("studies/test_engine.py",),
    "run/inverse_dynamics.py": ("run/test_rest.py", "mechanics/test_connections.py", "plan/test_shared_plan.py"),
    "record/warn.py": ("run/test_warn.py",),
    "run/ideal_path.py": ("run/test_track.py",),
    "equilibrium/start.py": ("run/test_rest.py", "run/test_warn.py", "mechanics/test_connections.py", "test_run.py"),
    "run/predictability.py": ("run/test_predictability.py",),
    "run/simulate.py": ("run/test_checkpoint.py", "test_run.py"),
    "run/batch.py": ("run/test_batch.py", "studies/test_part_unit.py"),
    "run/rows.py": ("run/test_batch.py", "studies/test_study.py"),
    "run/bristle_recoil.py": ("run/test_bristle_recoil.py",),
    "run/measure.py": ("run/test_batch.py", "kinematics/test_path.py"),
    "run/trajectory_warnings.py": ("components/test_state.py", "run/test_warn.py", *HARD),
    "run/method.py": ("run/test_method.py", "run/test_fixed_steps.py", "run/test_cut.py", "test_run.py"),
    "run/deviation.py": ("run/test_track.py", "mechanics/test_track_deviation.py", "test_run.py"),
    "run/advance/tolerance.py": ("components/test_state.py", "run/test_warn.py"),
    "run/*": ("test_run.py",),
}
"""Test files that must notice a change, in the order in which they run, by pattern of the changed file."""

SAME_ANSWER: dict[tuple[str, str, str, str], str] = {
    ("integrate/monitor.py", "refine_peak", "both", "height >= third_value or third in (best, second)"): BRENT,
    ("integrate/monitor.py", "refine_peak", "both", "height >= second_value or second == best"): BRENT,
    ("integrate/monitor.py", "refine_peak", "factor", "q * (low - best)"): BRENT,
    (
        *("mechanics/hard_rows.py", "assemble", "both"),
        "H.work.damping[c] == 1 and h > 0.0",
    ): "the row of damping that does not act has no right side, and none acts in an impact",
    (
        *("run/rows.py", "_group_size", "bound"),
        "min(GROUP_CASES_MAX, int(CALL_SECONDS / seconds), cases // (8 * threads))",
    ): GROUPED,
    (
        *("run/rows.py", "_together", "bound"),
        "min(int(sum((driver.steps_tried for driver in drivers)) * CALL_SECONDS / max(seconds, 1e-09)), SLICE_STEPS_MAX)",
    ): GROUPED,
    (
        *("integrate/control.py", "after_event", "bound"),
        "min(full, remembered)",
    ): "how long the first try after an event is; its error decides which step is taken",
    ("run/rows.py", "_group_size", "factor", "CALL_SECONDS / seconds"): GROUPED,
    (
        *("run/rows.py", "_together", "factor"),
        "sum((driver.steps_tried for driver in drivers)) * CALL_SECONDS / max(seconds, 1e-09)",
    ): GROUPED,
    ("run/trajectory.py", "_advance", "dropped", "clocks.perf_counter() - began"): "the computing time, which no test compares",
    (
        "processor.py",
        "processors",
        "both",
        "os.cpu_count() or 1",
    ): "not reached where the system tells the processors of a process",
    ("run/engine.py", "_compute_on", "dropped", "time.monotonic() + RECOUNT_SECONDS"): "how often the workers are counted",
    (
        *("run/ideal.py", "motion_range", "bound"),
        "min((place for place in locks if place > first), default=math.nan)",
    ): "a path ends where it locks: there is one on each side at most",
    (
        *("kinematics/branching.py", "_closed_along", "edge"),
        "np.max(np.abs(closed[:time.size] - z)) > 0.1",
    ): "a distance that is this bound to the last bit",
    (
        *("kinematics/unfolding.py", "at", "edge"),
        "np.max(np.abs(change[:n])) < SEARCH_DISTANCE_MAX",
    ): "a distance that is this bound to the last bit",
    (
        *("kinematics/continuation.py", "_extend_to", "edge"),
        "sign * limit.slope[1] * limit.curvature[0, 0] > 0.0",
    ): "a slope that is zero to the last bit, which is a change point and no limit",
}
"""Reasons why no test can notice a change, by file, function, kind and expression."""


def of_runs(test: str) -> bool:
    """Return whether tests make runs, which take too long with kernels in plain Python."""
    return test.startswith(("run/", "test_", "validation/"))


def tests_of(file: str) -> tuple[str, ...]:
    """Return the test files that have to notice a change of a file."""
    return next(tests for pattern, tests in NOTICING.items() if fnmatch(file, pattern))
