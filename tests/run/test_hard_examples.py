"""Every example with all contacts hard, or every other one: a short run of each, and the whole run as a slow test."""

import dataclasses
import tomllib

import numpy as np
import pytest
from tests.build import EXAMPLES, counts_of, warnings_of

import scissordyn as sd

FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples

SHORT = 0.1  # Fraction of the run of an example that is computed in every test run
FARTHEST = 2.0  # [clearances] largest allowed eccentricity


PIECE = 0.02  # Fraction of the run of an example with both contact kinds, which takes longer because it resolves vibrations


def hard(path):
    """Return the case of an example with ``contact = "hard"`` in each clearance table."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    joints = [f"clearance.{table['joint']}" for table in tables.get("clearance", [])]
    guides = [f"guide_clearance.{table['guide']}" for table in tables.get("guide_clearance", [])]
    return sd.read_case(path, [f"{name}.contact=hard" for name in (*joints, *guides)])


def alternate(path):
    """Return the case with every other clearance joint and guide hard, or None with fewer than two."""
    case = sd.read_case(path, [])
    mechanism = case.mechanism
    loose = [part for part in (*mechanism.guides, *mechanism.joints) if part.clearance is not None]
    if len(loose) < 2:
        return None
    for part in loose[::2]:
        mechanism = mechanism.with_clearance(part.name, dataclasses.replace(part.clearance, contact="hard"))
    return dataclasses.replace(case, mechanism=mechanism)


def check(case, run):
    """Check that a run is complete, inside the bearings and in balance to 1 %, and that impacts add no energy.

    The losses of all contacts sum up to the losses of the run.
    """
    assert run.attrs["status"] == "complete", run.attrs["cause"]
    for joint in [joint for joint in case.mechanism.joints if joint.clearance is not None]:
        far = np.linalg.norm(run["eccentricity"].sel(joint=joint.name).values, axis=-1).max()
        assert far <= FARTHEST * joint.clearance.clearance, joint.name
    scale = 0.01 * max(float(run["kinetic_energy"].max()), 1.0)
    loss = run["damping_loss"].values
    assert float(np.abs(run["energy_residual"].values).max()) <= scale
    assert float(np.max(np.maximum.accumulate(loss) - loss)) <= scale
    for name in ("damping_loss", "friction_loss"):
        total = float(run[name][-1])
        assert float(np.sum(run[f"contact_{name}"])) == pytest.approx(total, rel=1e-9, abs=1e-12 * scale), name


def run_part(case, part):
    """Return the run of an example up to a part of its time."""
    options = case.run.keywords | ({} if part == 1.0 else {"until": part * case.run.until, "samples": 51})
    return sd.simulate(case.mechanism, **options)


# Function that changes a mechanism, case file, and fraction of its run that is computed
CASES = [*((hard, path, SHORT) for path in FILES), *((alternate, path, PIECE) for path in FILES if alternate(path))]


@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("make", "path", "part"), CASES, ids=lambda value: getattr(value, "stem", None))
def test_example_with_hard_contact(make, path, part, whole):
    """Limit: surfaces do not penetrate each other, alone or together with compliant ones."""
    case = make(path)
    kinds = {joint.clearance.contact for joint in case.mechanism.joints if joint.clearance is not None}
    assert make is alternate or kinds <= {"hard"}
    check(case, run_part(case, 1.0 if whole else part))


def test_latch_with_contacts_of_both_kinds():
    """Cross-check: where a latch throws journals across their bearings, final energies are those of compliant contacts."""
    path = EXAMPLES / "self_deploying.toml"
    mixed = alternate(path)
    options = {**mixed.run.keywords, "samples": 51}
    run = sd.simulate(mixed.mechanism, **options)
    accurate = sd.simulate(sd.read_case(path, []).mechanism, **options)
    turned_over = float(accurate["dissipated_energy"][-1])
    assert float(np.abs(run["energy_residual"]).max()) <= 1e-3 * turned_over
    assert counts_of(run)["steps_not_solved"] == 0
    assert float(run["switching_loss"][-1]) == pytest.approx(float(accurate["switching_loss"][-1]), rel=0.01)
    assert float(run["slider_position"][-1]) == pytest.approx(float(accurate["slider_position"][-1]), abs=1e-4)


def test_batches_warn_of_steps_that_are_too_long():
    """Contract: a case of a batch has exactly the warnings of time stepping of its own run."""
    case = hard(EXAMPLES / "self_deploying.toml")
    options = {key: value for key, value in case.run.keywords.items() if key in ("until", "start")}
    over = {"clearance.all.clearance": [joint.clearance.clearance for joint in case.mechanism.joints if joint.clearance][:2]}
    for step, warns in ((None, True), (2e-5, False)):
        alone = sd.simulate(case.mechanism, step=step, **options)
        said = [one for one in warnings_of(alone) if "overlap" in one]
        assert bool(said) == warns
        batch = sd.simulate_many(case.mechanism, over, step=step, measures=["peak_force_estimate"], threads=1, **options)
        for one in batch["warnings"].values:
            assert [line for line in one.splitlines() if "overlap" in line] == said
