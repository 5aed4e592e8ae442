"""The entry point: errors become one line and an exit status."""

from __future__ import annotations

import contextlib
import functools
import gc
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import Annotated, Any

import typer

from scissordyn import __version__
from scissordyn.cli.animate import animate
from scissordyn.cli.bifurcation import bifurcation
from scissordyn.cli.check import check
from scissordyn.cli.cite import cite
from scissordyn.cli.compare import compare
from scissordyn.cli.controllers import controllers
from scissordyn.cli.examples import examples
from scissordyn.cli.explore import explore
from scissordyn.cli.export import export
from scissordyn.cli.fit import fit
from scissordyn.cli.import_ import import_drawing
from scissordyn.cli.interrupt import install, received
from scissordyn.cli.laws import laws
from scissordyn.cli.modes import modes
from scissordyn.cli.motor import motor
from scissordyn.cli.new import new
from scissordyn.cli.paper import paper
from scissordyn.cli.plot import plot
from scissordyn.cli.preview import preview
from scissordyn.cli.run import run as run_case
from scissordyn.cli.schema import schema
from scissordyn.cli.statics import statics
from scissordyn.cli.status import BAD_INPUT, BUG, DONE, INTERRUPTED
from scissordyn.cli.streams import give_up, prepare_streams
from scissordyn.cli.study import study
from scissordyn.cli.sweep import sweep
from scissordyn.cli.zoo import zoo
from scissordyn.errors import ScissordynError, printable, shortened

app = typer.Typer(
    name="scissordyn",
    help="Dynamics of deployable scissor structures with clearance joints.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"scissordyn {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Dynamics of deployable scissor structures with clearance joints."""


STOPPED = "interrupted"

_returned: list[int] = []
"""What a command has returned, which says on its own that it was interrupted; what typer makes of Ctrl-C elsewhere does not."""


class NothingComputedError(Exception):
    """Ctrl-C outside the simulation, which handles it itself and returns its results."""


class ClosedPipeError(Exception):
    """The reader of a pipe has closed it, as in "scissordyn laws | head -1"; typer would end the process with status 1."""


def _guarded(command: Callable[..., int]) -> Callable[..., int]:
    """The command, with Ctrl-C and a closed pipe as errors that typer does not catch."""

    @functools.wraps(command)
    def guarded(*arguments: Any, **options: Any) -> int:
        try:
            _returned.append(command(*arguments, **options))
        except KeyboardInterrupt:
            raise NothingComputedError from None
        except BrokenPipeError:
            raise ClosedPipeError from None
        return _returned[-1]

    return guarded


COMMANDS: dict[str, Callable[..., int]] = {
    "run": run_case,
    "check": check,
    "preview": preview,
    "statics": statics,
    "modes": modes,
    "motor": motor,
    "explore": explore,
    "plot": plot,
    "animate": animate,
    "compare": compare,
    "import": import_drawing,
    "cite": cite,
    "fit": fit,
    "export": export,
    "new": new,
    "examples": examples,
    "zoo": zoo,
    "schema": schema,
    "laws": laws,
    "controllers": controllers,
    "bifurcation": bifurcation,
    "sweep": sweep,
    "study": study,
    "paper": paper,
}

EXAMPLES: dict[str, str] = {
    "run": "scissordyn run case.toml -o run.nc --plot pictures --trust",
    "check": "scissordyn check case.toml --set drive.speed='250 rpm'",
    "preview": "scissordyn preview case.toml -o picture.svg --curves curves.svg",
    "explore": "scissordyn explore case.toml",
    "plot": "scissordyn plot run.nc -o pictures --only force,orbit --joint A",
    "animate": "scissordyn animate run.nc film.html",
    "compare": "scissordyn compare a.nc b.nc -o pictures",
    "import": "scissordyn import linkage.dxf --unit mm -o case.toml",
    "cite": "scissordyn cite run.nc -o references.bib",
    "fit": "scissordyn fit case.toml --data decay.csv --free arm.inertia --free pivot.damping --segment '2 s' -o fit.nc",
    "export": "scissordyn export run.nc table.csv",
    "statics": "scissordyn statics case.toml --plot forces.png -o forces.csv",
    "modes": "scissordyn modes case.toml --until '1 s' --plot figures",
    "motor": "scissordyn motor case.toml --point '0 rpm, 60 N m' --point '300 rpm, 0 N m' --plot motor.png",
    "new": "scissordyn new scissor --with servo,tip > case.toml",
    "examples": "scissordyn examples paper > case.toml",
    "zoo": "scissordyn zoo peaucellier --case > case.toml",
    "schema": "scissordyn schema case -o case.json",
    "laws": "scissordyn laws flores --plot law.png",
    "controllers": "scissordyn controllers pid",
    "bifurcation": "scissordyn bifurcation case.toml --over A.clearance --from '0.1 mm' --to '0.7 mm' -o diagram.nc",
    "sweep": "scissordyn sweep case.toml --vary A.clearance='0.1..0.4 mm' --points 16 -o sweep.db",
    "study": "scissordyn study study.toml -o study.db",
    "paper": "scissordyn paper -o out --figure 9",
}
"""Of each command one that can be typed, below its help."""

OTHER_WORDS = {
    "simulate": "run",
    "draw": "plot",
    "film": "animate",
    "view": "explore",
    "open": "explore",
    "template": "new",
    "equilibrium": "statics",
}
"""Words that users try in place of a command."""

OPTION_KEYS = ("until", "start", "rtol", "atol", "method", "most_steps", "events", "step")
"""Keys of [run] that users try as options of a command."""

for _name, _command in COMMANDS.items():
    app.command(_name, epilog=f"Example: {EXAMPLES[_name]}")(_guarded(_command))

# depending on its version typer has its own copy of click or uses the installed one: this is ClickException in both
USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[2]


def run() -> None:
    """Run the command line of this process and exit with its status."""
    # without this a third of a short command's time is garbage collection, among freshly loaded libraries and at
    # the end, when the system frees all memory anyway
    gc.set_threshold(200_000)
    install()
    prepare_streams()
    try:
        status = status_of(sys.argv[1:])
    except KeyboardInterrupt:
        status = _complain(STOPPED, INTERRUPTED)
    gc.freeze()
    if status == INTERRUPTED and received():
        status = 128 + received()
    for name in ("stdout", "stderr"):
        try:
            getattr(sys, name).flush()
        except OSError:  # the error is printed already, there is no room for it, or the pipe is closed
            give_up(name)
    sys.exit(status)


def status_of(arguments: Sequence[str]) -> int:
    """Run one command."""
    _returned.clear()
    try:
        status = int(app(list(arguments) or ["--help"], standalone_mode=False) or 0)
        if status == INTERRUPTED and not _returned:
            raise KeyboardInterrupt
        sys.stdout.flush()
        return status
    except ScissordynError as error:
        return _complain(str(error), BAD_INPUT)
    except USAGE_ERROR as error:
        return _complain(_usage(error, arguments), BAD_INPUT)
    except (NothingComputedError, KeyboardInterrupt):
        return _complain(STOPPED, INTERRUPTED)
    except (ClosedPipeError, BrokenPipeError, SystemExit):  # typer's own answer to it, while it prints a help, is to exit
        give_up("stdout")
        return DONE
    except OSError as error:  # a full standard output, a name that is too long, a folder that may not be read
        return _complain(_refused(error), BAD_INPUT)
    except MemoryError as error:
        return _complain(f"the memory of this machine is not enough: {error or 'no details'}", BAD_INPUT)
    except Exception as error:  # the output is one line only
        if received():
            return _complain(STOPPED, INTERRUPTED)
        hint = "" if os.environ.get("SCISSORDYN_TRACEBACK") else "; a fault of scissordyn: SCISSORDYN_TRACEBACK=1 shows where"
        return _complain(f"{type(error).__name__}: {error}{hint}", BUG)


def _usage(error: Exception, arguments: Sequence[str]) -> str:
    """What typer says of the words of a command, and the command that a word of another program means."""
    said = str(error.format_message()).rstrip(".")  # type: ignore[attr-defined]
    first = next((word for word in arguments if not word.startswith("-")), "")
    near = [OTHER_WORDS[first]] if first in OTHER_WORDS else []
    near = near or [OTHER_WORDS[word] for word in get_close_matches(first, OTHER_WORDS, n=1, cutoff=0.6)]
    if "No such command" in said and near and (first in OTHER_WORDS or "Did you mean" not in said):
        said = f"No such command '{first}' (did you mean '{near[0]}'?)"
    if said.startswith("Missing") and first in EXAMPLES:
        return f"{said}; type: {EXAMPLES[first]}"
    option = re.match(r"No such option:? '?--([\w-]+)", said)
    key = option[1].replace("-", "_") if option else ""
    if key in OPTION_KEYS and first in COMMANDS:
        return f"{said}; allowed: options of a run are changed in its case; type: --set run.{key}=VALUE"
    if "unexpected extra argument" in said:
        said += "; allowed: quotes about a value with blanks"
    return f"{said}; type: scissordyn {f'{first} ' if first in COMMANDS else ''}--help"


def _refused(error: OSError) -> str:
    """What the operating system has refused; without a name it was to write what the command prints."""
    reason = error.strerror or str(error)
    if error.filename is None:
        give_up("stdout")
        return f"cannot write what is printed: {reason}; allowed: a terminal, a pipe, a file on a disk with room"
    return f"cannot use '{os.fsdecode(error.filename)}': {reason}; allowed: a name that the system takes, in a place it may use"


def _complain(text: str, status: int) -> int:
    with contextlib.suppress(OSError):  # where there is no room for messages, the status says it
        if os.environ.get("SCISSORDYN_TRACEBACK"):
            traceback.print_exc()
        print(f"scissordyn: {printable(shortened(text))}", file=sys.stderr)
    return status


if __name__ == "__main__":
    run()
