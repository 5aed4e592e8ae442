"""User-defined laws as functions, from Python and from a file, alone and in whole runs."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from typing import Annotated

import numpy as np
import pytest
from bouncing import JOINT, STATELESS, at, bounce, force, row, step
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.laws.evaluate import elastic_force, friction_force, normal_force
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.trial import doubts, trial_forces
from scissordyn.plugin.element import element_class
from scissordyn.units import quantities


@sd.element(slot="stiffness")
def spring(indentation, stiffness, exponent=1.5):
    return stiffness * indentation**exponent


@sd.element(slot="damping")
def lossy(elastic, rate, approach, xi: Annotated[float, sd.Quantity("1", minimum=0.0, help="loss")] = 0.2):
    """Return the damping force of a law that a user defines."""
    return elastic * (1.0 + xi * rate / approach)


@sd.element(slot="friction")
def dry_friction(slip_speed, normal_force, mu):
    """Return the friction force of a law that a user defines."""
    return mu * normal_force * math.tanh(slip_speed / 1e-4)


def made_of(slot, function):
    """Return a law made of one function without parameters."""
    return sd.element(slot=slot)(function)()


def stiffness(function):
    """Return a stiffness law made of one function without parameters."""
    return made_of("stiffness", function)


def test_function_becomes_a_law():
    """Contract: arguments that are not inputs of the slot become fields, with their defaults and units."""
    assert spring(1e9).exponent == 1.5
    assert spring(stiffness=1e9, exponent=1.2) == spring(1e9, 1.2)
    assert [quantity.help for quantity in quantities(lossy).values()] == ["loss"]
    assert (lossy.name, lossy.__doc__) == ("lossy", "Return the damping force of a law that a user defines.")
    with pytest.raises(sd.InputError, match="xi = -1"):
        lossy(-1.0)
    exec(f"def many(indentation, {', '.join(f'a{k}' for k in range(17))}):\n    return 0.0", scope := {})
    with pytest.raises(sd.InputError, match="stiffness law 'many' has 17 parameters; expected at most 16"):
        sd.element(slot="stiffness")(scope["many"])


def test_users_hertz_equals_the_built_in_law():
    """Cross-check: Hertz's law as a user's function gives the same impact."""
    own, built_in, damping = spring(sd.Hertz().parameters(JOINT)[0]), sd.Hertz(), sd.Flores(0.7)
    pair = [bounce(at(law), row(law), at(damping), row(damping), 0.5, 2.0, step(built_in, 2.0, 0.5)) for law in (own, built_in)]
    assert pair[0] == pytest.approx(pair[1], rel=1e-10)


def test_users_damping_and_friction_equal_the_built_in_laws():
    """Cross-check: Flores's damping and Coulomb's friction as users' functions give the same forces."""
    own, built_in = lossy(sd.Flores(0.6).factor), sd.Flores(0.6)
    for rate in (-0.4, 0.0, 0.7):
        pair = [normal_force(at(law), 321.0, 1e-5, rate, 0.5, STATELESS, STATELESS, row(law)) for law in (own, built_in)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)
    assert normal_force(at(own), 321.0, 1e-5, -9.0, 0.5, STATELESS, STATELESS, row(own)) == 0.0
    own, coulomb = dry_friction(0.05), Coulomb(0.05)
    for v in (-0.1, 2e-5, 0.0):
        pair = [friction_force(at(law), v, 100.0, STATELESS, STATELESS, row(law)) for law in (own, coulomb)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)


def test_several_laws_at_once():
    """Contract: user laws live side by side, each with its own values and pointer."""
    laws = [spring(1e9 * k, 1.0) for k in (1, 2, 3)] + [stiffness(lambda indentation: 7e8 * indentation)]
    assert [force(law, 1e-5) for law in laws] == pytest.approx([1e4, 2e4, 3e4, 7e3], rel=1e-14)


def test_law_survives_pickling():
    """Contract: a law can be sent to another process, which looks up its pointer again."""
    law = pickle.loads(pickle.dumps(spring(1e9, 1.0)))
    assert force(law, 1e-5) == pytest.approx(1e4, rel=1e-14)


def gives_nothing(indentation):
    """Return None."""


def gives_text(indentation):
    """Return a text."""
    return "soft"


def unknown_name(indentation):
    """Use a name that is not defined."""
    return stiff_ness * indentation  # noqa: F821


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (gives_nothing, "'gives_nothing' returns nothing"),
        (gives_text, "gives_text: unsupported value 'soft' in a kernel; expected numbers"),
        (unknown_name, "unknown_name: 'stiff_ness' in 'unknown_name' has no value"),
    ],
)
def test_laws_that_cannot_be_compiled(function, says):
    """Contract: a law that returns no number or cannot be compiled is refused in one line with its name and the cause."""
    with one_line_error(says):
        trial_forces(stiffness(function), JOINT)


def test_exception_inside_a_run_is_nan():
    """Contract: a law that passes the trial and raises later gives NaN; no exception leaves a kernel."""
    law = stiffness(lambda indentation: indentation if indentation < 0.1 else 1.0 / math.sqrt(-indentation))
    trial_forces(law, JOINT)
    assert math.isnan(elastic_force(at(law), 0.2, row(law)))


def test_law_from_a_file(tmp_path):
    """Contract: a law is read from a file by name; if the file's text changes, its law is another one."""
    file = tmp_path / "my_laws.py"
    text = "import scissordyn as sd\n\n\n@sd.element(slot='stiffness')\ndef soft(indentation):\n    return 2e9 * indentation\n"
    file.write_text(text)
    law = element_class("stiffness", "my_laws.py:soft", tmp_path)()
    assert force(law, 1e-5) == pytest.approx(2e4, rel=1e-14)
    file.write_text(text.replace("2e9", "3e9"))
    assert force(element_class("stiffness", "my_laws.py:soft", tmp_path)(), 1e-5) == pytest.approx(3e4, rel=1e-14)
    with pytest.raises(sd.InputError, match="has changed"):
        pickle.loads(pickle.dumps(law).replace(type(law).origin[1].encode(), b"0" * 16))


@pytest.mark.parametrize(
    ("text", "reference", "says"),
    [
        (
            "def soft(indentation):\n    return 1.0\n",
            "laws.py:soft",
            "soft' is not a stiffness law; expected a class or a function",
        ),
        ("def soft(d:\n", "laws.py:soft", "SyntaxError, line 1"),
        ("import a_module_that_is_not_there\n", "laws.py:soft", "a_module_that_is_not_there"),
        ("", "laws.py:soft", "unknown stiffness law 'soft' in"),
        ("", "other.py:soft", "of the stiffness law 'soft' does not exist"),
        ("", "laws.txt:soft", "a Python file and a function in it"),
    ],
)
def test_unfit_files(tmp_path, text, reference, says):
    """Contract: an error of one line says what is wrong with the file."""
    (tmp_path / "laws.py").write_text(text)
    with one_line_error(says):
        element_class("stiffness", reference, tmp_path)


def pulls(indentation):
    return 1e9 * indentation * (2e-4 - indentation)


def preloaded(indentation):
    """Push without indentation."""
    return 100.0 + 1e9 * indentation


def negative(indentation):
    """Pull."""
    return -1e9 * indentation


def hollow(indentation):
    """Return NaN between two indentations."""
    return math.nan if 1.5e-4 < indentation < 2.5e-4 else 1e9 * indentation


def logarithm(indentation):
    """Raise at zero, where its limit is finite."""
    return 1e9 * indentation * math.log(1.0 + 1e-3 / indentation)


def nothing(indentation):
    """Return no force at any indentation."""
    return 0.0


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (pulls, "a push at one clearance: above 0 N"),
        (negative, "gives -500000.0 at indentation = 0.0005; expected a push at one clearance"),
        (preloaded, "gives 100.0 at indentation = 0; expected a push up to the clearance: 0 N or more, and 0 N at 0 m"),
        (hollow, "gives nan at indentation = 0.000156"),
        (logarithm, "raises ZeroDivisionError (float division by zero) at indentation = 0"),
        (nothing, "gives 0.0 at indentation = 0.0005"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_stiffness_that_is_refused_in_its_joint(function, says):
    """Contract: a stiffness law that pulls, pushes without indentation or gives NaN up to the clearance is refused."""
    with one_line_error(f"stiffness law '{function.__name__}'", says):
        trial_forces(stiffness(function), JOINT)


def test_stiffness_is_tried_up_to_the_clearance():
    """Contract: a pull beyond the clearance is accepted; at a plane surface the radius of corner or disc is the limit."""
    trial_forces(stiffness(pulls), replace(JOINT, clearance=1e-4, journal_radius=1e-3))
    for gap, what in ((1e-4, "corner radius"), (0.0, "radius")):
        with one_line_error(f"a push at one {what}"):
            trial_forces(stiffness(pulls), replace(JOINT, clearance=math.inf, journal_radius=2e-3, gap=gap))


def repelled(slip_speed, normal_force):
    """Return a friction force that accelerates the sliding where the normal force is large."""
    return 0.1 * normal_force * math.tanh(slip_speed) if normal_force < 5.0 else -normal_force * slip_speed


@pytest.mark.parametrize(
    ("slot", "function", "says"),
    [
        ("damping", lambda elastic, rate: elastic * math.sqrt(1.0 + rate), "raises ValueError"),
        ("damping", lambda elastic: math.nan if 5.0 < elastic < 50.0 else elastic, "gives nan at elastic = 10,"),
        ("damping", lambda elastic, indentation: elastic if indentation > 6e-10 else math.nan, "gives nan at"),
        (
            "friction",
            lambda slip_speed, normal_force: normal_force / slip_speed if normal_force > 0.0 else 0.0,
            "raises ZeroDivisionError (float division by zero) at slip_speed = 0, normal_force = 0.001;",
        ),
        (
            "friction",
            lambda slip_speed, normal_force: -0.1 * normal_force * math.tanh(slip_speed),
            "the sign of the slip speed",
        ),
        ("friction", repelled, "gives 100.0 at slip_speed = -10, normal_force = 10;"),
    ],
)
def test_damping_and_friction_that_are_refused(slot, function, says):
    """Contract: damping that gives NaN for some arguments, and friction that drives the sliding, are refused."""
    with one_line_error(says):
        trial_forces(made_of(slot, function), JOINT)


@pytest.mark.parametrize(
    ("slot", "function", "says"),
    [
        ("stiffness", lambda indentation: 1e9 * indentation, ""),
        ("stiffness", lambda indentation: 1e9 * min(indentation, 2e-4), "the force does not grow from 0.2031 mm to 0.2109 mm"),
        ("stiffness", lambda indentation: 1e9 * max(indentation - 1e-5, 0.0), "the force does not grow from 0 mm to 5e-07 mm"),
        (
            "stiffness",
            lambda indentation: 1e9 * indentation * (6e-4 - indentation),
            "the force does not grow from 0.2969 mm to 0.3047 mm",
        ),
        ("damping", lambda elastic, rate, approach: elastic * (1.0 + 0.3 * rate / approach), ""),
        ("damping", lambda elastic, rate: elastic + 1e3 * rate, ""),  # a pull is cut off
        (
            "damping",
            lambda elastic, rate, approach: elastic * (1.0 + 0.3 * abs(rate) / approach),
            "raises the elastic force on rebound (1e+06 N at -10 m/s)",
        ),
        ("damping", lambda elastic: 0.9 * elastic, "lowers the elastic force on approach"),
        ("friction", lambda slip_speed, normal_force: 0.1 * normal_force * max(slip_speed, 0.0), ""),
        (
            "friction",
            lambda slip_speed, normal_force: (1e-3 + 0.1 * normal_force) * math.tanh(slip_speed),
            "it gives a force where the normal force is zero",
        ),
        (
            "friction",
            lambda slip_speed, normal_force: 2.0 * normal_force * slip_speed,
            "its friction coefficient reaches 20 at 10 m/s or less",
        ),
    ],
)
def test_doubtful_laws(slot, function, says):
    """Contract: a law that is unlikely but possible is used, with a text that describes the doubt."""
    texts = doubts(made_of(slot, function), JOINT)
    assert len(texts) == bool(says)
    assert says in "".join(texts)


def users_clearance():
    """Return a clearance with Liu's law, defined in no file."""

    @sd.element(slot="stiffness")
    def foundation(indentation, stiffness=JOINT.length * 0.5 * np.pi * JOINT.modulus, clearance=0.5e-3):
        """Return the elastic force of a law that a user defines."""
        return stiffness * indentation * (indentation / (2.0 * (clearance + indentation))) ** 0.5

    return sd.Clearance(0.5e-3, stiffness=foundation())


def test_users_function_is_recorded_but_not_executed(array, tmp_path):
    """Contract: a saved run holds the source of a user's function; to run it again the error asks for a file."""
    run = sd.simulate(array.with_clearance("A", users_clearance()), until=0.001, samples=11)
    with pytest.warns(UserWarning, match=r"cannot be run again: .* is not defined in a file"):
        loaded = sd.load(sd.save(run, tmp_path / "run.nc"))
    assert "Return the elastic force of a law" in loaded.attrs["configuration"]
    with pytest.raises(sd.InputError, match=r"mine\.py:foundation"):
        sd.replay(loaded)


def test_law_that_gives_nan_ends_the_run(array):
    """Contract: NaN inside a run ends it; the results so far stay, and the cause names the time and the joint."""
    hole = stiffness(lambda indentation: 1e9 * indentation if abs(indentation - 5.25e-5) > 1.5e-6 else math.nan)
    run = sd.simulate(array.with_clearance("A", sd.Clearance(0.5e-3, stiffness=hole)), until=0.05)
    assert run.attrs["status"] == "failed"
    assert "'A'" in run.attrs["cause"]
    assert "not a number" in run.attrs["cause"]
    assert np.all(np.isfinite(run["slider_position"]))
