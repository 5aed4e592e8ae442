"""Stroboscopic maps, sections and the interpolation under them."""

import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.analysis.scatter import velocity_acceleration

from .made_up import made_up_run

W = 2.0 * math.pi  # [rad/s] angular frequency of the made-up slider


def test_strobe_takes_samples():
    """Contract: where every flash is a sample the samples are taken as they are, joints included."""
    run = made_up_run([(0.0, math.nan)], end=10.0, instants=1001)
    found = sd.stroboscopic(run, period=0.25, phase=0.4, skip=3)
    np.testing.assert_allclose(found["time"], np.arange(0.85, 10.0, 0.25), rtol=1e-12)
    assert found.attrs["source"] == "samples"
    np.testing.assert_array_equal(found["eccentricity"], run["eccentricity"].values[85::25])
    assert float(found["clearance"].sel(joint="A")) == float(run["clearance"].sel(joint="A"))
    assert sd.stroboscopic(run, period=10.0).sizes["strobe"] == 2
    for options in ({"period": -1.0}, {"period": 1.0, "skip": 11}, {"period": 1.0, "skip": -1}):
        with pytest.raises(sd.InputError):
            sd.stroboscopic(run, **options)


@pytest.mark.parametrize("name", ["slider_position", "slider_velocity"])
def test_interpolation_is_of_fourth_order(name):
    """Order of convergence: the error of cubic Hermite interpolation falls with h^4; and is below its bound."""
    errors = []
    for instants in (26, 51, 101):
        found = sd.stroboscopic(made_up_run([], instants=instants), period=0.0313, phase=0.0071 / 0.0313)
        assert found.attrs["source"] == "interpolated"
        assert "eccentricity" not in found
        time = found["time"].values
        exact = np.sin(W * time) if name == "slider_position" else W * np.cos(W * time)
        errors.append(np.max(np.abs(found[name].values - exact)))
        top = W**4 if name == "slider_position" else W**5
        assert errors[-1] <= top * (1.0 / (instants - 1)) ** 4 / 384.0 * (1.0 + 1e-9)
    order = np.log2(errors[0] / errors[2]) / 2.0
    assert order == pytest.approx(4.0, abs=0.2)


def test_section_of_a_sine():
    """Closed form: sin(w t) crosses 1/2 at the exact times, to the interpolation error; directions are distinguished."""
    run = made_up_run([], end=3.0, instants=301)
    rising = sd.section(run, variable="slider_position", level=0.5, direction="rising")
    np.testing.assert_allclose(rising["time"], np.arange(3) + 1.0 / 12.0, atol=1e-7)
    np.testing.assert_allclose(rising["slider_position"], 0.5, atol=1e-13)
    np.testing.assert_allclose(rising["slider_velocity"], W * math.sqrt(0.75), atol=1e-5)
    np.testing.assert_allclose(rising["slider_acceleration"], -0.5 * W**2, atol=1e-3)
    falling = sd.section(run, variable="slider_position", level=0.5, direction="falling")
    np.testing.assert_allclose(falling["time"], np.arange(3) + 5.0 / 12.0, atol=1e-7)
    both = sd.section(run, variable="slider_position", level=0.5)
    assert both["direction"].values.tolist() == [1, -1] * 3
    # linear interpolation would miss by h^2/8 times the curvature over the slope
    linear = 0.5 * W**2 / 8.0 * 0.01**2 / (W * math.sqrt(0.75))
    assert linear > 100.0 * np.max(np.abs(rising["time"].values - np.arange(3) - 1.0 / 12.0))


def test_section_at_and_between_samples():
    """Closed form: a crossing on a sample counts once; two crossings between two samples both count; a touch does not."""
    run = made_up_run([], end=1.0, instants=5)
    rounded = run.assign(slider_position=run["slider_position"].round(12))
    on_samples = sd.section(rounded, variable="slider_position")
    np.testing.assert_allclose(on_samples["time"], [0.0, 0.5, 1.0], atol=1e-12)
    assert on_samples["direction"].values.tolist() == [1, -1, 1]
    # a parabola through 0.24 and 0.76 inside of one step
    time = run["time"].values
    bowl = run.assign(slider_position=("time", (time - 0.3) * (time - 0.4)), slider_velocity=("time", 2.0 * time - 0.7))
    np.testing.assert_allclose(sd.section(bowl, variable="slider_position")["time"], [0.3, 0.4], atol=1e-12)
    assert sd.section(bowl, variable="slider_position", level=-0.0025 - 1e-9).sizes["crossing"] == 0


def test_section_says_what_is_wrong():
    """Contract: unknown variables and bodies get the right ones named."""
    run = made_up_run([])
    with pytest.raises(sd.InputError, match="did you mean 'slider_position'"):
        sd.section(run, variable="slider_positon")
    with pytest.raises(sd.InputError, match="no choice of body and axis"):
        sd.section(run, variable="position")
    with pytest.raises(sd.InputError, match="body 'sledge'"):
        sd.section(run, variable="position", at={"body": "sledge", "axis": "x"})
    with pytest.raises(sd.InputError, match="direction = 'up'"):
        sd.section(run, variable="slider_position", direction="up")
    assert sd.section(run, variable="position", level=1.0, at={"body": "slider", "axis": "x"}).sizes["crossing"] == 0


def test_velocity_acceleration():
    """Contract: the slider's samples in the window; another body where it is named; an error where there is no slider."""
    run = made_up_run([])
    found = velocity_acceleration(run, after=0.5)
    xr.testing.assert_equal(found["velocity"].variable, run["slider_velocity"].sel(time=slice(0.5, None)).variable)
    assert float(velocity_acceleration(run, body="unit 1/bar 1", axis="x")["velocity"].max()) == 0.0
    with pytest.raises(sd.InputError, match="the run has no slider"):
        velocity_acceleration(run.drop_vars("slider_velocity"))
    with pytest.raises(sd.InputError, match="did you mean 'slider'"):
        velocity_acceleration(run, body="slide")
    with pytest.raises(sd.InputError, match=r"unknown axis = 'z'.*'x' or 'y'"):
        velocity_acceleration(run, axis="z")
