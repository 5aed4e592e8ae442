"""Run the command line: load the called command, report errors and signals in one line, and return an exit status."""

from __future__ import annotations

import contextlib
import functools
import gc
import io
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Sequence
from difflib import get_close_matches
from importlib import import_module
from types import FrameType

import click

from scissordyn import __version__
from scissordyn.cli.output import BAD_INPUT, BUG, DONE, INTERRUPTED
from scissordyn.cli.parameter import HELP_OPTIONS, make_command
from scissordyn.errors import AssemblyError, ScissordynError, printable, shortened
from scissordyn.processor import limit_library_threads

ABOUT = "Dynamics of deployable scissor structures with clearance joints."  # First line of the command's help

STOPPED = "interrupted"  # message of a command that a signal has ended

COMMANDS = {
    "run": ("run", "Simulate a case and show its contacts.", "scissordyn run case.toml -o run.nc --plot pictures --trust"),
    "check": (
        "check",
        "Read a case, assemble its mechanism and describe the run.",
        "scissordyn check case.toml --set drive.speed='250 rpm'",
    ),
    "preview": (
        "check",
        "Assemble a case, describe its motion with ideal joints, and draw it with its names.",
        "scissordyn preview case.toml -o picture.svg --curves curves.svg",
    ),
    "statics": (
        "response",
        "Compute the forces in pins, guides, drives, rods, springs and bars over the stroke, without inertia.",
        "scissordyn statics case.toml --plot forces.png -o forces.csv",
    ),
    "gradient": (
        "gradient",
        "Compute exact derivatives of measures of a run by parameters, through all contacts.",
        "scissordyn gradient case.toml --of 'A.peak_force' --by 'A.clearance' --by 'drive.speed'",
    ),
    "modes": (
        "response",
        "Compute natural frequencies and mode shapes at the start or along the motion.",
        "scissordyn modes case.toml --until '1 s' --plot figures",
    ),
    "motor": (
        "response",
        "Report the required motor torque and speed, the share of the motor curve used, and the smallest sufficient limit.",
        "scissordyn motor case.toml --point '0 rpm, 60 N m' --point '300 rpm, 0 N m' --plot motor.png",
    ),
    "explore": (
        "explore",
        "Open a page in the browser with the fields of a case, its animation and its curves; end it with Ctrl-C.",
        "scissordyn explore case.toml",
    ),
    "plot": (
        "saved",
        "Draw a saved run without computing it again.",
        "scissordyn plot run.nc -o pictures --only force,orbit --joint A",
    ),
    "animate": ("saved", "Write a film of a saved run without computing it again.", "scissordyn animate run.nc film.html"),
    "compare": (
        "compare",
        "Show how two saved runs differ, or how well a run agrees with measured curves.",
        "scissordyn compare a.nc b.nc -o pictures",
    ),
    "import": (
        "explore",
        "Convert a linkage drawn in another program to a case file; unused parts are reported.",
        "scissordyn import linkage.dxf --unit mm -o case.toml",
    ),
    "cite": (
        "saved",
        "List the publications of the mechanism, the laws and the methods that a saved run has used.",
        "scissordyn cite run.nc -o references.bib",
    ),
    "fit": (
        "fit",
        "Fit parameters of a case to measured curves; report their uncertainty and which cannot be distinguished.",
        "scissordyn fit case.toml --data decay.csv --free arm.inertia --free pivot.damping --segment '2 s' -o fit.nc",
    ),
    "export": (
        "saved",
        "Export a saved run as a table or its pin forces, or the mechanism of a case as a drawing, a model or an FMU.",
        "scissordyn export run.nc table.csv",
    ),
    "new": (
        "catalogue",
        "Print a commented case file: scissordyn new scissor --with servo,tip > case.toml.",
        "scissordyn new scissor --with servo,tip > case.toml",
    ),
    "examples": ("catalogue", "List the examples, print one, or copy them.", "scissordyn examples paper > case.toml"),
    "zoo": (
        "catalogue",
        "List the named mechanisms, or show one with its description, source, reference values and case file.",
        "scissordyn zoo peaucellier --case > case.toml",
    ),
    "schema": (
        "catalogue",
        "Print the JSON Schema of case or study files; '#:schema case.json' on top of a file makes an editor use it.",
        "scissordyn schema case -o case.json",
    ),
    "laws": (
        "catalogue",
        "List the laws and materials, or show one with its parameters.",
        "scissordyn laws flores --plot law.png",
    ),
    "controllers": ("catalogue", "List the controllers, or show one with its parameters.", "scissordyn controllers pid"),
    "bifurcation": (
        "response",
        "Compute a bifurcation diagram: the state once per period of the drive, for many values of a parameter.",
        "scissordyn bifurcation case.toml --over A.clearance --from '0.1 mm' --to '0.7 mm' -o diagram.nc",
    ),
    "wear": (
        "wear",
        "Compute the wear of joints over many cycles, and the cycle at which a requirement fails.",
        "scissordyn wear case.toml --cycles 10000 -o life.nc --plot pictures",
    ),
    "sweep": (
        "study",
        "Vary parameters of a case, store all results, and report where the requirements are met.",
        "scissordyn sweep case.toml --vary A.clearance='0.1..0.4 mm' --points 16 -o sweep.db",
    ),
    "study": (
        "study",
        "Compute a study file; or show, resume, retry, extend, refine, report or export one, or replay a case.",
        "scissordyn study study.toml -o study.db",
    ),
    "paper": (
        "paper",
        "Reproduce the paper's figures and compare its statements with measured numbers.",
        "scissordyn paper -o out --figure 9",
    ),
}
"""Commands by name: name of the command's file, description, and example in the help."""

OTHER_WORDS = {
    "simulate": "run",
    "draw": "plot",
    "film": "animate",
    "view": "explore",
    "open": "explore",
    "template": "new",
    "equilibrium": "statics",
}
"""Name of the right command, by words that users try instead."""

OPTION_KEYS = ("until", "start", "rtol", "atol", "method", "most_steps", "events", "step")
"""Keys of the table [run] that users try as options of a command."""

SIGNALS = (signal.SIGINT, signal.SIGTERM)  # Signals that end a command: Ctrl-C and termination

_received: list[int] = []  # Numbers of the signals that the process has received


class Commands(click.Group):
    """Group of commands that imports the file of a command when the command or its help is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context | None, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        room, about, example = COMMANDS[cmd_name]
        function = getattr(import_module(f"scissordyn.cli.{room}"), {"import": "import_drawing"}.get(cmd_name, cmd_name))
        return make_command(function, cmd_name, about, example)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write names and descriptions of the commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, about) for name, (_, about, _) in COMMANDS.items()])


def _print_version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        print(f"scissordyn {__version__}")
        context.exit()


# Option that prints the version of the package
VERSION = click.Option(
    ["--version"], is_flag=True, is_eager=True, expose_value=False, callback=_print_version, help="Print the version and exit."
)

app = Commands("scissordyn", help=ABOUT, params=[VERSION], context_settings=HELP_OPTIONS)


def run() -> None:
    """Run the command line of this process and exit with its status."""
    # otherwise garbage collection takes a third of the time of a short command: while libraries load, and at the end, when
    # the operating system frees all memory anyway
    gc.set_threshold(200_000)
    limit_library_threads()
    install_signal_handlers()
    prepare_streams()
    warnings.formatwarning = _warning_line
    try:
        status = status_of(sys.argv[1:])
    except KeyboardInterrupt:
        status = _print_error(STOPPED, INTERRUPTED)
    gc.freeze()
    if status == INTERRUPTED and _received:
        status = 128 + _received[0]
    for name in ("stdout", "stderr"):
        try:
            getattr(sys, name).flush()
        except OSError:  # the error was printed already, the disk is full, or the pipe is closed
            discard_stream(name)
    if any(thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        os._exit(status)  # the normal end of Python may abort if a thread runs compiled code, for example a run of the explorer
    sys.exit(status)


def status_of(arguments: Sequence[str]) -> int:
    """Run a command with its arguments and return the exit status."""
    try:
        try:
            with app.make_context("scissordyn", list(arguments) or ["--help"]) as context:
                parsed = app.invoke(context)
        except click.exceptions.Exit as shown:  # a help or the version
            status = shown.exit_code
        else:
            status = parsed()
        sys.stdout.flush()
        return status
    except ScissordynError as error:
        return _print_error(_with_case_name(error, arguments), BAD_INPUT)
    except click.ClickException as error:
        return _print_error(_usage_text(error, arguments), BAD_INPUT)
    except KeyboardInterrupt:
        return _print_error(STOPPED, INTERRUPTED)
    except BrokenPipeError:  # for example "scissordyn laws | head -1"
        discard_stream("stdout")
        return DONE
    except SystemExit as error:
        if _received:
            return _print_error(STOPPED, INTERRUPTED)
        return _print_error(f"the command was ended by SystemExit({error.code!r}), raised by a function that it called", BUG)
    except OSError as error:  # for example a full disk, a too long file name, an unreadable folder
        return _print_error(_system_error_text(error), BAD_INPUT)
    except MemoryError as error:
        return _print_error(f"the memory of this machine is not enough: {error or 'no details'}", BAD_INPUT)
    except Exception as error:  # an error of the program is reported in one line, too
        if _received:
            return _print_error(STOPPED, INTERRUPTED)
        hint = "" if os.environ.get("SCISSORDYN_TRACEBACK") else "; a fault of scissordyn: SCISSORDYN_TRACEBACK=1 shows where"
        return _print_error(f"{type(error).__name__}: {error}{hint}", BUG)


def _warning_line(message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None) -> str:
    """Return a warning as one line of text; a warning by a library also has its category, file and line number."""
    place = "" if category is UserWarning else f"{category.__name__} in {filename}, line {lineno}: "
    return f"scissordyn: Warning: {place}{printable(str(message))}\n"


def _with_case_name(error: ScissordynError, arguments: Sequence[str]) -> str:
    """Return the text of an error, with the name of the case file first if the mechanism cannot be assembled."""
    case = next((word for word in arguments if word.endswith(".toml")), "")
    return f"{case}: {error}" if isinstance(error, AssemblyError) and case and case not in str(error) else str(error)


def _usage_text(error: click.ClickException, arguments: Sequence[str]) -> str:
    """Return click's message about wrong arguments with a suggestion: the likely command, an option, or an example."""
    text = error.format_message().rstrip(".")
    first = next((word for word in arguments if not word.startswith("-")), "")
    if isinstance(error, click.exceptions.NoSuchCommand):
        word = next(iter(get_close_matches(first, [*OTHER_WORDS, *COMMANDS], n=1, cutoff=0.6)), "")
        text = f"No such command '{first}'" + (f" (did you mean '{OTHER_WORDS.get(word, word)}'?)" if word else "")
    if text.startswith("Missing") and first in COMMANDS:
        return f"{text}; for example {COMMANDS[first][2]}"
    if isinstance(error, click.NoSuchOption):
        text = f"No such option '{error.option_name}'"
        key = error.option_name.removeprefix("--").replace("-", "_")
        if key in OPTION_KEYS and first in COMMANDS:
            return f"{text}; options of a run belong to its case; for example --set run.{key}=VALUE"
        text += f" (did you mean '{error.possibilities[0]}'?)" if error.possibilities else ""
    if "unexpected extra argument" in text:
        text += "; expected quotes around a value with spaces"
    return f"{text}; for example scissordyn {f'{first} ' if first in COMMANDS else ''}--help"


def _system_error_text(error: OSError) -> str:
    """Return the text of an error of the operating system; an error without a file name concerns standard output."""
    reason = error.strerror or str(error)
    if error.filename is None:
        discard_stream("stdout")
        return f"cannot write to standard output: {reason}"
    return f"cannot use '{os.fsdecode(error.filename)}': {reason}; expected a valid name in a folder with write permission"


def _print_error(text: str, status: int) -> int:
    with contextlib.suppress(OSError):  # on a full disk the exit status reports the error
        if os.environ.get("SCISSORDYN_TRACEBACK"):
            traceback.print_exc()
        print(f"scissordyn: {printable(shortened(text))}", file=sys.stderr)
    return status


def install_signal_handlers() -> None:
    """Handle SIGINT and SIGTERM from now on; to be called in the main thread of a command's process."""
    for number in SIGNALS:
        signal.signal(number, _interrupt)
    sys.unraisablehook = _repeat_lost_interrupt


def _repeat_lost_interrupt(unraisable: sys.UnraisableHookArgs) -> None:
    """Repeat a signal whose `KeyboardInterrupt` Python dropped, as it does in callbacks of weak references and in `__del__`."""
    if unraisable.exc_type is not KeyboardInterrupt or not _received:
        sys.__unraisablehook__(unraisable)
        return
    install_signal_handlers()
    # to the main thread, whose wait for a lock it ends, and a moment later, when the callback has ended
    main = threading.main_thread().ident
    repeat = functools.partial(signal.pthread_kill, main) if hasattr(signal, "pthread_kill") and main else signal.raise_signal
    threading.Timer(0.01, repeat, (_received.pop(),)).start()


def _interrupt(number: int, _: FrameType | None) -> None:
    """Signal handler: interrupt the command after the current slice of steps; a second signal ends the process immediately."""
    _received.append(number)
    for other in SIGNALS:
        signal.signal(other, signal.SIG_DFL)
    if os.isatty(2):  # show the cursor, which a progress bar hides
        os.write(2, b"\x1b[?25h")
    raise KeyboardInterrupt


def prepare_streams() -> None:
    """Discard output to closed streams, and print the codes of letters that the encoding of a stream does not have."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def discard_stream(name: str) -> None:
    """Discard unwritten output of "stdout" or "stderr"; otherwise the interpreter would try to write it at its end and fail."""
    try:
        number = getattr(sys, name).fileno()
    except (OSError, ValueError):  # a stream without file descriptor, as in tests
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


if __name__ == "__main__":
    run()
