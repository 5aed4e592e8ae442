"""Pictures of regularity show the values of their measures, with names and units, and are readable."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import scissordyn as sd
from scissordyn.analysis.recurrence import recurrence
from scissordyn.analysis.scatter import velocity_acceleration as scatter
from scissordyn.plot.regularity import (
    bifurcation,
    distribution,
    power_spectrum,
    recurrence_plot,
    stroboscopic_map,
    velocity_acceleration,
    zero_one,
)
from scissordyn.plot.series import BEYOND_HORIZON
from scissordyn.plot.style import GREY

from .made_up import made_up, overlaps

SIGNAL = np.sin(0.9 * np.arange(600)) + 0.3 * np.sin(2.1 * np.arange(600))  # Made-up signal with two frequencies


def diagram():
    """Return a diagram of the logistic map in the form of a clearance study, with one failed value."""
    r = np.linspace(2.8, 4.0, 120)
    x, rows = np.full(120, 0.3), []
    for _ in range(160):
        x = r * x * (1.0 - x)
        rows.append(x)
    values = np.array(rows[100:]).T
    values[5] = np.nan
    about = {"units": "m/s", "long_name": "velocity of the slider along its guide"}
    return xr.Dataset(
        {
            "slider_velocity": (("value", "cycle"), values, about),
            "peak_force": (("value", "cycle", "joint"), 1e4 * values[..., None], {"units": "N", "long_name": "largest force"}),
        },
        coords={"value": ("value", 1e-4 * r, {"units": "m", "long_name": "radial clearance"}), "joint": ["A"]},
    )


def pictures(run, ideal):
    """Return all pictures of regularity by name."""
    strobe = sd.stroboscopic(run, period=1e-3)
    return {
        "map": stroboscopic_map(strobe),
        "map of the journal": stroboscopic_map(strobe.assign_attrs(trusted_until=0.02), x="eccentricity", y="eccentricity"),
        "scatter": velocity_acceleration(scatter(run), scatter(ideal)),
        "spectrum": power_spectrum(sd.spectrum(SIGNAL, spacing=0.01, unit="m/s")),
        "bifurcation": bifurcation(diagram()),
        "0-1 test": zero_one(sd.zero_one_test(SIGNAL)),
        "recurrence": recurrence_plot(recurrence(SIGNAL)),
        "distribution": distribution(run),
    }


def test_all_can_be_read(run, ideal):
    """Contract: texts do not overlap or leave the figure, and every axis has a label."""
    for name, drawn in pictures(run, ideal).items():
        figure = drawn[0].get_figure(root=True)
        assert isinstance(figure, Figure)
        assert overlaps(figure) == [], name
        assert all(axes.get_xlabel() and axes.get_ylabel() for axes in drawn), name


def test_stroboscopic_map(run):
    """Contract: one dot per sample in the units of the labels; those beyond the predictability horizon are grey."""
    strobe = sd.stroboscopic(run, period=1e-3)
    (axes,) = stroboscopic_map(strobe.assign_attrs(trusted_until=0.02), y="slider_acceleration")
    before, beyond = axes.lines
    assert len(before.get_xdata()) == 21
    assert len(before.get_xdata()) + len(beyond.get_xdata()) == strobe.sizes["strobe"]
    assert beyond.get_label() == BEYOND_HORIZON
    assert to_rgba(beyond.get_color()) == to_rgba(GREY)
    np.testing.assert_allclose(before.get_xdata(), strobe["slider_position"].values[:21], rtol=1e-14)
    (axes,) = stroboscopic_map(strobe, x="eccentricity", y="eccentricity", joint="A")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x of the journal [mm]", "y of the journal [mm]")
    place = 1e3 * strobe["eccentricity"].sel(joint="A")
    np.testing.assert_allclose(axes.lines[0].get_ydata(), place.sel(axis="y"), rtol=1e-14)
    assert strobe["eccentricity"].attrs == run["eccentricity"].attrs
    with pytest.raises(sd.InputError, match="did you mean 'slider_position'"):
        stroboscopic_map(strobe, x="slider_positon")
    with pytest.raises(sd.InputError, match="joint 'O'"):
        stroboscopic_map(strobe, x="eccentricity", joint="O")


def test_scatter_shows_both_runs(run, ideal):
    """Contract: the run's samples are dots, the ideal mechanism's a line."""
    found = scatter(run)
    found["velocity"].attrs["long_name"] = "velocity of the slider along its guide"
    (axes,) = velocity_acceleration(found, scatter(ideal))
    assert axes.get_xlabel() == "velocity of the slider [m/s]"
    dots, line = axes.lines
    assert (dots.get_linestyle(), line.get_linestyle()) == ("None", "-")
    np.testing.assert_allclose(dots.get_xdata(), run["slider_velocity"], rtol=1e-14)
    np.testing.assert_array_equal(line.get_ydata(), ideal["slider_acceleration"])


def test_spectrum_names_its_peaks():
    """Contract: logarithmic density, with marks and values at the dominant frequencies."""
    found = sd.spectrum(SIGNAL, spacing=0.01, unit="m/s")
    (axes,) = power_spectrum(found)
    assert axes.get_yscale() == "log"
    assert axes.get_ylabel() == "power density [(m/s)² s]"
    np.testing.assert_array_equal(axes.lines[1].get_xdata(), found["dominant_frequency"])
    assert [text.get_text() for text in axes.texts] == [f"{value:.4g}" for value in found["dominant_frequency"].values]


def test_bifurcation_shows_every_cycle():
    """Contract: every stored cycle is a dot; variable and joint can be chosen, and wrong ones are refused by name."""
    data = diagram()
    (axes,) = bifurcation(data)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("radial clearance [mm]", "velocity of the slider [m/s]")
    np.testing.assert_allclose(axes.lines[0].get_xdata(), np.repeat(1e3 * data["value"].values, 60), rtol=1e-14)
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), data["slider_velocity"].values.ravel())
    (axes,) = bifurcation(data.assign_attrs(parameter="A.clearance"))
    assert axes.get_xlabel() == "A.clearance: radial clearance [mm]"
    (axes,) = bifurcation(data, variable="peak_force", joint="A")
    assert axes.get_ylabel() == "largest force [kN]"
    with pytest.raises(sd.InputError, match="did you mean 'slider_velocity'"):
        bifurcation(data, variable="slider_velocty")
    with pytest.raises(sd.InputError, match="joint 'B'"):
        bifurcation(data, variable="peak_force", joint="B")


def test_zero_one_and_recurrence_show_their_numbers():
    """Contract: p against q, the histogram of all angles, the median, and every pair of samples."""
    test = sd.zero_one_test(SIGNAL)
    plane, spread = zero_one(test)
    np.testing.assert_array_equal(plane.lines[0].get_ydata(), test["q"])
    assert sum(bar.get_height() for bar in spread.patches) == test.sizes["angle"]
    assert spread.get_title(loc="left") == f"median K = {float(test['K']):.3f}"
    found = recurrence(SIGNAL)
    (axes,) = recurrence_plot(found)
    np.testing.assert_array_equal(axes.images[0].get_array(), found["recurrent"])


def test_large_recurrence_plot_is_averaged():
    """Limit: of 2400 samples a pixel averages 3 by 3."""
    found = recurrence(np.tile([0.0, 1.0, 2.0, 3.0], 600), threshold=0.5)
    (axes,) = recurrence_plot(found)
    shown = axes.images[0].get_array()
    assert shown.shape == (800, 800)
    assert float(shown[0, 0]) == pytest.approx(3.0 / 9.0, rel=1e-14)
    assert float(np.mean(shown)) == pytest.approx(0.25, rel=1e-12)


def test_distribution_counts_every_contact(run, two_joints):
    """Contract: the bars count all contacts of the joint; the axis is logarithmic for a wide range."""
    (axes,) = distribution(run)
    assert sum(bar.get_height() for bar in axes.patches) == run.sizes["contact"]
    assert axes.get_xlabel() == "peak_force [kN]"
    (axes,) = distribution(two_joints, joint="unit 1/pivot")
    ours = int(np.sum(two_joints["contact_joint"].values == "unit 1/pivot"))
    assert sum(bar.get_height() for bar in axes.patches) == ours < two_joints.sizes["contact"]
    spread = run.assign(impulse=("contact", np.geomspace(1e-3, 1e2, run.sizes["contact"]), {"units": "N s"}))
    (axes,) = distribution(spread, variable="impulse")
    assert axes.get_xscale() == "log"
    assert sum(bar.get_height() for bar in axes.patches) == run.sizes["contact"]
    equal = run.assign(impulse=("contact", np.full(run.sizes["contact"], 2.0), {"units": "N s"}))
    assert sum(bar.get_height() for bar in distribution(equal, variable="impulse")[0].patches) == run.sizes["contact"]
    (axes,) = distribution(made_up(contacts=False))
    assert axes.texts[0].get_text() == "no contact in this run"
    with pytest.raises(sd.InputError, match="did you mean 'peak_force'"):
        distribution(run, variable="peak_forces")
    with pytest.raises(sd.InputError, match="joint 'O'"):
        distribution(run, joint="O")
