"""Commands ``explore`` and ``import``: show a case in the browser; convert a linkage of another program to a case file."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from scissordyn.cli.option import Quiet, read_option
from scissordyn.cli.output import say
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, command

if TYPE_CHECKING:
    from scissordyn.explore.case import Case

REQUIRED_PACKAGES = ("websockets", "tomlkit")  # packages of the extra 'explore', which the explorer needs


def explore(
    case: Annotated[Path, Argument(help="A case file, a saved run, a study (study.db), or a bifurcation diagram.")],
    port: Annotated[int, Option(help="Port of the page; 0 for any free port.", min=0, max=65535)] = 0,
    address: Annotated[
        str, Option(help="Address to listen on; other machines can open the page unless it is local.")
    ] = "127.0.0.1",
    browser: Annotated[bool, Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    allow: Annotated[
        list[Path] | None,
        Option(metavar="FILE", help="Allow reading a file that the case names, and executing it if it is Python. Repeatable."),
    ] = None,
) -> int:
    missing = [name for name in REQUIRED_PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(f"the explorer needs {', '.join(missing)}", "the extra 'explore'", "pip install 'scissordyn[explore]'")
    if not case.exists():
        sample = f"scissordyn new scissor > {command(case)}" if case.suffix in ("", ".toml") else ""
        raise InputError(f"cannot read '{case}': no such file", "a case file or a saved run", sample)
    from scissordyn.explore.serve import bound_address, listen, serve

    listening = listen(address, port)
    if not bound_address(listening).is_loopback:
        print(
            f"Warning: with --address {address} everyone who can reach this machine and has the address below can change the "
            f"numbers of '{case.name}', keep the processor busy and download the case and its runs. Nothing is encrypted: "
            "anyone who can read the network's traffic can read the address too. No other file of this machine can be read or "
            "written through it.",
            file=sys.stderr,
        )

    def opened() -> Case:
        from scissordyn.explore.case import open_case

        return open_case(case, allow or [])

    def announce(url: str) -> None:
        print(f"{url}  (Ctrl-C ends it)", flush=True)

    try:
        serve(opened, listening, name=case.name, address=address, show=browser, announce=announce)
    finally:
        listening.close()
    return 0


def import_drawing(
    source: Annotated[
        str, Argument(help="A link of PMKS+, or a file that ends in .dxf, .xml, .urdf, .sdf, .linkage2, .slvs or .csv.")
    ],
    case: Annotated[Path, Option("--output", "-o", help="The case file to write.")],
    unit: Annotated[str, Option(help="Unit of a table, or of a DXF without unit, such as mm.")] = "",
    linear_density: Annotated[
        str, Option(metavar="QUANTITY", help="Mass per length of bars without a mass in the drawing.")
    ] = "1 kg/m",
    tolerance: Annotated[
        str,
        Option(
            metavar="LENGTH",
            help="Largest distance of line ends in a DXF that form one pin.",
            show_default="1e-6 of the drawing",
        ),
    ] = "",
    thickness: Annotated[str, Option(metavar="LENGTH", help="Thickness of parts that a DXF draws by their outlines.")] = "",
    density: Annotated[str, Option(metavar="QUANTITY", help="Density of these parts, such as '7850 kg/m^3'.")] = "",
    until: Annotated[str, Option(metavar="TIME", help="Simulated time of the case.")] = "1 s",
    quiet: Quiet = False,
) -> int:
    from scissordyn.casefile.case_text import FIRST_LINE
    from scissordyn.casefile.quantity import read_quantity
    from scissordyn.config.file import write_case
    from scissordyn.exchange.read import read_drawing
    from scissordyn.file.output_file import check_target
    from scissordyn.model.options import Options
    from scissordyn.units import Quantity

    check_target(case, sample="-o case.toml", beginning=FIRST_LINE.encode())
    dxf_texts = {"tolerance": (tolerance, "m"), "thickness": (thickness, "m"), "density": (density, "kg/m^3")}
    of_dxf = {name: read_quantity(text, Quantity(unit, above=0.0)) for name, (text, unit) in dxf_texts.items() if text}
    per_length = read_quantity(linear_density, Quantity("kg/m", above=0.0))
    end = read_option(until, "--until")
    drawing = read_drawing(source, unit=unit, linear_density=per_length, **of_dxf)
    written = write_case(drawing.mechanism, case, run=Options(until=end))
    if not quiet:
        say(*(f"note: {note}" for note in drawing.notes), soft_wrap=True)
        say(written)
    return 0
