"""What the commands on saved runs share: reading them, their mechanism, times with units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scissordyn.errors import InputError, command

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism


def read_run(path: Path, *, samples: int = 2) -> xr.Dataset:
    """A saved run with at least so many samples."""
    from scissordyn.config.table import located
    from scissordyn.file.sound import check_run
    from scissordyn.run.configuration import is_run
    from scissordyn.run.store import load

    if not path.exists():
        raise InputError(f"cannot read '{path}': no such file", "a run that was saved", "scissordyn run case.toml -o run.nc")
    if path.suffix.lower() == ".toml":
        from scissordyn.config.file import is_study, parsed
        from scissordyn.config.text import read_text

        if is_study(parsed(read_text(path, "a run that was saved"), path)):
            shown = command("scissordyn", "study", path, "-o", f"{path.stem}.db")
            raise InputError(f"'{path}' is a study file", "a run that was saved", shown)
        raise InputError(
            f"'{path}' is a case file", "a run that was saved", command("scissordyn", "run", path, "-o", f"{path.stem}.nc")
        )
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


def seconds(text: str | None, option: str) -> float | None:
    """A time with its unit, as in "10 ms"."""
    if text is None:
        return None
    from scissordyn.config.quantity import read_quantity
    from scissordyn.units import Quantity

    try:
        return read_quantity(text, Quantity("s"))
    except InputError as error:
        raise InputError(f"{option} {text!r}: {error.what}", "a time with its unit", f"{option} '10 ms'") from None
