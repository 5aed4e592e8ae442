"""The classifier names made-up motions of every kind, says why, and where it does not know."""

import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.analysis.verdict import classify_samples
from scissordyn.casefile.configuration import write_configuration

from .made_up import CLEARANCE, henon, logistic, made_up_run, rotation


def settling(values):
    """Return the values with a transient added that decays before the middle."""
    return values + np.exp(-0.5 * np.arange(len(values)))


@pytest.mark.parametrize(
    ("samples", "kind", "period"),
    [
        (settling(np.full(300, 2.0)), "periodic", 1),
        (settling(np.tile([0.2, 0.8], 150)), "periodic", 2),
        (settling(np.tile([0.2, 0.8, 0.5], 100)), "periodic", 3),
        (logistic(3.2, 60), "periodic", 2),
        (logistic(3.83, 300), "periodic", 3),
        (rotation(1000), "quasi-periodic", None),
        (3.0 + 0.1 * rotation(500, math.sqrt(2.0) - 1.0)[:, 0], "quasi-periodic", None),
        (logistic(4.0, 1000), "irregular", None),
        (henon(1000), "irregular", None),
        (rotation(100), "transient only", None),
        (0.995 ** np.arange(1000) * logistic(4.0, 1000), "transient only", None),
        (np.linspace(0.0, 1.0, 400), "transient only", None),
        (0.995 ** np.arange(1000) * rotation(1000)[:, 0], "transient only", None),
    ],
    ids=[
        "period 1",
        "period 2",
        "period 3",
        "logistic period 2",
        "logistic period 3",
        "golden mean",
        "small rotation",
        "logistic chaos",
        "henon",
        "too few",
        "decaying",
        "drifting",
        "decaying about zero",
    ],
)
def test_kinds(samples, kind, period):
    """Closed form: motions that are what they are by construction, with evidence that gives numbers."""
    found = classify_samples(samples)
    assert (found.kind, found.period) == (kind, period)
    assert any(character.isdigit() for character in " ".join(found.evidence))
    assert found.measures["samples"] == len(samples)


def test_period_is_settled_after_the_transient():
    """Closed form: e^(-k/2) and its successor differ by less than 1e-3 of the scale 3 from k = 10 on, not before."""
    found = classify_samples(settling(np.full(300, 2.0)), scale=[3.0])
    misses = np.exp(-0.5 * np.arange(300)) * (1.0 - math.exp(-0.5)) / 3.0
    assert found.measures["settled_after"] == np.flatnonzero(misses > 1e-3)[-1] + 1
    assert found.measures["repetition_error"] < 1e-20 + np.finfo(float).eps


def test_continuous_contact_needs_no_flight():
    """Limit: period 1 without flights is continuous contact, with the shortest flight it is not; chaos stays chaos."""
    assert classify_samples(np.ones(20), flight_fraction=0.0).kind == "continuous contact"
    assert classify_samples(np.ones(20), flight_fraction=1e-6).kind == "periodic"
    assert classify_samples(logistic(4.0, 500), flight_fraction=0.0).kind == "irregular"


def test_trust_horizon_is_spoken_of():
    """Contract: samples beyond the horizon are counted, and the verdict asks for an ensemble."""
    chaos, times = logistic(4.0, 500), np.arange(500.0)
    beyond = classify_samples(chaos, times=times, trusted_until=99.5)
    assert "400 of 500 samples lie beyond" in beyond.evidence[-1]
    assert "Compare an ensemble beyond it" in beyond.evidence[-1]
    assert beyond.measures["trusted_fraction"] == pytest.approx(0.2, rel=1e-14)
    within = classify_samples(chaos, times=times, trusted_until=499.0)
    assert within.measures["trusted_fraction"] == 1.0
    assert not any("no evidence" in sentence for sentence in within.evidence)
    assert "has not been determined" in classify_samples(chaos, times=times).evidence[-1]


@pytest.mark.parametrize(
    ("spans", "after", "kind"),
    [
        ([(0.0, math.nan)], 0.0, "continuous contact"),
        ([(0.05, 0.1), (0.2, math.nan)], 0.0, "transient only"),
        ([(0.05, 0.1), (0.2, math.nan)], 0.25, "continuous contact"),
        ([(0.05, 0.1), (0.2, 0.9)], 0.25, "transient only"),
        ([], 0.0, "transient only"),
    ],
)
def test_single_strokes(spans, after, kind):
    """Closed form: a stroke in contact all the time is continuous contact; any flight makes it transient only, never more."""
    found = sd.classify(made_up_run(spans, trusted_until=0.5), after=after)
    assert (found.kind, found.period) == (kind, None)
    assert "no period" in found.evidence[0]
    assert any("Compare an ensemble beyond it" in sentence for sentence in found.evidence)
    assert found.measures["trusted_fraction"] == pytest.approx((0.5 - after) / (1.0 - after), rel=1e-14)


@pytest.mark.parametrize(("begin", "flight", "since"), [(0.7, 0.0, 0.0), (0.8, 0.1, 0.8)])
def test_corners_of_a_guide_count_together(begin, flight, since):
    """Closed form: two corners that touch in turn are one contact; without a touch of any corner the guide is in flight."""
    run = made_up_run([(0.0, 0.3), (0.25, 0.7), (begin, math.nan)])
    corners = [f"guide/corner {number}" for number in (1, 2)]
    run = run.assign_coords(joint=corners).assign(
        clearance=("joint", [CLEARANCE, CLEARANCE]), contact_joint=("contact", [*corners, corners[0]])
    )
    block = sd.slider_crank(slider_inertia=2.3e-5).with_clearance("guide", sd.GuideClearance(CLEARANCE, 0.04, 0.02))
    found = sd.classify(run.assign_attrs(configuration=write_configuration(block)))
    assert found.kind == ("transient only" if flight else "continuous contact")
    assert found.measures["flight_fraction"] == pytest.approx(flight, abs=1e-15)
    assert found.measures["contact_since"] == since
    # pins of these names are not corners of a guide
    apart = sd.classify(run)
    assert apart.kind == "transient only"
    assert apart.measures["flight_fraction"] == pytest.approx(max(0.55, flight), abs=1e-15)


def driven(map_, spans):
    """Return a run with one flash per ten samples, at which the journal is at the next point of `map_` [clearances]."""
    instants = 10 * (len(map_) - 1) + 1
    orbit = np.zeros((instants, 2))
    orbit[::10] = CLEARANCE * map_
    return made_up_run(spans, end=float(len(map_) - 1), instants=instants, orbit=orbit)


def test_periodic_runs():
    """Closed form: runs whose journals follow known maps; the flights of the first half do not count."""
    ones = np.ones((40, 2))
    assert sd.classify(driven(ones, [(0.5, 3.0), (3.5, math.nan)]), period=1.0).kind == "continuous contact"
    assert sd.classify(driven(ones, [(0.0, 35.0)]), period=1.0).name == "periodic, period 1"
    assert sd.classify(driven(np.tile([[0.1, 0.2], [0.3, 0.2]], (20, 1)), []), period=1.0).name == "periodic, period 2"
    assert sd.classify(driven(0.9 * rotation(400), []), period=1.0, skip=10).kind == "quasi-periodic"
    assert sd.classify(driven(0.5 * henon(400), []), period=1.0, skip=10).kind == "irregular"
    with pytest.raises(sd.InputError, match="samples at each of them"):
        sd.classify(driven(ones, []), period=0.77)


def test_cycles():
    """Closed form: the cycles of a long periodic run, whose clearance stands in its configuration."""
    joints = [sd.Revolute("A", ("a", "p"), ("b", "p"), sd.Clearance(CLEARANCE)), sd.Revolute("O", ("a", "q"), ("b", "q"))]
    bodies = [sd.Body(name, 1.0, 1.0, points={"p": (0.0, 0.0), "q": (1.0, 0.0)}) for name in "ab"]
    map_ = 0.5 * henon(400)
    cycles = xr.Dataset(
        {
            "eccentricity": (("cycle", "joint", "axis"), CLEARANCE * map_[:, None]),
            "contact_fraction": (("cycle", "joint"), np.full((400, 1), 0.5)),
        },
        coords={"time": ("cycle", np.arange(400.0)), "joint": ["A"], "axis": ["x", "y"]},
        attrs={"configuration": write_configuration(sd.Mechanism(bodies, joints))},
    )
    found = sd.classify(cycles)
    assert found.kind == "irregular"
    assert found.measures["flight_fraction"] == 0.5
    still = cycles.assign(
        eccentricity=0.0 * cycles["eccentricity"] + CLEARANCE, contact_fraction=0.0 * cycles["contact_fraction"] + 1.0
    )
    assert sd.classify(still).name == "continuous contact, period 1"
    with pytest.raises(sd.InputError, match="has no clearances"):
        sd.classify(cycles.drop_attrs())
    with pytest.raises(sd.InputError, match="samples are left"):
        sd.classify(cycles, skip=399)


def test_consensus():
    """Closed form: three irregular members and one of period 2; fractions, means and standard deviations of the measures."""
    chaotic = [classify_samples(logistic(4.0, 400, start=0.3 + 1e-3 * k)) for k in range(3)]
    found = sd.consensus([*chaotic, classify_samples(logistic(3.2, 400))])
    assert (found.kind, found.period, found.fraction) == ("irregular", None, 0.75)
    assert found.counts == {"irregular": 3, "periodic, period 2": 1}
    growth = [verdict.measures["K"] for verdict in chaotic]
    row = found.measures.sel(measure="K")
    assert float(row["mean"]) == pytest.approx(np.mean(growth), rel=1e-14)
    assert float(row["deviation"]) == pytest.approx(np.std(growth, ddof=1), rel=1e-14)
    assert (float(row["least"]), float(row["largest"]), int(row["members"])) == (min(growth), max(growth), 3)
    assert found.evidence[0] == "3 of 4 members: irregular; 1 of 4 members: periodic, period 2."
    assert "is undecided" in sd.consensus([chaotic[0], classify_samples(np.ones(9))]).evidence[1]
    with pytest.raises(sd.InputError, match="at least two"):
        sd.consensus(chaotic[:1])


def test_inputs_are_checked():
    """Contract: too few samples, NaN, and scales that are not positive are refused."""
    for samples, options in (
        ([1.0], {}),
        ([1.0, math.nan], {}),
        ([1.0, 2.0], {"scale": [0.0]}),
        ([1.0, 2.0], {"tolerance": 0.0}),
    ):
        with pytest.raises(sd.InputError):
            classify_samples(samples, **options)
