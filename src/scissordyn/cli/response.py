"""Commands ``statics``, ``modes``, ``motor`` and ``bifurcation``: analyses of a case other than a run."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from scissordyn.casefile.quantity import unit_factor, unit_typed
from scissordyn.cli.option import (
    CaseFile,
    Changes,
    EngineOptions,
    QueueFile,
    Scheduler,
    ThreadCount,
    WorkerCount,
    read_option,
    value_of,
)
from scissordyn.cli.output import (
    DONE,
    EXIT_STATUSES,
    INTERRUPTED,
    PROGRESS_TEXT,
    UNFINISHED,
    bars,
    check_file,
    check_folder,
    check_movie,
    check_picture,
    check_run,
    say,
)
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, command, did_you_mean, printable
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import rpm, short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.analysis.motor import MotorCurve
    from scissordyn.casefile.case import Case
    from scissordyn.model.mechanism import Mechanism

# Options of a search for the smallest sufficient value, for error messages
LEAST_EXAMPLE = "--least servo.controller.limit --from '5 N m' --to '100 N m' --require 'tip.error < 5 mm'"


def statics(
    case: CaseFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Save all results (.nc) or the table of forces (.csv).")
    ] = None,
    points: Annotated[int, Option(help="Number of positions.", min=2, max=100_000)] = 201,
    until: Annotated[str | None, Option(metavar="TIME", help="End of the stroke; by default that of the run.")] = None,
    friction: Annotated[
        str, Option(help="Friction of a slow motion: none, forward (as the drives move) or backward.")
    ] = "none",
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw the forces to this .svg or .png file.")] = None,
    over: Annotated[
        str, Option(help="Horizontal axis of the picture: time, input, or a coordinate of a tracked point such as table.x.")
    ] = "input",
    change: Changes = None,
) -> int:
    from scissordyn.config.file import read_case
    from scissordyn.equilibrium.statics import statics as compute

    if output is not None and output.suffix.lower() not in (".nc", ".csv"):
        raise InputError(f"wrong ending of -o {output}", "a name that ends in .nc or .csv", "-o statics.csv")
    check_file(output, case, "statics.nc")
    check_picture(plot, case, "statics.png")
    read = read_case(case, change or [])
    last = read_option(until, "--until")
    solved = compute(read.mechanism, until=read.run.until if last is None else last, points=points, friction=friction)  # type: ignore[arg-type]
    drawn = None
    if plot is not None:
        from scissordyn.plot.stroke import statics as draw

        drawn = draw(solved, over=over)
    say(*_force_table(solved), *_bars(solved), highlight=False, soft_wrap=True)
    say(*(f"Warning: {warning}." for warning in json.loads(solved.attrs["warnings"])))
    if plot is not None and drawn is not None:
        from scissordyn.plot.file import write

        say(write(drawn, plot))
    if output is not None:
        say(_save_forces(solved, output))
    return 0


def _force_table(solved: xr.Dataset) -> list[str]:
    """Return a heading and a line for each force: its extreme values, each with the position of the first drive there."""
    import numpy as np

    from scissordyn.plot.scale import engineering

    names = solved["quantity"].values.tolist()
    width = max(map(len, names), default=8)
    factor, unit = (180.0 / math.pi, "deg") if str(solved["prescribed_unit"].values[0]) == "rad" else (1e3, "mm")
    time, stroke = solved["time"].values, factor * solved["input"].values[:, 0]
    lines = [f"{'':{width}}  {'least':>12} {'at':>13}  {'largest':>12} {'at':>13}"]
    units = solved["quantity_unit"].values.tolist()
    sizes = np.fmax(*(np.abs(solved[end].values) for end in ("least", "largest")))
    round_off = {unit: ROUND_OFF_TOL * np.nanmax(sizes[np.array(units) == unit], initial=0.0) for unit in set(units)}
    for k, name in enumerate(names):
        ends = [float(solved[end].values[k]) for end in ("least", "largest")]
        ends = [0.0 if abs(end) < round_off[units[k]] else end for end in ends]
        if not all(map(math.isfinite, ends)):
            lines.append(f"{name:{width}}  not determined")
            continue
        scale = engineering(units[k], ends)
        cells = [f"{scale.text(end)} {scale.unit}" for end in ends]
        at = [f"{np.interp(solved[f'{end}_time'].values[k], time, stroke):.5g} {unit}" for end in ("least", "largest")]
        lines.append(f"{name:{width}}  {cells[0]:>12} {at[0]:>13}  {cells[1]:>12} {at[1]:>13}")
    return lines


def _bars(solved: xr.Dataset) -> list[str]:
    """Return a line for each flexible bar."""
    lines = []
    for beam in solved["bar"].values.tolist() if "bar" in solved else ():
        sizes = [
            f"{name.replace('_', ' ')} {short(abs(float(solved[f'bar_largest_{name}'].sel(bar=beam))), unit)}"
            for name, unit in (("axial_force", "N"), ("bending_moment", "N m"), ("stress", "Pa"), ("deflection", "m"))
        ]
        lines.append(f"bar {beam}: largest {', '.join(sizes)}")
    return lines


def _save_forces(solved: xr.Dataset, path: Path) -> Path:
    """Write all results to a NetCDF file, or the table of forces to a CSV file."""
    if path.suffix.lower() == ".nc":
        from scissordyn.record.store import save

        return save(solved, path)
    import numpy as np

    from scissordyn.file.output_file import csv_text, write_file

    head = ["time [s]"]
    for kind, unit in (("prescribed", "prescribed_unit"), ("quantity", "quantity_unit")):
        head += [f"{name} [{of}]" for name, of in zip(solved[kind].values, solved[unit].values, strict=True)]
    rows = np.column_stack([solved["time"].values, solved["input"].values, solved["quantity_value"].values])
    return write_file(path, csv_text([head, *rows.tolist()]).encode(), sample="-o statics.csv")


def modes(
    case: CaseFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Save the mode shapes to this NetCDF file.")
    ] = None,
    count: Annotated[int, Option(help="Number of modes, beginning with the lowest.", min=1)] = 10,
    position: Annotated[
        str, Option(help="Position: static (in equilibrium with the loads) or concentric (as assembled, undeformed bars).")
    ] = "static",
    joints: Annotated[
        str, Option(help="Clearance joints: ideal, or contact (with the contact stiffness at the static force).")
    ] = "ideal",
    drive: Annotated[
        str, Option(help="Drives: locked, or released (driven bodies move under the constant torque that holds the position).")
    ] = "locked",
    until: Annotated[
        str | None,
        Option(metavar="TIME", help="Compute modes along the motion of the drive up to this instant, such as '50 ms'."),
    ] = None,
    points: Annotated[int, Option(help="Number of positions along the motion.", min=2, max=100_000)] = 21,
    plot: Annotated[
        Path | None, Option(metavar="DIR", help="Draw mode shapes, and frequencies along the motion, into this folder.")
    ] = None,
    film: Annotated[
        Path | None, Option("--animate", metavar="FILM", help="Animate a mode to this .html, .gif or .mp4 file.")
    ] = None,
    mode: Annotated[int, Option(help="Number of the animated mode.", min=1)] = 1,
    change: Changes = None,
) -> int:
    import numpy as np

    from scissordyn.config.file import read_case
    from scissordyn.equilibrium.modes import modes as compute
    from scissordyn.record.store import save

    check_movie(film, case, "mode.html")
    check_folder(plot, "--plot figures")
    last = read_option(until, "--until")
    times = None if last is None else np.linspace(0.0, last, points)
    mechanism = read_case(case, change or []).mechanism
    solved = compute(mechanism, count=count, position=position, joints=joints, drive=drive, times=times)  # type: ignore[arg-type]
    first = solved if times is None else solved.isel(time=0)
    notes = [f"Warning: {text}." for text in json.loads(solved.attrs["warnings"])]
    say(*(_modes(solved) if times is None else _frequencies(solved)), *_contacts(first), *notes)
    if output is not None:
        save(solved, output)
        say(output)
    if plot is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.modes import frequencies, shapes

        plot.mkdir(parents=True, exist_ok=True)
        say(write(shapes(solved, mechanism), plot / "shapes.png"))
        if times is not None:
            say(write(frequencies(solved), plot / "frequencies.png"))
    if film is not None:
        from scissordyn.plot.animation import animate
        from scissordyn.plot.modes import oscillation

        ideal = mechanism.ideal()
        say(animate(oscillation(first, ideal, mode), ideal, film, seconds=4.0))
    return 0


def _modes(solved: xr.Dataset) -> list[str]:
    """Return a line for each mode."""
    lines = []
    names = ("frequency", "angular_frequency", "shape", "rotation", "damping_ratio", "damped_frequency")
    columns = (solved[name].values for name in names)
    for k, (frequency, angular, shape, rotation, ratio, damped) in enumerate(zip(*columns, strict=True)):
        moved = (shape**2).sum(axis=-1)
        # a shape is scaled by its largest displacement, or by its largest rotation where all mass centres rest
        most = solved["body"].values[int((moved if moved.max() > 0.5 else rotation**2).argmax())]
        text = f"{frequency:12.6g} Hz" if frequency >= 0.0 else f"unstable, grows with {-angular:.6g} 1/s"
        damping = f"   damping ratio {ratio:.4g}" if abs(ratio) > 0.0 else ""  # NaN without a restoring force
        damping += f" at {damped:.6g} Hz" if damping and damped > 0.0 else ""
        lines.append(f"mode {k + 1:3d}  {text}   moves '{most}' most{damping}")
    return lines


def _contacts(first: xr.Dataset) -> list[str]:
    """Return a line for each contact with its force and stiffness at the first position of the motion."""
    if "contact" not in first.dims:
        return []
    columns = (first[name].values.tolist() for name in ("contact", "contact_force", "contact_stiffness"))
    return [
        f"joint '{name}' "
        + (f"carries {force:.6g} N with {stiffness:.6g} N/m" if force > 0.0 else "carries nothing: it is free")
        for name, force, stiffness in zip(*columns, strict=True)
    ]


def _frequencies(solved: xr.Dataset) -> list[str]:
    """Return a line for each position: the coordinate of the drive, and the frequencies; then one about unstable positions."""
    import numpy as np

    factor, unit = (180.0 / math.pi, "deg") if solved["unit"].values[0] == "rad" else (1.0, "m")
    drive = f"{solved['drive'].values[0]} [{unit}]"
    rows = zip((factor * solved["input"].values[:, 0]).tolist(), solved["frequency"].values.tolist(), strict=True)
    lines = [f"{drive:>16}  frequencies [Hz]"] + [
        f"{place:16.5g}  " + "  ".join(f"{frequency:9.5g}" for frequency in row) for place, row in rows
    ]
    unstable = np.flatnonzero(solved["frequency"].values.min(axis=1) < 0.0)
    if unstable.size:
        fastest = -float(solved["angular_frequency"].min())
        lines.append(
            f"Unstable at {unstable.size} of {solved.sizes['time']} positions: a negative value is minus the growth rate over "
            f"2 pi, up to {fastest:.6g} 1/s"
        )
    return lines


def motor(
    case: CaseFile,
    of: Annotated[str, Option(help="Name of an actuator or motor, or drive; not needed if there is only one.")] = "",
    point: Annotated[
        list[str] | None,
        Option(metavar="SPEED,TORQUE", help="Point of the motor's curve, such as '100 rpm, 60 N m'. Repeatable."),
    ] = None,
    ratio: Annotated[float, Option(help="Gear ratio: turns of the motor per turn of the joint.", min=1e-6)] = 1.0,
    least: Annotated[str, Option(metavar="PARAMETER", help="Search for the smallest sufficient value of this parameter.")] = "",
    first: Annotated[str, Option("--from", metavar="VALUE", help="Lower end of the search, with its unit.")] = "",
    last: Annotated[str, Option("--to", metavar="VALUE", help="Upper end of the search, with its unit.")] = "",
    require: Annotated[
        list[str] | None,
        Option(metavar="REQUIREMENT", help="Requirement of the search, such as 'tip.error < 5 mm'. Repeatable."),
    ] = None,
    plot: Annotated[Path | None, Option(help="Draw torque over speed into this file.")] = None,
    change: Changes = None,
) -> int:
    from scissordyn.analysis.motor import end_of_fall, torque_over_speed
    from scissordyn.cli.show import warning_texts
    from scissordyn.config.file import read_case
    from scissordyn.config.study import read_motor
    from scissordyn.run.simulate import simulate

    check_picture(plot, case, "--plot motor.png")
    curve = read_motor(point, of, ratio) if point else None
    if bool(least) != bool(first and last and require) or (not least and (first or last or require)):
        raise InputError("a search without all of its options", "--least, --from, --to and --require together", LEAST_EXAMPLE)
    read = read_case(case, change or [])
    _check_turned(read.mechanism, case)
    ends = _search_range(read, least, first, last) if least else None
    options = read.run.equally_spaced if plot is None else read.run
    done = simulate(read.mechanism, **{**options.keywords, "trust": False})
    needed, status = torque_over_speed(done, of), done.attrs["status"]
    _print_needed(needed, curve if status == "complete" else None, end_of_fall(done))
    say(*warning_texts(done, read.mechanism))
    if status != "complete":
        print(f"scissordyn: {printable(done.attrs['cause'])}", file=sys.stderr)
    if ends is not None and status != "interrupted":
        _print_least(read, least, ends, unit_typed(last) or unit_typed(first), require or [])
        status = "complete"
    if plot is not None:
        import numpy as np

        from scissordyn.plot.file import write
        from scissordyn.plot.over_time import torque_speed

        speeds = None if curve is None else np.array(curve.speeds) / curve.ratio
        torques = None if curve is None else np.array(curve.torques) * curve.ratio
        print(write(torque_speed(needed, speeds=speeds, torques=torques), plot))
    return EXIT_STATUSES[status]


def _print_needed(needed: xr.Dataset, curve: MotorCurve | None, fall: float) -> None:
    """Print torque, speed and power; `fall` is the instant [s] until which journals fall and bounce."""
    import numpy as np

    torque, speed, power, time = (needed[name].values for name in ("torque", "speed", "power", "time"))
    k = int(np.argmax(np.abs(torque)))
    print(f"Torque of {printable(needed.attrs['of'])} on '{printable(needed.attrs['body'])}', from 0 to {time[-1]:g} s:")
    print(f"  largest torque {abs(torque[k]):.4g} N m at {abs(speed[k]) / rpm(1.0):.4g} rpm, at {time[k]:.4g} s")
    if time[k] < fall < time[-1]:
        after = np.flatnonzero(time >= fall)
        later = after[np.argmax(np.abs(torque[after]))]
        say(
            f"  Until {fall:.4g} s journals fall from the centres of their bearings and bounce; from then on at most "
            f'{abs(torque[later]):.4g} N m, at {time[later]:.4g} s. start = "in-contact" leaves the fall out.'
        )
    print(f"  root mean square {needed['root_mean_square'].item():.4g} N m")
    fastest, strongest = np.max(np.abs(speed)) / rpm(1.0), np.max(np.abs(power))
    print(f"  largest speed {fastest:.4g} rpm, largest power {strongest:.4g} W, at {time.size} recorded instants")
    if curve is None:
        return
    share = curve.fraction(needed)
    worst = int(np.argmax(share))
    where = f"at {abs(speed[worst]) / rpm(1.0):.4g} rpm and {abs(torque[worst]):.4g} N m, at {time[worst]:.4g} s"
    if math.isinf(share[worst]):
        end = curve.speeds[-1] / curve.ratio / rpm(1.0)
        print(f"The motor is too slow: its curve ends at {end:.4g} rpm of the joint; {where}")
    else:
        verdict = "is enough" if share[worst] <= 1.0 else "is too weak"
        print(f"The motor {verdict}: the run needs {share[worst]:.1%} of its torque, {where}")


def _check_turned(mechanism: Mechanism, case: Path) -> None:
    """Raise `InputError` if no drive, controller or motor turns a body; `statics` has the forces of a jack."""
    from scissordyn.components.actuator import Actuator
    from scissordyn.components.motor import Motor
    from scissordyn.components.tabulated_motor import TabulatedMotor

    if mechanism.drives or any(isinstance(part, Actuator | Motor | TabulatedMotor) for part in mechanism.components):
        return
    pushed = bool(mechanism.coordinate_drives) or any(rod.motion for rod in mechanism.rods)
    raise InputError(
        f"{printable(str(case))}: nothing turns a body, so that no torque is needed",
        "[drive], [control] or [[motor]]" + ("; the force of a jack is a result of statics" if pushed else ""),
        command("scissordyn", "statics", case) if pushed else '[drive] and speed = "10 rpm"',
    )


def _search_range(read: Case, path: str, first: str, last: str) -> tuple[float, float]:
    """Return both ends of the search for the least value in SI units; raise `InputError` if the range is empty."""
    from scissordyn.model.parameter_path import number

    quantity = number(read.mechanism, path).quantity
    assert quantity is not None
    low, high = value_of(first, quantity, "--from"), value_of(last, quantity, "--to")
    if low >= high:
        raise InputError(f"--from '{first}' --to '{last}': the range is empty", "--from below --to", LEAST_EXAMPLE)
    return low, high


def _print_least(read: Case, path: str, ends: tuple[float, float], unit: str, require: list[str]) -> None:
    from scissordyn.config.fits import least_value
    from scissordyn.model.parameter_path import number

    quantity = number(read.mechanism, path).quantity
    assert quantity is not None
    scale = unit_factor(unit, quantity.unit) if unit else 1.0

    def report(tried: int, failing: float, sufficient: float) -> None:
        print(f"{tried} values tried: between {failing / scale:.4g} and {sufficient / scale:.4g} {unit}", file=sys.stderr)

    progress = report if sys.stderr.isatty() else None
    least = least_value(read, path, *ends, require, progress=progress)
    print(
        f"Least {printable(path)}: {least.value / scale:.4g} {unit}, with which all requirements are met; at "
        f"{least.fails_at / scale:.4g} {unit} they are not ({len(least.tried)} values tried)"
    )


def bifurcation(
    case: Annotated[Path, Argument(help="A case file with a periodic drive.")],
    over: Annotated[str, Option(help="The varied parameter, such as A.clearance or drive.angular_frequency.")],
    first: Annotated[str, Option("--from", metavar="VALUE", help="First value, with its unit.")],
    last: Annotated[str, Option("--to", metavar="VALUE", help="Last value, with its unit.")],
    points: Annotated[int, Option("--points", "--values", metavar="N", help="Number of values of the parameter.", min=2)] = 300,
    cycles: Annotated[int, Option(help="Periods of the drive to run for each value.", min=1)] = 200,
    keep: Annotated[int | None, Option(help="Number of last periods to keep; by default half.", min=1)] = None,
    follow: Annotated[bool, Option("--follow", help="Start each value from the end of the previous one.")] = False,
    tolerance: Annotated[float, Option(help="Relative tolerance.", min=1e-14, max=1e-2)] = 1e-6,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    output: Annotated[
        Path | None, Option("-o", "--output", help="Save the diagram to this NetCDF file; an unfinished diagram is continued.")
    ] = None,
    change: Changes = None,
    plot: Annotated[Path | None, Option(help="Draw the diagram into this file.")] = None,
    variable: Annotated[str, Option(help="The variable to draw.")] = "",
) -> int:
    import numpy as np

    from scissordyn.config.file import read_case
    from scissordyn.model.parameter_path import number
    from scissordyn.periodic.bifurcation import bifurcation as compute
    from scissordyn.periodic.bifurcation import check_diagram
    from scissordyn.periodic.cycles import recorded_names

    check_run(output, case, "-o diagram.nc")
    check_picture(plot, case, "--plot diagram.png")
    read = read_case(case, list(change or []))
    quantity = number(read.mechanism, over).quantity
    assert quantity is not None
    variables = recorded_names(read.mechanism)
    if variable and variable not in variables:
        what = f"unknown variable in --variable '{variable}'{did_you_mean(variable, variables)}"
        sample = command("--variable", variables[0])
        raise InputError(what, ", ".join(variables), sample)
    keep = max(1, cycles // 2) if keep is None else keep
    check_diagram(points, cycles, keep)
    ends = value_of(first, quantity, "--from"), value_of(last, quantity, "--to")
    unit = unit_typed(last) or unit_typed(first)
    columns = (PROGRESS_TEXT, "BarColumn", "MofNCompleteColumn", "TimeRemainingColumn")
    with EngineOptions(threads, workers, scheduler, cluster).engine() as engine, bars(*columns) as update:
        diagram = compute(
            read.mechanism,
            over=over,
            values=np.linspace(*ends, points),
            cycles=cycles,
            keep=keep,
            follow=follow,
            start=read.run.start,
            rtol=tolerance,
            method=read.run.method,
            engine=engine,
            store=output,
            progress=None if update is None else lambda done, total: update("values", completed=done, total=total),
            shown=(unit, unit_factor(unit, quantity.unit)) if unit else None,
        )
    return _print_diagram(diagram, output, plot, variable)


def _print_diagram(diagram: xr.Dataset, output: Path | None, plot: Path | None, variable: str) -> int:
    states = diagram["status"].values.tolist()
    done, total = int(diagram["completed_cycles"].sum()), len(states)
    print(
        f"{states.count('complete')} of {total} values of {printable(diagram.attrs['parameter'])} complete, {done} cycles, "
        f"{diagram.attrs['wall_seconds']:.1f} s; {diagram.attrs['cycles_per_second']:.0f} cycles per second and processor"
    )
    for warning in json.loads(diagram.attrs["warnings"]):
        print(f"Warning: {printable(warning)}")
    if output is not None:
        print(f"Saved to {output}" + ("" if states.count("complete") == total else f", marked {diagram.attrs['status']}"))
    if diagram.attrs["status"] == "interrupted":
        further = "; the same command continues from the file" if output else ""
        print(f"scissordyn: interrupted{further}", file=sys.stderr)
        return INTERRUPTED
    if plot is not None and "complete" in states:
        from scissordyn.plot.file import write
        from scissordyn.plot.regularity import bifurcation as draw

        print(write(draw(diagram, variable=variable), plot))
    if "failed" not in states:
        return DONE
    from scissordyn.plot.scale import scale_of

    first = states.index("failed")
    value, cause = (
        scale_of(diagram["value"]).with_unit(float(diagram["value"][first]), 6),
        printable(diagram["cause"].values[first]),
    )
    print(f"scissordyn: {states.count('failed')} of {total} values failed; the first, {value}: {cause}", file=sys.stderr)
    return UNFINISHED
