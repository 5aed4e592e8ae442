"""Steps across the rises and falls of guards: the same motion and the same events as with steps that end on them."""

import math

import numpy as np
import pytest
from motions import COMPLIANT, OSCILLATOR, solve_problem

from scissordyn.integrate.advance import FINISHED


def impact(name, crosses, tolerance, **options):
    """Return the run of impacts on a linear floor under gravity."""
    return solve_problem(
        *(name, COMPLIANT, (1e-2, 0.0), 0.5),
        parameters=(4e3, 1.0, 9.81),
        levels=(0.0,),
        senses=(-1.0,),
        crosses=crosses,
        rtol=tolerance,
        atol=tolerance,
        **options,
    )


@pytest.mark.parametrize("crosses", [False, True])
def test_impacts_on_a_linear_floor(name, crosses):
    """Closed form: d'' = g - k d, so d = g/k (1 - cos w t) + v/w sin w t: instants, lengths and speeds of all contacts."""
    tolerance = 1e-9 if name in ("dop853", "dopri5", "rodas5p") else 1e-8
    result = impact(name, crosses, tolerance)
    assert result.status == FINISHED
    k, g = 4e3, 9.81
    first, v, w = math.sqrt(2e-2 / g), math.sqrt(2e-2 * g), math.sqrt(k)
    # d = 0 again where tan(w t / 2) = - v w / g
    duration = 2.0 * (math.pi - math.atan(v * w / g)) / w
    flight = 2.0 * v / g
    starts = first + (duration + flight) * np.arange(10)
    ends = starts + duration
    rises, falls = result.log[result.log[:, 2] == 1.0], result.log[result.log[:, 2] == 0.0]
    bound = 2e4 * tolerance if crosses else 3e3 * tolerance
    assert np.allclose(rises[:, 0], starts[: len(rises)], atol=bound)
    assert np.allclose(falls[:, 0], ends[: len(falls)], atol=bound)
    assert len(rises) == int(np.sum(starts < 0.5))
    assert np.allclose(rises[:, 3], -v, atol=1e3 * bound)
    assert np.allclose(falls[:, 3], v, atol=1e3 * bound)
    # the mode alternates
    assert np.array_equal(result.log[:, 2], (np.arange(len(result.log)) + 1) % 2)


def test_steps_go_across(name):
    """Contract: with a loose tolerance a step goes across levels that change nothing; there are as few as without guards."""
    levels = (0.1, 0.2, 0.7)
    across = solve_problem(name, OSCILLATOR, (0.0, 1.0), 9.0, levels=levels, crosses=True, rtol=1e-6, atol=1e-6)
    free = solve_problem(name, OSCILLATOR, (0.0, 1.0), 9.0, rtol=1e-6, atol=1e-6)
    assert across.state.counts["steps"][0] == free.state.counts["steps"][0]
    # rows of one step: rises first
    inner = np.argsort(across.log[:, 0], kind="stable")
    log = across.log[inner]
    expected = sorted(
        (when + 2.0 * math.pi * turn, guard, mode)
        for guard, level in enumerate(levels)
        for turn in (0, 1)
        for when, mode in ((math.asin(level), 1), (math.pi - math.asin(level), 0))
        if when + 2.0 * math.pi * turn < 9.0
    )
    assert [(int(row[1]), int(row[2])) for row in log] == [(guard, mode) for _, guard, mode in expected]
    assert np.allclose(log[:, 0], [when for when, _, _ in expected], atol=3e-4)
    assert np.allclose(log[:, 3], np.cos([when for when, _, _ in expected]), atol=3e-4)


def test_crossed_contacts_keep_the_energy(name):
    """Identity: energy is the same before and after each contact to the tolerance, also if its force begins inside a step."""
    result = impact(name, True, 1e-8, samples=301)
    y, v = result.out.state.T
    energy = 0.5 * v * v + 9.81 * y + 0.5 * 4e3 * np.minimum(y, 0.0) ** 2
    assert np.max(np.abs(energy - 9.81e-2)) < 2e-4 * 9.81e-2


def test_a_missed_level_is_not_logged():
    """Limit: a contact prepared for a rise that does not happen ends with the step: modes are 0 where the ball is above."""
    for height in (1e-9, 1e-7, 1e-5):
        result = solve_problem(
            *("dop853", COMPLIANT, (height, -0.5), 0.4),
            parameters=(1e3, 1.0, 9.81),
            levels=(0.0,),
            senses=(-1.0,),
            crosses=True,
            rtol=1e-7,
            atol=1e-9,
            samples=501,
        )
        clear = np.abs(result.out.state[:, 0]) > 1e-5
        assert np.array_equal(result.out.mode[clear, 0] == 1, result.out.state[clear, 0] < 0.0)
