"""What commands read: saved runs, their mechanism, numbers with units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, overload

from scissordyn.config.quantity import example, read_quantity
from scissordyn.errors import InputError, command
from scissordyn.units import Quantity

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism

KINDS = {"s": ("a time", "10 ms", Quantity("s")), "m": ("a length", "5 mm", Quantity("m", above=0.0))}
"""By unit, what an option takes, as in a sample, and its bounds."""


def read_run(path: Path, *, samples: int = 2) -> xr.Dataset:
    """A saved run with at least so many samples."""
    from scissordyn.config.table import located
    from scissordyn.file.sound import check_run
    from scissordyn.run.configuration import is_run
    from scissordyn.run.store import load

    wanted = "a run that was saved"
    if not path.exists():
        raise InputError(f"cannot read '{path}': no such file", wanted, "scissordyn run case.toml -o run.nc")
    if path.suffix.lower() == ".toml":
        from scissordyn.config.file import is_study, parsed
        from scissordyn.config.text import read_text

        kind, ending = ("study", "db") if is_study(parsed(read_text(path, wanted), path)) else ("run", "nc")
        sample = command("scissordyn", kind, path, "-o", f"{path.stem}.{ending}")
        raise InputError(f"'{path}' is a {kind.replace('run', 'case')} file", wanted, sample)
    run = load(path)
    if not is_run(run):
        raise InputError(f"'{path}' holds a '{run.attrs.get('title')}'", "a run of 'scissordyn run'")
    with located(f"'{path}'"):
        check_run(run)
    if run.sizes.get("time", 0) < samples:
        raise InputError(f"'{path}' holds a run of {run.sizes.get('time', 0)} samples", f"a run of {samples} or more")
    return run


def mechanism_of(run: xr.Dataset, allow_code: list[Path] | None) -> Mechanism:
    """The mechanism that was run."""
    from scissordyn.file.sound import check_names
    from scissordyn.run.configuration import read_configuration

    mechanism = read_configuration(run).build_mechanism(allow_code or [])
    check_names(run, mechanism)
    return mechanism


@overload
def typed(text: str, option: str, unit: str = ...) -> float: ...
@overload
def typed(text: str | None, option: str, unit: str = ...) -> float | None: ...
def typed(text: str | None, option: str, unit: str = "s") -> float | None:
    """A time or a length with its unit, as in "10 ms"."""
    if text is None:
        return None
    kind, sample, quantity = KINDS[unit]
    try:
        return read_quantity(text, quantity)
    except InputError as error:
        raise InputError(f"{option} {text!r}: {error.what}", f"{kind} with its unit", f"{option} '{sample}'") from None


def value_of(text: str, quantity: Quantity, option: str) -> float:
    """A value of a quantity with its unit, or a pure number."""
    value: str | float = text
    if quantity.unit == "1":
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{option} '{text}': not a number", quantity.allowed, f"{option} {example(quantity)}") from None
    try:
        return read_quantity(value, quantity, f"{option} '{example(quantity)}'")
    except InputError as error:
        raise InputError(f"{option} '{text}': {error.what}", error.allowed, error.type_this) from None
