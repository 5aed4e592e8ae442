"""The motion of the slider and of a bar, beside the ideal mechanism's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import DEGREES
from scissordyn.plot.series import compare, finish, time_scale, window
from scissordyn.plot.style import Canvas, legend, literal, normal, panels
from scissordyn.run.configuration import ATTRIBUTE, read_configuration

if TYPE_CHECKING:
    import xarray as xr

ROUND_OFF = 1e-10  # Relative change over a run that is none

DEFAULT_BODY = "unit 1/bar 2"

SLIDER = (("slider_position", "displacement"), ("slider_velocity", "velocity"), ("slider_acceleration", "acceleration"))
ROTATION = (("angle", "angle"), ("angular_velocity", "angular velocity"), ("angular_acceleration", "angular acceleration"))


@picture("Six Axes, row by row, slider at the left; three for a mechanism without a slider.")
def response(
    run: xr.Dataset,
    ideal: xr.Dataset | None = None,
    *,
    body: str = "",
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Displacement, velocity and acceleration of the slider; angle, angular velocity and acceleration of a body.

    Parameters
    ----------
    body : str
        The body of the angle. If not given: the output body; where that is the slider, the coupler of the first scissor unit,
        or the first body.

    Raises
    ------
    InputError
        If there is no such body.
    """
    run = window(run, start, end)
    bodies = [str(name) for name in run["body"].values]
    chosen = body or _body(run, bodies)
    if chosen not in bodies:
        raise InputError(f"body '{chosen}'{did_you_mean(chosen, bodies)}", "one of " + ", ".join(bodies))
    slides = SLIDER[0][0] in run
    columns = 2 if slides else 1
    drawn = panels(axes, 3, columns, size=(4.6 * columns, 6.4))
    time = time_scale(run)
    for row, ((along, sliding), (around, rotation)) in enumerate(zip(SLIDER, ROTATION, strict=True)):
        right = drawn[columns * row + columns - 1]
        if slides:
            beside = None if ideal is None else ideal[along]
            compare(drawn[2 * row], sliding, _without_round_off(run, SLIDER, row), beside, time=time)
        curve = _without_round_off(run.sel(body=chosen), ROTATION, row)
        beside = None if ideal is None else ideal[around].sel(body=chosen)
        compare(right, rotation, curve, beside, scale=DEGREES if around == "angle" else None, time=time)
    if slides:
        drawn[0].set_title("slider", loc="left", fontsize=normal())
    drawn[columns - 1].set_title(literal(chosen), loc="left", fontsize=normal())
    finish(drawn, run, time, bottom=drawn[-columns:])
    legend(drawn, above=axes is None)
    return drawn


def _without_round_off(run: xr.Dataset, names: tuple[tuple[str, str], ...], row: int) -> xr.DataArray:
    """A velocity or acceleration; zero where it could not change what it is the derivative of by more than its last digits."""
    values = run[names[row][0]]
    if row == 0:
        return values
    duration = float(run["time"].values[-1] - run["time"].values[0])
    before = float(abs(run[names[row - 1][0]]).max())
    return 0.0 * values if float(abs(values).max()) * duration < ROUND_OFF * before else values


def _body(run: xr.Dataset, bodies: list[str]) -> str:
    """The output body where its rotation is the output; with a slider as output a coupler, or the first body."""
    output = str(read_configuration(run).mechanism.output_body) if ATTRIBUTE in run.attrs else ""
    if output in bodies and SLIDER[0][0] not in run:
        return output
    return DEFAULT_BODY if DEFAULT_BODY in bodies else bodies[0]
