"""A mechanism in Python and its case file are two spellings of one thing: what is written is read as exactly the same."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import random
import tomllib
import types
import typing
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.annotation import plain_hint
from scissordyn.casefile.case import CaseTable
from scissordyn.casefile.part import PARTS
from scissordyn.casefile.quantity import exact_text, read_quantity
from scissordyn.casefile.table import instance
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import Component
from scissordyn.components.time_function import TimeFunction
from scissordyn.config.template import template
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.integrate.method import METHODS
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.model.record import to_plain
from scissordyn.units import quantities

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))  # Case files of all examples

ODD = 'a "name" \\ with ünïcode, #, = and \t\x7f'  # Name with characters that TOML must escape


def bits(described: Any) -> Any:
    """Return a description as plain data with numbers as texts of floats, so that equal data are equal to the last bit."""
    if isinstance(described, dict):
        return {key: bits(value) for key, value in described.items()}
    if isinstance(described, list):
        return [bits(value) for value in described]
    number = isinstance(described, int | float) and not isinstance(described, bool)
    return repr(float(described)) if number else described


def assert_survives(described: sd.Mechanism | sd.Case, path: Path) -> sd.Case:
    """Check that a case equals the case that is read from its case file; return the latter."""
    found = sd.read_case(sd.write_case(described, path))
    mechanism = described.mechanism if isinstance(described, sd.Case) else described
    assert found.mechanism == mechanism
    assert bits(to_plain(found.mechanism)) == bits(to_plain(mechanism))
    if isinstance(described, sd.Case):
        assert found.run == described.run
    return found


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_every_example(example, tmp_path):
    """Contract: the case, and every number of a short simulation of it."""
    case = sd.read_case(example, ["run.trust=false"])
    found = assert_survives(case, tmp_path / "case.toml")
    assert sd.case_text(found.mechanism, found.run) == sd.case_text(case.mechanism, case.run)
    options = case.run.keywords | {"until": min(case.run.until, 5e-3), "samples": 21}
    one, other = (sd.simulate(each.mechanism, **options) for each in (case, found))
    assert one.equals(other)
    for name in one.data_vars:
        if one[name].dtype.kind == "f":
            assert one[name].values.tobytes() == other[name].values.tobytes()


# Functions that build a mechanism of each kind of structure
BUILT = {
    "scissor": lambda: sd.scissor(units=3, bar_length=1.7, driven_bar="slider", angle=sd.degrees(33.3)),
    "polar": lambda: sd.polar_scissor(units=3),
    "ring": lambda: sd.hoberman_ring(units=5),
    "mast": lambda: sd.mast(units=2, platform_mass=3.0),
    "slider-crank": lambda: sd.slider_crank(),
    "four-bar": lambda: sd.four_bar(coupler_point=(0.09, 0.06)),
    "n-four-bar": lambda: sd.n_four_bar(),
}


@pytest.mark.parametrize("kind", BUILT)
def test_every_generator(kind, tmp_path):
    """Contract: what the generators build, with payloads, panels and clearance at all joints or at one."""
    made = BUILT[kind]()
    assert_survives(made, tmp_path / "case.toml")
    first = made.joints[0].name
    moving = next(joint.name for joint in made.joints if joint.journal[0] != "ground")
    loaded = sd.with_payload(made, moving, 1.3, inertia=0.1)
    assert_survives(loaded.with_clearance(first, sd.Clearance(1.1e-4)), tmp_path / "case.toml")
    same = loaded.with_clearance("all", sd.Clearance(1.1e-4, friction=sd.LuGre(kinetic=0.07)))
    assert sd.case_text(same).count("[[clearance]]") == 1
    assert_survives(same, tmp_path / "case.toml")


# every class of the description, and every field of it ----------------------------------------------------------------

PLUGINS: Mapping[type, tuple[type, ...]] = {
    Elastic: tuple(BY_KIND["stiffness"].values()),
    Damping: tuple(BY_KIND["damping"].values()),
    Friction: tuple(BY_KIND["friction"].values()),
    Controller: tuple(CONTROLLERS.values()),
    Component: tuple(COMPONENTS.values()),
}
"""Classes of laws and controllers to try as values of a field, by the type that the field declares."""

# Curves of a tape spring, straight and folded: pairs of rotation [rad] and moment [N m]
TAPE_CURVES = (((-0.3, -2.0), (0.1 / 3.0, 0.2), (0.4, 3.1)), ((-0.25, -0.1), (-0.01, -0.05), (0.02, 0.05), (0.3, 0.2)))
OTHERWISE: Mapping[type, tuple[Any, ...]] = {
    sd.Guide: (sd.Guide("guide", ("plate", "corner"), aligned=True),),
    sd.GuideClearance: (
        sd.GuideClearance(1e-4, length=0.04, width=0.02),
        sd.GuideClearance(1e-4, corners=((-0.019, -0.009), (0.019, -0.009), (0.0, 0.1 / 9.0))),
    ),
    sd.Clearance: (
        sd.Clearance(5e-4, **dict.fromkeys(("contour", "journal_contour"), tuple(1e-7 / (k + 3.0) for k in range(90)))),
    ),
    sd.TapeSpring: (sd.TapeSpring("tape", "rod", straight=TAPE_CURVES[0], folded=TAPE_CURVES[1]),),
    sd.FeedForward: (sd.FeedForward(limit=10.0),),
    sd.PID: (sd.PID(3.0, limit=10.0),),
    sd.Lubrication: (
        sd.Lubrication(viscosity=0.05, bearing="short"),
        sd.Lubrication(oil=sd.Oil("own", 5e-5, 7e-6), temperature=350.0),
    ),
    sd.Actuator: (
        sd.Actuator("servo", "rod", sd.FeedForward(limit=10.0), reference=sd.ConstantSpeed(1.0), sensor=("rod", "end")),
    ),
    sd.Bushing: (
        sd.Bushing(
            "bushing", ("crank", "end"), ("rod", "start"), stiffness_x=1e7, stiffness_y=1e7, damping_x=1e7, damping_y=1e7
        ),
    ),
    sd.Beam: (
        sd.Beam(
            "beam",
            ("crank", "start"),
            ("rod", "start"),
            length=0.7,
            axial_stiffness=1e7,
            bending_stiffness=1e3,
            mass_per_length=0.3,
            depth=0.06,
            youngs_modulus=2.1e11,
            yield_strength=2.35e8,
        ),
    ),
    sd.FlexibleBar: (
        sd.FlexibleBar(
            "bar",
            ("crank", "rod"),
            (0.0, 0.7),
            axial_stiffness=1e7,
            bending_stiffness=1e3,
            mass_per_length=0.3,
            modes=5,
            turned=(0.1, -0.2),
            depth=0.06,
        ),
    ),
    sd.Tabulated: (sd.Tabulated(tuple(k / 7.0 for k in range(9)), tuple(math.sin(k) for k in range(9))),),
}
"""Instances of classes whose fields depend on each other and cannot be tried one by one, by class."""


@cache
def parts_only() -> sd.Mechanism:
    """Return a mechanism of bodies and ground points, to which joints and components may refer."""
    found = sd.slider_crank()
    bodies = (*found.bodies, sd.Body("plate", 2.0, 0.1, {"corner": (0.3, 0.1)}, position=(0.2, 0.7)))
    return sd.Mechanism(bodies, ground=(("O", (0.0, 0.0)), ("P", (0.3, 0.4))))


def host(field: str, *parts: Any) -> sd.Mechanism:
    """Return a mechanism with parts in the list `field`."""
    return sd.Mechanism(parts) if field == "bodies" else dataclasses.replace(parts_only(), **{field: parts})


# Texts to try as values of a field
TEXTS = ("crank", "rod", "plate", "ground", "end", "start", "error", "sensor_x", *METHODS, ODD)
# Points of bodies to try as values of a field
PLACES = (("crank", "end"), ("rod", "start"), ("rod", "end"), ("ground", "O"), ("slider", "centre"), ("plate", "corner"))


def numbers(quantity: sd.Quantity) -> list[float]:
    """Return random numbers with all digits that a quantity allows, some of them negative."""
    draw = random.Random(repr(quantity))  # the same numbers in any order of the tests
    drawn = [sign * draw.uniform(1.0, 10.0) * 10.0**power for power in range(-7, 6) for sign in (1.0, 1.0, 1.0, -1.0)]
    drawn += [draw.random(), *(1.0 + 2.0 * draw.random() for _ in range(9))]
    if quantity.minimum is not None and quantity.maximum is not None:
        drawn += [draw.uniform(quantity.minimum, quantity.maximum) for _ in range(2)]
    found = [number for number in drawn if quantity.admits(number)]
    return draw.sample(found, len(found))


def candidates(described: type, name: str) -> list[list[Any]]:
    """Return values that a field may have by its annotation, in lists; a test needs one value of each list."""
    hint, found = get_type_hints(described, include_extras=True)[name], list[Any]()
    several = list[list[Any]]()
    plain = plain_hint(hint)
    union = typing.get_origin(plain) in (typing.Union, types.UnionType)
    for member in map(plain_hint, get_args(plain) if union else (plain,)):
        origin, inside = get_origin(member), get_args(member)
        if member is types.NoneType:
            found.append(None)
        elif origin is typing.Literal:
            found += inside
        elif member is bool:
            found += [True, False]
        elif member is int:
            found += [number for number in (3, 17, 12345) if quantities(described)[name].admits(number)]
        elif member is float:
            several.append(numbers(quantities(described)[name]))
        elif member is str:
            found += TEXTS
        elif member == tuple[str, str]:
            found += PLACES
        elif member == tuple[float, float]:
            found += [(0.1 / 3.0, -0.2 / 7.0), (0.0, 0.1 / 9.0)]
        elif origin is tuple and inside[1:] == (Ellipsis,) and inside[0] is float:
            row = (1.0 / 3.0, -2.0 / 7.0, 0.1, -5.0 / 9.0)
            found += [row, tuple(map(abs, row))]
        elif origin is tuple and inside[1:] == (Ellipsis,) and dataclasses.is_dataclass(inside[0]):
            found += [(each,) for each in instances(inside[0])]
        elif origin is tuple:
            found += TAPE_CURVES if any(isinstance(extra, sd.Pairs) for extra in get_args(hint)) else [()]
        elif isinstance(origin, type) and issubclass(origin, Mapping):
            found.append({"one": (0.1 / 3.0, 0.0), "an odd, [name]": (-1.0, 1e-5)})
        else:
            found += [each for kind in PLUGINS.get(member, (member,)) for each in instances(kind)]
    return [*several, *([value] for value in found)]


def made(described: type, values: Mapping[str, Any]) -> Any:
    """Return an instance; None if the values contradict each other or the mechanism of the tests."""
    try:
        part = described(**values)
        for field in LISTS.get(described, ()):
            host(field, part)
    except sd.InputError:
        return None
    return part


@cache
def lists() -> Mapping[type, tuple[str, ...]]:
    """Return the fields of a mechanism that hold instances of a class, by class."""
    found: dict[type, tuple[str, ...]] = {}
    for name, hint in get_type_hints(sd.Mechanism).items():
        if get_origin(hint) is tuple and get_args(hint)[1:] == (Ellipsis,) and name != "ground":
            for kind in PLUGINS.get(get_args(hint)[0], (get_args(hint)[0],)):
                if name != "components" or kind.declaration.section not in ("rod", "latch"):
                    found[kind] = (*found.get(kind, ()), name)
    return found


LISTS = lists()  # Fields of `Mechanism` that list parts, by class of the part


@cache
def instances(described: type) -> tuple[Any, ...]:
    """Return instances of a class, so that each field has a value other than the default in at least one instance."""
    fields = [field for field in dataclasses.fields(described) if field.init]
    required = [f.name for f in fields if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING]
    choices = [[value for group in candidates(described, name) for value in group[:12]] for name in required]
    combined = (dict(zip(required, values, strict=True)) for values in itertools.islice(itertools.product(*choices), 20_000))
    bases = list(OTHERWISE.get(described, ()))
    if hasattr(described, "declaration") and getattr(described.declaration, "section", "") in PARTS:
        bases.append(example(described))
    bases += itertools.islice((part for values in combined if (part := made(described, values)) is not None), 2)
    assert bases, f"no instance of {described.__name__} was found"
    found = list(bases)
    for field in fields:
        for group in candidates(described, field.name):
            values = (
                {other.name: getattr(base, other.name) for other in fields} | {field.name: value}
                for value in group
                for base in bases
            )
            found += itertools.islice((part for each in values if (part := made(described, each)) is not None), 1)
    for field in fields:
        default = field.default_factory() if field.default_factory is not dataclasses.MISSING else field.default
        seen = {repr(getattr(part, field.name)) for part in found}
        assert seen - {repr(default)}, f"no value but the default was tried for {described.__name__}.{field.name}"
    return tuple(found)


def example(described: Any) -> Any:
    """Return a component as described by the example in its declaration."""
    section = described.declaration.section
    table = {"name": "part", **described.declaration.example}
    if section == "rod":
        del table["length"]  # its example has both, one of which a user takes
    return PARTS[section].reader.read(table, {})


def cases(described: type) -> Iterator[sd.Mechanism]:
    """Yield mechanisms with all instances of a class of parts, ten in one if a mechanism may have them together."""
    # a distance that is zero at the start has no spelling
    parts = [p for p in instances(described) if not (described is sd.Rod and isinstance(p.motion, sd.ConstantSpeed))]
    count = 1 if described is sd.Revolute else 10  # two loose joints at the same points have no spelling
    for field, first in itertools.product(LISTS[described], range(0, len(parts), count)):
        some = parts[first : first + count]
        try:
            together = [host(field, *named_apart(some))]
        except sd.InputError:
            together = [host(field, part) for part in some]
        yield from together


def named_apart(parts: list[Any]) -> Iterator[Any]:
    """Yield parts, those with the name of an earlier one with a number behind it."""
    used = set[str]()
    for k, part in enumerate(parts):
        name = getattr(part, "name", None)
        yield part if name not in used else dataclasses.replace(part, name=f"{name} {k}")
        used |= {name} - {None}


@pytest.mark.parametrize("described", LISTS, ids=lambda described: described.__name__)
def test_every_class_and_field_of_a_description(described, tmp_path):
    """Contract: every part with every field, law, material, controller and time function, as the catalogues list them."""
    for mechanism in cases(described):
        found = instance(CaseTable, tomllib.loads(sd.case_text(mechanism)), {"folder": tmp_path}).case().mechanism
        assert found == mechanism
        assert bits(to_plain(found)) == bits(to_plain(mechanism))


def test_what_is_tried_is_what_is_declared():
    """Contract: all classes of the catalogues are among the parts that were tried."""
    listed = {kind for kinds in PLUGINS.values() for kind in kinds}
    tried, waiting = set[type](), [part for kind in LISTS for part in instances(kind)]
    while waiting:
        part = waiting.pop()
        if dataclasses.is_dataclass(part) and not isinstance(part, type):
            tried.add(type(part))
            waiting += [getattr(part, field.name) for field in dataclasses.fields(part)]
    assert not listed - tried
    assert {sd.Body, sd.Material, sd.Clearance, sd.GuideClearance, sd.Track, *get_args(TimeFunction)} <= tried


def test_every_field_of_mechanism_and_options(tmp_path):
    """Contract: gravity, input and output body, ground points; all options."""
    base = parts_only()
    for values in (
        {"gravity": 3.71, "gravity_direction": 0.1},
        {"gravity": 0.0, "gravity_direction": -0.0},
        {"input_body": "crank", "output_body": "slider"},
        {"ground": (("O", (1e-9, 0.1 / 3.0)), (ODD.replace(".", ""), (-0.0, 1e5)))},
    ):
        assert_survives(dataclasses.replace(base, **values), tmp_path / "case.toml")
    for field in dataclasses.fields(sd.Options):
        for value in itertools.chain(*(group[:2] for group in candidates(sd.Options, field.name))):
            try:
                options = dataclasses.replace(sd.Options(0.2), **{field.name: value})
            except sd.InputError:
                continue
            assert_survives(sd.Case(base, options), tmp_path / "case.toml")
    assert sd.read_case(sd.write_case(base, tmp_path / "case.toml", run=options)).run == options


def test_components_keep_their_order(tmp_path):
    """Contract: kinds that alternate are written in the one list that keeps the order of kinds."""
    one = sd.Spring("one", ("crank", "end"), ("ground", "O"), 100.0)
    two = sd.Torque("two", "crank", torque=3.0)
    servo = parts_only().controlled(sd.PID(3.0), body="rod", sensor=("rod", "end")).components[0]
    for order in itertools.permutations((one, two, dataclasses.replace(one, name="three"), servo)):
        mechanism = dataclasses.replace(parts_only(), components=order)
        found = assert_survives(mechanism, tmp_path / "case.toml")
        assert [part.name for part in found.mechanism.components] == [part.name for part in order]
    text = sd.case_text(dataclasses.replace(parts_only(), components=(one, two)))
    assert "[[spring]]" in text
    assert "[[component]]" not in text


def local() -> Any:
    """Return a law made of a function that is in no file."""

    @sd.element(slot="stiffness")
    def soft(indentation: float) -> float:
        return 1e7 * indentation

    return soft()


def nothing() -> Any:
    """Return a component whose class is in no file."""

    @sd.component(port="line", force=lambda length, rate: (0.0, 0.0, 0.0))
    class Nothing:
        name: str
        start: tuple[str, str]
        end: tuple[str, str]

    return Nothing("n", ("rod", "start"), ("crank", "end"))


@pytest.mark.parametrize(
    ("mechanism", "says"),
    [
        (
            lambda: sd.scissor().with_clearance("A", sd.Clearance(1e-4, stiffness=local())),
            "stiffness law: its class 'soft' is not in a file",
        ),
        (
            lambda: dataclasses.replace(parts_only(), components=(nothing(),)),
            "component 'n': its class 'Nothing' is not in a file",
        ),
        (lambda: sd.Mechanism((sd.Body("b", 1.0, 0.1, {"a.b": (0.0, 0.0)}),)), "the point name 'a.b' has a dot"),
        (
            lambda: dataclasses.replace(
                parts_only(), rods=(sd.Rod("r", ("rod", "end"), ("ground", "O"), motion=sd.ConstantSpeed(1.0)),)
            ),
            "ConstantSpeed as time function of a distance",
        ),
        (lambda: sd.Mechanism((sd.Body("\ud800", 1.0, 0.1),)), "half a surrogate pair"),
    ],
)
def test_what_cannot_be_written(mechanism, says, tmp_path):
    """Contract: an error of one line, and no file."""
    with one_line_error(says):
        sd.write_case(mechanism(), tmp_path / "case.toml")
    assert not list(tmp_path.iterdir())


def test_only_own_files_are_replaced(tmp_path):
    """Contract: a case file that somebody wrote, also one that `scissordyn new` printed, is not overwritten; our own is."""
    path = tmp_path / "case.toml"
    for text in (template("scissor"), "notes\n", "# A case"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(sd.InputError, match="not a case file of scissordyn"):
            sd.write_case(sd.scissor(), path)
        assert path.read_text(encoding="utf-8") == text
    path.write_text("")
    sd.write_case(sd.scissor(units=1), path)
    sd.write_case(sd.scissor(units=2), path)
    assert sd.read_case(path).mechanism == sd.scissor(units=2)
    with pytest.raises(sd.InputError, match="it is a folder"):
        sd.write_case(sd.scissor(), tmp_path)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (5e-4, "m", "0.5 mm"),
        (2.0, "m", "2 m"),
        (0.05, "s", "50 ms"),
        (math.radians(30.0), "rad", "30 deg"),
        (sd.rpm(150.0), "rad/s", "150 rpm"),
        (3.0, "rad/s", "3 rad/s"),
        (207e9, "Pa", "207 GPa"),
        (0.1 / 3.0, "m", "0.03333333333333333 m"),
        (-0.0, "m", "-0 m"),
        (1e-300, "kg", "1e-300 kg"),
    ],
)
def test_units_as_people_write_them(value, unit, text):
    """Closed form: the usual unit where it is exact, SI with all digits otherwise."""
    assert exact_text((value,), unit) == text
    assert repr(read_quantity(text, sd.Quantity(unit, minimum=-1e300, maximum=1e300))) == repr(value)


def test_any_number_survives():
    """Contract: random floats of all magnitudes, to the last bit, in every unit that is abbreviated and some others."""
    generator = np.random.default_rng(7)
    words = generator.integers(0, 2**63, 4000, dtype=np.int64).view(np.float64)
    for unit in ("m", "s", "m/s", "rad", "rad/s", "Pa", "N", "kg m^2", "N m s/rad"):
        quantity = sd.Quantity(unit, minimum=-1e308, maximum=1e308)
        for value in (float(word) for word in words[:400] if math.isfinite(word)):
            assert repr(read_quantity(exact_text((value,), unit), quantity)) == repr(value)


def test_the_text_is_toml_with_a_run():
    """Contract: what `to_case` returns can be read by itself, and says its options."""
    text = sd.case_text(sd.scissor(units=1).driven(speed=sd.rpm(150)), sd.Options(0.1, samples=11))
    assert 'speed = "150 rpm"' in text
    assert text.endswith('[run]\nuntil = "0.1 s"\nsamples = 11\n')
    assert json.dumps(text)
