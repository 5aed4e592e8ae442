"""Classical linkages against their kinematics in closed form; `validation/n_four_bar` has the pendulum of many loops."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd

TIGHT = {"rtol": 1e-12, "atol": 1e-12}  # Tolerances of accurate runs
CLOSE = 1e-9  # Allowed relative error of positions, speeds and accelerations


@pytest.mark.parametrize(("offset", "angle"), [(0.0, 0.0), (0.02, 0.5), (-0.03, 4.0)])
def test_slider_crank_motion(offset, angle):
    """Closed form: slider and rod of the ideal slider-crank over a revolution, with their first and second derivatives."""
    w, r, l = sd.rpm(3000), 0.05, 0.12
    mechanism = sd.slider_crank(crank=r, rod=l, offset=offset, angle=angle).driven(speed=w)
    run = sd.simulate(mechanism, until=0.02, samples=201, **TIGHT)
    a = angle + w * run["time"].values
    b = np.arcsin((offset - r * np.sin(a)) / l)
    turn = -r * w * np.cos(a) / (l * np.cos(b))
    spin = (r * w**2 * np.sin(a) + l * turn**2 * np.sin(b)) / (l * np.cos(b))
    x = r * np.cos(a) + l * np.cos(b)
    v = -r * w * np.sin(a) - l * turn * np.sin(b)
    acceleration = -r * w**2 * np.cos(a) - l * (spin * np.sin(b) + turn**2 * np.cos(b))
    assert np.allclose(run["slider_position"], x, rtol=0, atol=CLOSE)
    assert np.allclose(run["slider_velocity"], v, rtol=0, atol=CLOSE * w)
    assert np.allclose(run["slider_acceleration"], acceleration, rtol=0, atol=CLOSE * w**2)
    assert np.allclose(run["angle"].sel(body="rod"), b, rtol=0, atol=CLOSE)
    assert np.allclose(run["angular_velocity"].sel(body="rod"), turn, rtol=0, atol=CLOSE * w)
    assert np.allclose(run["angular_acceleration"].sel(body="rod"), spin, rtol=0, atol=CLOSE * w**2)
    assert np.allclose(run["position"].sel(body="slider", axis="y"), offset, rtol=0, atol=1e-14)


# Dimensions, motion of the crank, and end of the run [s] of four-bar linkages, by kind
FOUR_BARS = {
    "crank-rocker": ({}, sd.ConstantSpeed(10.0), 0.8),
    "crossed": ({"branch": "crossed"}, sd.ConstantSpeed(-10.0), 0.8),
    "double-crank": ({"ground": 0.08, "crank": 0.2, "coupler": 0.18, "rocker": 0.15}, sd.ConstantSpeed(10.0), 0.8),
    "triple-rocker": ({"ground": 0.2, "crank": 0.15, "coupler": 0.12, "rocker": 0.1}, sd.Harmonic(math.pi / 3, 0.2, 8.0), 0.8),
}


@pytest.mark.parametrize("case", FOUR_BARS)
def test_four_bar_motion(case):
    """Closed form: coupler and rocker angles by the law of cosines, their rates from the vector loop, Grashof or not."""
    lengths, motion, until = FOUR_BARS[case]
    mechanism = sd.four_bar(**lengths).driven(motion)
    run = sd.simulate(mechanism, until=until, samples=201, **TIGHT)
    assert run.attrs["status"] == "complete"
    sizes = {"ground": 0.2, "crank": 0.08, "coupler": 0.18, "rocker": 0.15, **lengths}
    ground, r, l, c = (sizes[name] for name in ("ground", "crank", "coupler", "rocker"))
    t = run["time"].values
    if isinstance(motion, sd.Harmonic):
        a = motion.mean + motion.amplitude * np.sin(motion.angular_frequency * t)
        w = motion.amplitude * motion.angular_frequency * np.cos(motion.angular_frequency * t)
        s = -motion.amplitude * motion.angular_frequency**2 * np.sin(motion.angular_frequency * t)
    else:
        a, w, s = math.pi / 3 + motion.speed * t, motion.speed * np.ones_like(t), np.zeros_like(t)
    pin = r * np.exp(1j * a)
    diagonal = ground - pin
    opening = np.arccos((l**2 + np.abs(diagonal) ** 2 - c**2) / (2.0 * l * np.abs(diagonal)))
    b = np.angle(diagonal) + (-opening if lengths.get("branch") == "crossed" else opening)
    d = np.angle(pin + l * np.exp(1j * b) - ground)
    coupler = -w * r * np.sin(a - d) / (l * np.sin(b - d))
    rocker = w * r * np.sin(a - b) / (c * np.sin(d - b))
    bending = -r * s * np.sin(a - d) - r * w**2 * np.cos(a - d) - l * coupler**2 * np.cos(b - d) + c * rocker**2
    across = r * s * np.sin(a - b) + r * w**2 * np.cos(a - b) + l * coupler**2 - c * rocker**2 * np.cos(d - b)
    speed = float(np.max(np.abs(w)))
    for body, angle, rate, second in (
        ("coupler", b, coupler, bending / (l * np.sin(b - d))),
        ("rocker", d, rocker, across / (c * np.sin(d - b))),
    ):
        found = run.sel(body=body)
        assert np.allclose(np.exp(1j * found["angle"]), np.exp(1j * angle), rtol=0, atol=CLOSE)
        assert np.allclose(found["angular_velocity"], rate, rtol=0, atol=CLOSE * speed)
        assert np.allclose(found["angular_acceleration"], second, rtol=0, atol=CLOSE * speed**2)
    middle = run["position"].sel(body="coupler").values @ np.array([1.0, 1.0j])
    assert np.allclose(middle, pin + 0.5 * l * np.exp(1j * b), rtol=0, atol=CLOSE)


def test_coupler_point():
    """Closed form: the coupler point stands where the coupler's start and direction put it."""
    mechanism = sd.four_bar(coupler_point=(0.05, 0.03))
    coupler = mechanism.body("coupler")
    pin = mechanism.place(("crank", "end"))
    expected = complex(*pin) + complex(0.05, 0.03) * np.exp(1j * coupler.angle)
    assert complex(*mechanism.place(("coupler", "point"))) == pytest.approx(expected, abs=1e-15)
    assert mechanism.place(("coupler", "end")) == pytest.approx(mechanism.place(("rocker", "end")), abs=1e-15)


def test_three_bars_on_a_pin():
    """Identity: with three bars on one pin, what the pin's joints carry balances each of the bars, to 1e-9 m g."""
    run = sd.simulate(sd.n_four_bar(2), until=0.5, samples=51, **TIGHT)
    pull, weight = run["reaction"], np.array([0.0, -9.81])
    on = {
        "crank 1": pull.sel(joint="A1") + pull.sel(joint="B1 1") + pull.sel(joint="B1 2"),
        "coupler 1": -pull.sel(joint="B0") - pull.sel(joint="B1 1"),
        "coupler 2": -pull.sel(joint="B1 2") - pull.sel(joint="B2"),
    }
    for body, force in on.items():
        assert np.allclose(force + weight, run["acceleration"].sel(body=body), rtol=0, atol=1e-9 * 9.81)


@pytest.mark.parametrize("joint", ["B1 1", "B1 2", "B1 *"])
def test_one_of_three_bars_has_clearance(joint):
    """Identity: bars on a common pin can have clearance one by one; the energy balance closes and ideal pairs stay together."""
    mechanism = sd.n_four_bar(2).with_clearance(joint, sd.Clearance(0.2e-3))
    run = sd.simulate(mechanism, until=0.3, samples=301)
    assert run.attrs["status"] == "complete"
    assert run.sizes["contact"] >= 1
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-6 * float(run["kinetic_energy"].max())


def test_common_pin_names():
    """Contract: two bars share a joint of the given name; more of them are numbered; one alone is refused."""
    a, b, c = (("a", "end"), ("b", "start"), ("c", "start"))
    assert [joint.name for joint in sd.common_pin("P", a, b)] == ["P"]
    assert [(joint.name, joint.journal, joint.bearing) for joint in sd.common_pin("P", a, b, c)] == [
        ("P 1", a, b),
        ("P 2", a, c),
    ]
    with pytest.raises(sd.InputError, match="two or more"):
        sd.common_pin("P", a)


@pytest.mark.parametrize(
    "build",
    [
        lambda: sd.slider_crank(rod=0.04, angle=math.pi / 2),
        lambda: sd.slider_crank(crank=0.0),
        lambda: sd.four_bar(ground=1.0),
        lambda: sd.four_bar(branch="shut"),
        lambda: sd.n_four_bar(0),
        lambda: sd.n_four_bar(2, length=math.nan),
    ],
)
def test_refused_linkages(build):
    """Contract: a linkage that cannot be built is refused in one line that says what is allowed."""
    with one_line_error(match="expected "):
        build()
