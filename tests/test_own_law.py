"""A law of the user's own in a whole run."""

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.run.simulate import replay

STIFFNESS = 1.5e-2 * 0.5 * np.pi * sd.STEEL.youngs_modulus / (2.0 * (1.0 - sd.STEEL.poisson_ratio**2))


def own():
    """A clearance with a law in no file."""

    @sd.element(slot="stiffness")
    def foundation(indentation, stiffness=STIFFNESS, clearance=0.5e-3):
        """Liu's force, written by a user."""
        return stiffness * indentation * (indentation / (2.0 * (clearance + indentation))) ** 0.5

    return sd.Clearance(0.5e-3, stiffness=foundation())


@sd.element(slot="stiffness")
def hole(indentation):
    """A law with a hole between two indentations at which it is tried."""
    return 1e9 * indentation if indentation < 5.1e-5 or indentation > 5.4e-5 else float("nan")


def test_own_law_gives_the_same_run(array, clearance_run):
    """Cross-check: the user's copy of a built-in law gives its contacts to round-off's growth."""
    run = sd.simulate(array.with_clearance("A", own()), until=0.05)
    assert np.allclose(run["contact_start"][:5], clearance_run["contact_start"][:5], rtol=1e-8)
    assert np.allclose(run["peak_force"][:5], clearance_run["peak_force"][:5], rtol=1e-6)


def test_own_function_is_recorded_but_not_executed(array, tmp_path):
    """Contract: a saved run holds the source of a user's function; running it again asks for a file in one line."""
    run = sd.simulate(array.with_clearance("A", own()), until=0.001, samples=11)
    with pytest.warns(UserWarning, match=r"cannot be run again .* is in no file"):
        loaded = sd.load(sd.save(run, tmp_path / "run.nc"))
    assert "written by a user" in loaded.attrs["configuration"]
    with pytest.raises(sd.InputError, match=r"mine\.py:foundation"):
        replay(loaded)


def test_law_that_breaks_off_ends_the_run(array):
    """Contract: a law that gives NaN inside the run ends it with what was computed, the time and the joint."""
    run = sd.simulate(array.with_clearance("A", sd.Clearance(0.5e-3, stiffness=hole())), until=0.05)
    assert run.attrs["status"] == "failed"
    assert "'A'" in run.attrs["cause"]
    assert "not a number" in run.attrs["cause"]
    assert np.all(np.isfinite(run["slider_position"]))
