"""``scissordyn modes``: natural frequencies of a case, at its start or along its motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import CaseFile, Changes
from scissordyn.cli.output import check_file, check_folder
from scissordyn.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def modes(
    case: CaseFile,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help="Save the shapes: .nc.")] = None,
    count: Annotated[int, typer.Option(help="Number of modes, from the lowest.", min=1)] = 10,
    position: Annotated[
        str, typer.Option(help="static: bent by the loads, in equilibrium; concentric: as assembled, bars unbent.")
    ] = "static",
    joints: Annotated[
        str, typer.Option(help="ideal; contact: clearance joints with the stiffness of their contact at the static force.")
    ] = "ideal",
    drive: Annotated[
        str, typer.Option(help="locked; released: driven bodies move, under the constant torque that holds the position.")
    ] = "locked",
    until: Annotated[
        str | None, typer.Option(metavar="TIME", help="Along the motion of the drive up to this instant, as in '50 ms'.")
    ] = None,
    points: Annotated[int, typer.Option(help="Number of positions along the motion.", min=2, max=100_000)] = 21,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Draw shapes, and frequencies along the motion.")] = None,
    film: Annotated[Path | None, typer.Option("--animate", metavar="FILM", help="A mode as .html, .gif or .mp4.")] = None,
    mode: Annotated[int, typer.Option(help="Number of the mode that is animated.", min=1)] = 1,
    change: Changes = None,
) -> int:
    """Natural frequencies and mode shapes at the start or along the motion."""
    import numpy as np

    from scissordyn.cli.saved import seconds
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.run.answer.modes import modes as compute
    from scissordyn.run.store import save

    for option, given, allowed in (
        ("--position", position, ("static", "concentric")),
        ("--joints", joints, ("ideal", "contact")),
        ("--drive", drive, ("locked", "released")),
    ):
        if given not in allowed:
            raise InputError(f"{option} {given}", ", ".join(allowed), f"{option} {allowed[0]}")
    if film is not None:
        from scissordyn.plot.animation import check_film

        check_film(film)
        check_file(film, case, "mode.html")
    if plot is not None:
        check_folder(plot, "--plot figures")
    last = seconds(until, "--until")
    times = None if last is None else np.linspace(0.0, last, points)
    mechanism = read_case(case, change or []).mechanism
    found = compute(mechanism, count=count, position=position, joints=joints, drive=drive, times=times)  # type: ignore[arg-type]
    to = console()
    for line in (_table(found) if times is not None else _list(found)) + _contacts(found):
        to.print(line, markup=False)
    written = []
    if output is not None:
        save(found, output)
        written.append(output)
    first = found.isel(time=0) if times is not None else found
    if plot is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.modes import frequencies, shapes

        plot.mkdir(parents=True, exist_ok=True)
        drawn = {"shapes": shapes(found, mechanism)[0]} | ({} if times is None else {"frequencies": frequencies(found)})
        for name, axes in drawn.items():
            figure = axes.get_figure(root=True)
            assert figure is not None
            written.append(write(figure, plot / f"{name}.png"))
    if film is not None:
        from scissordyn.plot.animation import animate
        from scissordyn.plot.modes import oscillation

        written.append(animate(oscillation(first, mechanism.ideal(), mode), mechanism.ideal(), film, seconds=4.0))
    for path in written:
        to.print(str(path), markup=False)
    return 0


def _list(found: xr.Dataset) -> list[str]:
    """A line for each mode."""
    frequencies, angular, moved = (found[name].values for name in ("frequency", "angular_frequency", "shape"))
    lines = []
    for k, frequency in enumerate(frequencies.tolist()):
        most = found["body"].values[int((moved[k] ** 2).sum(axis=-1).argmax())]
        text = f"{frequency:12.6g} Hz" if frequency >= 0.0 else f"unstable, grows with {-angular[k]:.6g} 1/s"
        lines.append(f"mode {k + 1:3d}  {text}   moves '{most}' most")
    return lines


def _contacts(found: xr.Dataset) -> list[str]:
    """A line for each contact: what it carries, at the first position, and its stiffness."""
    if "contact" not in found.dims:
        return []
    first = found.isel(time=0) if "time" in found.dims else found
    lines = []
    for name, force, stiffness in zip(
        first["contact"].values, first["contact_force"].values, first["contact_stiffness"].values, strict=True
    ):
        carries = f"carries {force:.6g} N with {stiffness:.6g} N/m" if force > 0.0 else "carries nothing: it is free"
        lines.append(f"joint '{name}' {carries}")
    return lines


def _table(found: xr.Dataset) -> list[str]:
    """A line for each position: what the drive holds, and the frequencies."""
    import math

    angle = found["unit"].values[0] == "rad"
    held = found["input"].values[:, 0] * (180.0 / math.pi if angle else 1.0)
    head = f"{found['drive'].values[0]} [{'deg' if angle else 'm'}]"
    lines = [f"{head:>16}  frequencies [Hz]"]
    for value, row in zip(held.tolist(), found["frequency"].values.tolist(), strict=True):
        lines.append(f"{value:16.5g}  " + "  ".join(f"{number:9.5g}" for number in row))
    return lines
