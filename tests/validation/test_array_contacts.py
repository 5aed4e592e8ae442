"""Scissor arrays of one to eight units with clearance at five places, compared with other equations and integrators."""

import math

import pytest

import scissordyn as sd
from reference.lagrange import Array, constant_speed
from reference.marching import March
from reference.multipliers import Multipliers, clearance_joint

PIN = sd.Clearance(5e-4)  # Clearance of the joints
# Angle [rad] and speed [rad/s] of the drive, so slow that loads, not inertia, open contacts
START, SPEED = (math.pi / 6.0, math.radians(60.0))
TOLERANCE = 1e-11  # Relative and absolute tolerance of both formulations
CLOSE = 1e-7  # Largest relative difference: errors of 1e-11 in some hundred steps grow up to 300 times in a contact
CLOSE_PEAK_TIME = 1e-5  # [contact durations] largest difference of peak times: round-off of 1e-12 moves a flat peak by 1e-6


def places(units):
    """Return five positions: ground pin, slider joint, a pivot, an inner end joint, and two joints at once."""
    inner = (units + 1) // 2
    if units == 1:
        # one unit has three joints only
        return [("O",), ("A",), ("unit 1/pivot",), ("O", "A"), ("A", "unit 1/pivot")]
    return [
        ("O",),
        ("A",),
        (f"unit {inner + units // 2}/pivot",),
        (f"unit {inner}/{'upper' if units % 2 else 'lower'}",),
        ("A", f"unit {units - 1}/upper"),
    ]


def label(value):
    """Return a case's name for reports."""
    return "+".join(value) if isinstance(value, tuple) else str(value)


# Number of units, and names of the clearance joints
CASES = [(units, joints) for units in range(1, 9) for joints in places(units)]


def assert_first_contacts_agree(mechanism, model, joints, *, contacts):
    """Compare contacts of a run with those of a reference model: time, speed, position, peak, length and rebound."""
    reference = March(model, rtol=TOLERANCE, atol=TOLERANCE, max_step=2e-4).run(0.1, most_contacts=contacts)
    ended = [contact for contact in reference.contacts if not math.isnan(contact.duration)]
    assert len(ended) == contacts
    # a microsecond more, so that the last contact has ended in this formulation too
    run = sd.simulate(mechanism, until=reference.pieces[-1].end + 1e-6, rtol=TOLERANCE, atol=TOLERANCE, samples=11)
    assert run.attrs["status"] == "complete"
    assert run["contact_joint"].values.tolist() == [joints[contact.joint] for contact in reference.contacts]

    def column(name, of):
        return [getattr(contact, name) for contact in of]

    everyone = reference.contacts
    assert run["contact_start"].values.tolist() == pytest.approx(column("start", everyone), rel=CLOSE)
    assert run["approach_speed"].values.tolist() == pytest.approx(column("approach_speed", everyone), rel=CLOSE)
    assert run["contact_angle"].values.tolist() == pytest.approx(column("angle", everyone), abs=CLOSE)
    over = run.isel(contact=[everyone.index(contact) for contact in ended])
    assert over["peak_force"].values.tolist() == pytest.approx(column("peak_force", ended), rel=CLOSE)
    assert over["peak_time"].values.tolist() == pytest.approx(column("peak_time", ended), rel=CLOSE_PEAK_TIME)
    assert over["contact_duration"].values.tolist() == pytest.approx(column("duration", ended), rel=CLOSE)
    assert over["rebound_speed"].values.tolist() == pytest.approx(column("rebound_speed", ended), rel=CLOSE)


@pytest.mark.parametrize(
    ("units", "joints"), CASES, ids=lambda value: str(value) if isinstance(value, int) else "+".join(value)
)
def test_clearance_anywhere(units, joints):
    """Second formulation: three coordinates per body with multipliers have the same first contacts, to 1e-7."""
    mechanism = sd.scissor(units=units, angle=START).driven(speed=SPEED).with_clearance(joints, PIN)
    model = Multipliers(mechanism)
    assert_first_contacts_agree(mechanism, model, [joint.name for joint in model.clearance_joints], contacts=2)


@pytest.mark.parametrize("driven_bar", ["pinned", "slider"])
@pytest.mark.parametrize("units", range(1, 9))
def test_clearance_at_the_slider_joint(units, driven_bar):
    """Second formulation: Lagrange's equations in minimal coordinates have the same first two contacts, to 1e-7."""
    mechanism = sd.scissor(units=units, angle=START, driven_bar=driven_bar).driven(speed=SPEED).with_clearance("A", PIN)
    array = Array(clearance_joint(PIN), constant_speed(START, SPEED), units, driven_bar)
    assert_first_contacts_agree(mechanism, array, ["A"], contacts=2)
