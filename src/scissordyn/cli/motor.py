"""``scissordyn motor``: torque over speed of a case, against the curve of a motor, and the least limit that is enough."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import CaseFile, Changes
from scissordyn.errors import InputError, printable

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.analysis.motor import MotorCurve
    from scissordyn.config.case import Case

LEAST = "--least servo.controller.limit --from '5 N m' --to '100 N m' --require 'tip.error < 5 mm'"


def motor(
    case: CaseFile,
    of: Annotated[str, typer.Option(help="Actuator or motor of the case, or drive; not needed if there is one only.")] = "",
    point: Annotated[
        list[str] | None,
        typer.Option(metavar="SPEED,TORQUE", help="Of the motor's curve, as in '100 rpm, 60 N m'. Repeatable."),
    ] = None,
    ratio: Annotated[float, typer.Option(help="Turns of the motor for one of the joint.", min=1e-6)] = 1.0,
    least: Annotated[str, typer.Option(metavar="ADDRESS", help="Search for the least value of this number.")] = "",
    first: Annotated[str, typer.Option("--from", metavar="VALUE", help="Smallest value of it, with its unit.")] = "",
    last: Annotated[str, typer.Option("--to", metavar="VALUE", help="Largest value of it, with its unit.")] = "",
    require: Annotated[
        list[str] | None, typer.Option(metavar="REQUIREMENT", help="That it has to meet, as in 'tip.error < 5 mm'. Repeatable.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw torque over speed into this file.")] = None,
    change: Changes = None,
) -> int:
    """Torque and speed that a case needs, what of a motor's curve that is, and the least limit that is enough."""
    from scissordyn.analysis.motor import torque_over_speed
    from scissordyn.cli.output import check_file
    from scissordyn.config.file import read_case
    from scissordyn.config.motor import read_motor

    if plot is not None:
        from scissordyn.plot.file import check_format

        check_format(plot.suffix.lower().removeprefix("."))
        check_file(plot, case, "--plot motor.png")
    curve = read_motor(point, of, ratio) if point else None
    if bool(least) != bool(first and last and require) or (not least and (first or last or require)):
        raise InputError("a search for the least value", "--least, --from, --to and --require together", LEAST)
    described = read_case(case, change or [])
    from scissordyn.run.simulate import simulate

    options = described.run.once if plot is None else described.run
    run = simulate(described.mechanism, **{**options.keywords, "trust": False})
    needed = torque_over_speed(run, of)
    _show(needed, curve)
    if least:
        _least(described, least, first, last, require or [])
    if plot is not None:
        print(_drawn(needed, curve, plot))
    return 0


def _show(needed: xr.Dataset, curve: MotorCurve | None) -> None:
    import math

    import numpy as np

    torque, speed, power = (needed[name].values for name in ("torque", "speed", "power"))
    k, rpm = int(np.argmax(np.abs(torque))), 30.0 / math.pi
    time = needed["time"].values
    print(f"Torque of {printable(needed.attrs['of'])} on '{printable(needed.attrs['body'])}', from 0 to {time[-1]:g} s:")
    print(f"  largest torque {abs(torque[k]):.4g} N m at {abs(speed[k]) * rpm:.4g} rpm, at {time[k]:.4g} s")
    print(f"  root mean square {math.sqrt(float(np.trapezoid(torque**2, time) / (time[-1] - time[0]))):.4g} N m")
    print(f"  largest speed {np.max(np.abs(speed)) * rpm:.4g} rpm, largest power {np.max(np.abs(power)):.4g} W")
    if curve is None:
        return
    share = curve.fraction(needed)
    worst = int(np.argmax(share))
    where = f"at {abs(speed[worst]) * rpm:.4g} rpm and {abs(torque[worst]):.4g} N m, at {time[worst]:.4g} s"
    if math.isinf(share[worst]):
        print(f"The motor is too slow: its curve ends at {curve.speeds[-1] / curve.ratio * rpm:.4g} rpm of the joint; {where}")
    else:
        verdict = "is enough" if share[worst] <= 1.0 else "is too weak"
        print(f"The motor {verdict}: the run needs {share[worst]:.1%} of its torque, {where}")


def _least(described: Case, address: str, first: str, last: str, require: list[str]) -> None:
    from scissordyn.config.least import least_value
    from scissordyn.config.quantity import read_quantity, unit_factor, unit_typed
    from scissordyn.model.address import number

    quantity = number(described.mechanism, address).quantity
    assert quantity is not None
    ends = [read_quantity(text if quantity.unit != "1" else float(text), quantity, LEAST) for text in (first, last)]
    found = least_value(described, address, ends[0], ends[1], require)
    unit = unit_typed(last) or unit_typed(first)
    scale = unit_factor(unit, quantity.unit) if unit else 1.0
    print(
        f"Least {printable(address)}: {found.value / scale:.4g} {unit}, with which all requirements are met; at "
        f"{found.fails_at / scale:.4g} {unit} they are not ({len(found.tried)} values tried)"
    )


def _drawn(needed: xr.Dataset, curve: MotorCurve | None, path: Path) -> Path:
    import numpy as np

    from scissordyn.plot.file import write
    from scissordyn.plot.motor import torque_speed

    speeds = None if curve is None else np.array(curve.speeds) / curve.ratio
    torques = None if curve is None else np.array(curve.torques) * curve.ratio
    figure = torque_speed(needed, speeds=speeds, torques=torques)[0].get_figure(root=True)
    assert figure is not None
    return write(figure, path)
