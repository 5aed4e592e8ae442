"""Damaged runs: every command that reads one refuses it in one line with status 2, or does what can be done."""

import random
import shutil
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.build import add_checksum, write_as_other

import scissordyn as sd
from scissordyn.cli.main import status_of

EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
# Numbers of damaged files: in every test run, with the slow tests, and in each of the slow tests
QUICK_FILES, ALL, BLOCK = 20, 1020, 50

Said = Callable[..., tuple[int, str]]


ATTRIBUTES = (
    *("", "soon", "{", "[]", "{}", "null", "NaN", '{"mechanism": {}}', '{"steps": "x"}', "[3]", '"x"', "x" * 5000),
    *(0, -1, 3.5, 1e308, float("nan"), float("inf"), np.array([1.0, 2.0]), np.array([], float), np.int8(3), True),
)
"""Values, most of them wrong, that replace an attribute of a stored run."""

# Numbers that replace a value of a stored run
NUMBERS = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 5e-324, 0.0, -1.0)

# Units, most of them wrong, that replace the unit of a stored variable
UNITS = ("", "furlong", "1", "m", "N m/s^2", 3, 2.5, np.array([1.0, 2.0]), "$\\frac{", "x" * 500)


def damaged_run(whole, target, number):
    """Write a damaged copy of a run; equal numbers give equal damage."""
    chance = random.Random(number)
    if chance.random() < 0.15:
        target.write_bytes(_bytes(whole.read_bytes(), chance))
        add_checksum(target)
        return
    run = _loaded(whole)
    for _ in range(chance.choice((1, 1, 2, 3))):
        run = chance.choice((_attribute, _attribute, _about, _about, _variable, _variable, _variable))(run, chance)
    run = run.copy()
    for name, variable in run.variables.items():  # NetCDF stores no objects but texts
        if variable.dtype.kind == "O":
            run[name] = variable.dims, [str(value) for value in variable.values.ravel()], variable.attrs
    target.unlink(missing_ok=True)
    write_as_other(run, target, invalid=True)


@cache
def _loaded(path):
    return sd.load(path)


def _bytes(content, chance):
    """Return the content cut off, or with some bytes replaced."""
    if chance.random() < 0.5:
        return content[: chance.randrange(len(content))]
    changed = bytearray(content)
    for _ in range(chance.choice((1, 5, 50, 500))):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def _attribute(run, chance):
    """Return the run with an attribute removed or replaced; attributes that commands read are chosen more often."""
    name = chance.choice((*run.attrs, *("end", "title", "configuration", "status", "trusted_until", "statistics", "warnings")))
    attributes = {key: value for key, value in run.attrs.items() if key != name}
    text = run.attrs.get(name)
    if chance.random() < 0.7:
        attributes[name] = chance.choice(ATTRIBUTES)
    elif chance.random() < 0.5 and isinstance(text, str) and text:
        at = chance.randrange(len(text))
        attributes[name] = text[:at] + chance.choice(("", "x", '"', "9", "null", "}")) + text[at + 1 :]
    changed = run.copy()
    changed.attrs = attributes
    return changed


def _about(run, chance):
    """Return the run with unit or long name of a variable removed or replaced."""
    changed = run.copy(deep=True)
    about = changed[chance.choice(list(map(str, run.variables)))].attrs
    name = chance.choice(("units", "units", "long_name", "scale_factor"))
    if chance.random() < 0.5:
        about.pop(name, None)
    else:
        about[name] = chance.choice(UNITS)
    return changed


def _variable(run, chance):
    """Return the run with a variable removed or cut, or with another type, dimension or numbers."""
    name = chance.choice(list(map(str, run.variables)))
    old, kind = run[name], chance.random()
    if kind < 0.3:
        return run.drop_vars(name)
    if kind < 0.4 and old.dims:
        dim = chance.choice(old.dims)
        return run.isel({dim: slice(0, chance.randrange(run.sizes[dim] + 1))})
    others = run.drop_vars(name)
    if name in others.dims:  # a coordinate that others go over can be lost, but is no number
        return others
    if kind < 0.5:
        return others.assign({name: 3.0 if chance.random() < 0.5 else "text"})
    if kind < 0.6:
        return others.assign({name: ("other", np.arange(3.0), old.attrs)})
    values = old.values.copy()
    if kind < 0.75 or values.dtype.kind != "f":
        if values.dtype.kind in "OU":
            new = [chance.choice(("", "A", "ground", "x\x1b[31m", "$\\frac{", text)) for text in values.ravel().tolist()]
            values = np.array(new, dtype=str).reshape(values.shape) if chance.random() < 0.7 else np.arange(float(values.size))
        else:
            values = values.astype(str) if chance.random() < 0.5 else np.nan_to_num(values).astype(np.int32)
    elif values.size:
        flat = values.reshape(-1)
        for _ in range(chance.choice((1, 1, flat.size))):
            flat[chance.randrange(flat.size)] = chance.choice(NUMBERS)
    return others.assign({name: (old.dims, values, old.attrs)})


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the paths of saved runs: the paper's array with its horizon, and a lift with end stops and a rod."""
    folder, made = tmp_path_factory.mktemp("whole"), []
    for name, until, extra in (("paper", "2 ms", ("--trust",)), ("lift", "20 ms", ())):
        made.append(folder / f"{name}.nc")
        options = ("-o", str(made[-1]), "--samples", "5", "--set", f"run.until={until}", "--quiet", *extra)
        assert status_of(["run", str(EXAMPLES / f"{name}.toml"), *options]) == 0
    return made


# Commands that read a damaged file and draw nothing
READING = (
    ("compare", "damaged.nc", "whole.nc"),
    ("compare", "whole.nc", "damaged.nc"),
    ("export", "damaged.nc", "table.csv"),
    ("export", "damaged.nc", "contacts.csv", "--contacts"),
    ("export", "damaged.nc", "arrays.mat"),
)
# Commands that draw pictures of a damaged file
DRAWING = (
    ("compare", "whole.nc", "damaged.nc", "-o", "figures"),
    ("plot", "damaged.nc", "-o", "figures", "--only", "response,force,torque,orbit,energy"),
    ("plot", "damaged.nc", "-o", "figures", "--only", "structure"),
    ("animate", "damaged.nc", "film.html"),
)
AGAIN = ("run", "damaged.nc", "--events", "3")  # Command that runs the case of a damaged file again
FILES_PER_PICTURE = 10  # Number of damaged files of which one is drawn and one is run again, because each takes seconds


def command_of(number):
    """Return the command that reads the damaged file with this number."""
    turn = number // FILES_PER_PICTURE
    return {3: DRAWING[turn % len(DRAWING)], 7: AGAIN}.get(number % FILES_PER_PICTURE, READING[(number + turn) % len(READING)])


def tried(said, whole, first, last):
    """Run a command on damaged runs, a different command for each in turn, and return the statuses."""
    found = set()
    for number in range(first, last):
        sound = whole[number % 2]
        shutil.copy(sound, "whole.nc")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the libraries that write what is damaged
            damaged_run(sound, Path("damaged.nc"), number)
        found.add(said(*command_of(number))[0])
    return found


def test_damaged_runs(said, whole, folder):
    """Contract: of twenty damaged files each is refused in one line or read; some do each."""
    assert {0, 2} <= tried(said, whole, 0, QUICK_FILES)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(QUICK_FILES, ALL, BLOCK))
def test_a_thousand_damaged_runs(said, whole, folder, first):
    """Contract: as above, for a thousand further files."""
    assert 2 in tried(said, whole, first, first + BLOCK)


def test_a_flipped_bit_is_noticed_by_every_command(said, whole, folder):
    """Contract: one bit of a number that would be read is flipped; nothing is shown, drawn or written of the run."""
    content, first = whole[0].read_bytes(), sd.load(whole[0])["position"].values[1, 0, 0].tobytes()
    Path("damaged.nc").write_bytes(content.replace(first, bytes([first[0] ^ 1]) + first[1:]))
    shutil.copy(whole[0], "whole.nc")
    for command in (*READING, *DRAWING, AGAIN, ("cite", "damaged.nc"), ("explore", "damaged.nc", "--no-browser")):
        status, line = said(*command)
        assert status == 2, command
        assert "does not match its checksum" in line, command


def without(values, name):
    """Return values with an attribute removed."""
    return values.drop_attrs(deep=False).assign_attrs({key: value for key, value in values.attrs.items() if key != name})


DAMAGES = {
    "end": lambda run: run.assign_attrs(end="soon"),
    "statistics": lambda run: run.assign_attrs(statistics="[]"),
    "trusted_contacts": lambda run: run.assign_attrs(trusted_contacts="[]"),
    "joint_peak_force_time": lambda run: run.drop_vars("joint_peak_force_time"),
    "position": lambda run: run.assign(position=without(run["position"], "units")),
    "kinetic_energy": lambda run: run.assign(kinetic_energy=run["kinetic_energy"].where(run["time"] != run["time"][1])),
    "contact_joint": lambda run: run.drop_vars("contact_joint"),
    "joint": lambda run: run.assign_coords(joint=("joint", ["A"] * run.sizes["joint"], run["joint"].attrs)),
}
"""Functions that damage a run, by what they damage: types, units, numbers, variables, unique names."""


@pytest.mark.parametrize("named", DAMAGES)
def test_damage_is_named(said, whole, folder, named):
    """Contract: a command refuses a damaged run, and names the attribute or the variable; every command does for one damage."""
    shutil.copy(whole[0], "whole.nc")
    write_as_other(DAMAGES[named](sd.load(whole[0])), "damaged.nc")
    for command in (*READING, *DRAWING) if named == "end" else READING[2:3]:  # all of them read a run by one function
        status, line = said(*command)
        assert status == 2, command
        assert f"'{named}'" in line
