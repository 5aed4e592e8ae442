"""Studies with derivatives: fewer points for the same surface and trend, and the reasons why derivatives are missing."""

import re

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.studies.answer.page import page

FACTORS = {"A.clearance": (3e-4, 5e-4), "drive.speed": (11.5, 15.7)}
MEASURES = ["A.peak_force", "A.first_contact"]


def studied(points, measures=MEASURES, until=6e-3, **options):
    """Return a study of the paper's array without friction, whose second contact has the largest force."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.NoFriction())).driven(speed=sd.rpm(150))
    return sd.study(arm, FACTORS, until=until, measures=measures, points=points, seed=1, **options)


def left_out(found, name):
    """Return the relative error of left-out points of a surface."""
    surface = found.between(name)
    assert surface is not None
    return surface.error


def test_points_with_derivatives_replace_points():
    """Accuracy: eight points with derivatives predict each other better than 16 without, for values that agree bit for bit."""
    few, many = studied(8, gradients=True), studied(16)
    np.testing.assert_array_equal(few.points["A.peak_force"], many.points["A.peak_force"][:8])
    assert left_out(few, "A.peak_force") < left_out(many, "A.peak_force")
    surface = few.between("A.peak_force")
    assert surface is not None
    x = np.stack([many.points[name].values for name in FACTORS], axis=1)
    np.testing.assert_allclose(surface.predict(x)[0], many.points["A.peak_force"], rtol=1e-3)


def test_derivatives_agree_with_the_surface_of_many_points():
    """Cross-check: derivatives of the runs against central differences of the surface of 64 values."""
    few, many = studied(4, gradients=True), studied(64).between("A.first_contact")
    assert many is not None
    x = np.stack([few.points[name].values for name in FACTORS], axis=1)
    for k, name in enumerate(FACTORS):
        step = 1e-3 * x[:, k : k + 1] * np.eye(2)[k]
        slope = (many.predict(x + step)[0] - many.predict(x - step)[0]) / (2e-3 * x[:, k])
        exact = few.points["derivative"].sel(derivative_of="A.first_contact", derivative_by=name)
        np.testing.assert_allclose(exact, slope, rtol=0.05)


def test_derivatives_are_those_of_the_gradient():
    """Identity: at the tolerance of a study, 1e-8, one derivative of these two was 38 % off, and the value 2e-6."""
    joints = {"A": 0.315242263674736e-3, "unit 1/pivot": 0.3e-3}
    arm = sd.scissor(units=2).driven(speed=14.783817720599473)
    for joint, clearance in joints.items():
        arm = arm.with_clearance(
            joint, sd.Clearance(clearance, damping=sd.Flores(0.9115864683873951), friction=sd.NoFriction())
        )
    vary, of = {"A.clearance": (0.315e-3, 0.316e-3), "drive.speed": (14.78, 14.79)}, ["peak_drive_torque", "A.impulse"]
    found = sd.study(arm, vary, until=4e-3, measures=of, points=1, gradients=True)
    point = {name: found.points[name].item() for name in vary}
    for name, value in point.items():
        arm = arm.replace(name, value)
    exact = sd.gradient(arm, of=of, by=list(vary), until=4e-3)["derivative"].values
    slopes = found.points["derivative"].sel(derivative_of=of, derivative_by=list(vary))
    np.testing.assert_allclose(slopes.values[0], exact, rtol=1e-9)


def test_four_points_have_a_trend():
    """Closed form: the first contact is about proportional to the root of the clearance; four values alone have no trend."""
    trend = studied(4, gradients=True).trends["A.first_contact"]
    assert trend.clear
    assert trend.slopes[0] == pytest.approx(0.5, abs=0.02)
    assert "A.first_contact" not in studied(4).trends


def test_reasons(tmp_path):
    """Contract: the answers say how many points have derivatives, and why others have none; they are kept in the store."""
    studied(4, ["A.peak_force", "A.contact_count", "peak_force"], gradients=True, store=tmp_path / "study.db")
    found = sd.open_study(tmp_path / "study.db")
    section = next(part for part in page(found, "study.db", 9) if part.title.startswith("Derivatives"))
    assert ("A.peak_force", "A.clearance", "4 of 4") in section.rows
    assert ("A.contact_count", "drive.speed", "0 of 4") in section.rows
    assert any("is a count" in note for note in section.notes)
    assert any("in contacts alone: forces of ideal joints have no derivatives" in note for note in section.notes)
    assert not any(
        "no derivative" in row[1] for part in page(found, "study.db", 9) if part.title == "Warnings" for row in part.rows
    )


def test_a_number_without_effect():
    """Contract: the direction of a gravity of zero has no derivatives, and the answers give the reason."""
    ball = sd.Body("ball", 1.0, 1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(0.5, 0.0))
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=sd.Clearance(1e-3))
    free = sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)
    vary = {"gravity_direction": (0.1, 0.2), "ball.velocity.x": (0.4, 0.6)}
    options = sd.Options(4e-3, "as-placed")
    found = sd.study(free, vary, options=options, measures=["hole.peak_force"], points=4, gradients=True)
    slopes = found.points["derivative"].sel(derivative_of="hole.peak_force")
    assert np.isnan(slopes.values).tolist() == [[True, False]] * 4
    reason = "no derivative of hole.peak_force by gravity_direction: 'gravity_direction' does not affect this run"
    assert len(found.warnings[reason]) == 4


def test_beyond_the_limit():
    """Contract: derivatives of a long run are not used beyond the instant until which they are valid."""
    found = studied(4, ["A.peak_force"], until=0.05, gradients=True)
    assert np.isnan(found.points["derivative"]).sum() >= 4
    assert any(re.match("no derivative of A.peak_force by .*: from t = ", text) for text in found.warnings)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"members": 2}, "gradients of several runs of each point; expected one sample and one member"),
        ({"uncertain": {"A.clearance": "+- 5 %"}}, "gradients of a study with 'A.clearance', a deviation"),
        ({"goals": "minimise A.peak_force"}, "gradients of a study with goals"),
    ],
)
def test_refusals(options, reason):
    """Contract: a study whose cases have no derivatives of their own is refused in one line."""
    with pytest.raises(sd.InputError, match=re.escape(reason)):
        studied(4, gradients=True, **options)


def test_two_names_of_one_number():
    """Contract: they are refused in any study, names that share a number if there are derivatives."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    for first, gradients in (("joint.A.clearance", False), ("joint.all.clearance", True)):
        vary = {first: (3e-4, 5e-4), "A.clearance": (3e-4, 5e-4)}
        with pytest.raises(sd.InputError, match=f"'{first}' and 'A.clearance' change the same value"):
            sd.study(arm, vary, until=1e-3, points=4, gradients=gradients)
