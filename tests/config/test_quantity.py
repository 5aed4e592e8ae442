"""Numbers with units."""

import math
import random

import pytest
from tests import build

import scissordyn as sd
from scissordyn.casefile import quantity
from scissordyn.casefile.quantity import (
    UNIT_DEFINITIONS,
    UNIT_FACTORS,
    USUAL_UNITS,
    _registry,
    example,
    read_numbers,
    read_quantity,
    rounded_text,
    unit_factor,
)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.5 mm", "m", 0.5e-3),
        ("5mm", "m", 5e-3),
        ("1e-3 m", "m", 1e-3),
        (" 2 in ", "m", 0.0508),
        ("20 µm", "m", 20e-6),
        ("20 um", "m", 20e-6),
        ("150 rpm", "rad/s", sd.rpm(150.0)),
        ("-90 deg", "rad", sd.degrees(-90.0)),
        ("0.25 turn", "rad", 0.5 * math.pi),
        ("3 Hz", "rad/s", 6.0 * math.pi),
        ("9.81 m/s^2", "m/s^2", 9.81),
        ("9.81 m/s**2", "m/s^2", 9.81),
        ("7.8 g/cm^3", "kg/m^3", 7800.0),
        ("207 GPa", "Pa", 207e9),
        ("1e5 1/m", "1/m", 1e5),
        ("2 N s/m", "N*s/m", 2.0),
        ("12 lb", "kg", 12 * 0.45359237),
    ],
)
def test_text_becomes_si(text, unit, value):
    """Closed form: factors of units by definition; 1e-15 is a rounding or two."""
    assert read_quantity(text, sd.Quantity(unit)) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("0.5", "m", "missing unit"),
        (0.5, "m", "missing unit"),
        ("0.5 s", "m", "wrong dimension"),
        ("0.5 m^2", "m", "wrong dimension"),
        ("0.5 rmp", "rad/s", "did you mean 'rpm'"),
        ("3 1/s", "rad/s", "wrong dimension"),
        ("0.3 percent", "rad", "unknown unit"),
        ("0.5 mm mm", "m", "wrong dimension"),
        ("mm", "m", "not a number with a unit"),
        ("", "m", "not a number with a unit"),
        ("nan m", "m", "out of bounds"),
        ("inf m", "m", "out of bounds"),
        ("2 3 m", "m", "is not a unit"),
        ("2 m^9^9^9^9", "m", "is not a unit"),
        ("2 m^99", "m", "is not a unit"),
        ("2 m/", "m", "is not a unit"),
        ("2 m)(", "m", "is not a unit"),
        ("2 __import__('os')", "m", "is not a unit"),
        (True, "m", "not a number"),
        (None, "m", "not a number"),
        ([1], "m", "not a number"),
        ("0.5", "1", "plain number"),
        (math.nan, "1", "out of bounds"),
    ],
)
def test_what_is_no_quantity_is_refused(text, unit, reason):
    """Contract: each refusal names its reason and what is allowed."""
    with pytest.raises(sd.InputError, match="expected a number from") as caught:
        read_quantity(text, sd.Quantity(unit))
    assert reason in str(caught.value)


@pytest.mark.parametrize("unit", [*USUAL_UNITS, "kg", "1/m", "s/m", "m/s^2"])
def test_what_is_written_can_be_read(unit):
    """Contract: writing keeps twelve digits, reading loses none; the absolute part is for numbers below every unit."""
    dice = random.Random(unit)
    values = [dice.choice([1.0, -1.0]) * 10.0 ** dice.uniform(*powers) for powers in ((-6, 5), (-320, -290)) for _ in range(60)]
    values += [0.0, -0.0, 1e5, -1e5, 5e-324, 2.2250738585072014e-308, *(dice.uniform(-1e5, 1e5) for _ in range(30))]
    values += [sign * near for k in range(-9, 6) for near in (10.0**k, math.nextafter(10.0**k, 0.0)) for sign in (1.0, -1.0)]
    for value in values:
        assert read_quantity(rounded_text(value, unit), sd.Quantity(unit)) == pytest.approx(value, rel=1e-11, abs=1e-300)


@pytest.mark.parametrize(
    "quantity",
    [
        sd.Quantity("m", above=0.0),
        sd.Quantity("1", minimum=0.0, maximum=0.5),
        sd.Quantity("1", above=2.0, below=3.0),
        sd.Quantity("1", minimum=7.0),
    ],
)
def test_an_example_is_allowed(quantity):
    """Contract: the example in a message is accepted."""
    text = example(quantity)
    assert quantity.admits(read_quantity(float(text) if quantity.unit == "1" else text, quantity))


def test_rows_of_numbers_share_one_unit():
    """Closed form: thousandths."""
    assert read_numbers("0, 1 2.5,-3 ms", "s") == pytest.approx((0.0, 1e-3, 2.5e-3, -3e-3), rel=1e-15)
    for text, reason in (
        ("0 1 2", "missing unit"),
        ("ms", "a text without numbers"),
        ("0 nan ms", "not finite"),
        ("0 1 m", "wrong dimension"),
    ):
        with pytest.raises(sd.InputError, match=reason):
            read_numbers(text, "s")


def test_units_agree_with_pints_own_list():
    """Cross-check: every unit against the definitions that pint ships; hertz are revolutions and cycles are counts here."""
    import pint

    theirs = pint.UnitRegistry()
    base = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[angle]": "rad"}
    for definition in UNIT_DEFINITIONS:
        name = definition.split(" = ")[0]
        if name in ("hertz", "cycle"):
            continue
        target = f"{theirs.Quantity(1.0, name).to_base_units().units:~}".replace(" ", "").replace("**", "^")
        if name in ("radian", "degree", "turn"):
            target = base["[angle]"]
        elif name == "rpm":
            target = "rad/s"
        expected = theirs.Quantity(1.0, name).to(target).magnitude
        assert unit_factor(name, target) == pytest.approx(expected, rel=1e-14), name


@pytest.mark.parametrize(("unit", "target"), UNIT_FACTORS)
def test_usual_units_are_those_of_the_registry(unit, target):
    """Cross-check by a second formulation: the factors that are known without pint are pint's own to the last bit."""
    registry = _registry()
    assert registry.convert(1.0, registry.parse_units(unit), registry.parse_units(target)) == UNIT_FACTORS[unit, target]
    assert unit_factor(unit, target) == UNIT_FACTORS[unit, target]


@pytest.mark.parametrize("path", sorted(build.EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_usual_units_are_known_without_pint(path, monkeypatch):
    """Contract: no example needs the import of pint, which takes as long as many runs."""
    unit_factor.cache_clear()
    monkeypatch.setattr(quantity, "_registry", lambda: pytest.fail("pint is needed"))
    sd.read_case(path)


@pytest.mark.parametrize("unit", ["Grad", "Mdeg", "Grad/s"])
def test_an_angle_has_no_large_prefix(unit):
    """Contract: "Grad", a degree in German, is no gigaradian."""
    with pytest.raises(sd.InputError, match="did you mean 'deg'"):
        read_quantity(f"30 {unit}", sd.Quantity("rad/s" if "/" in unit else "rad"))
