"""A user's own laws as functions, from Python and from a file, alone and in whole runs."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from bouncing import JOINT, STATELESS, at, bounce, force, row, step

import scissordyn as sd
from scissordyn.errors import InputError
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.evaluate import elastic_force, friction_force, normal_force
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.trial import doubts, tried
from scissordyn.plugin.element import element, element_class
from scissordyn.run.simulate import replay
from scissordyn.units import Quantity, quantities

NOTHING = np.zeros(0)


@element(slot="stiffness")
def spring(indentation, stiffness, exponent=1.5):
    return stiffness * indentation**exponent


@element(slot="damping")
def lossy(elastic, rate, approach, xi: Annotated[float, Quantity("1", minimum=0.0, help="loss")] = 0.2):
    """A damping of the user's."""
    return elastic * (1.0 + xi * rate / approach)


@element(slot="friction")
def dry_friction(slip_speed, normal_force, mu):
    """A friction of the user's."""
    return mu * normal_force * math.tanh(slip_speed / 1e-4)


def stiffness(function):
    """A stiffness law that is one function without numbers."""
    return element(slot="stiffness")(function)()


def test_a_function_is_a_class_of_laws():
    """Contract: its arguments that are no inputs of the slot are fields, with their defaults and units."""
    assert spring(1e9).exponent == 1.5
    assert spring(stiffness=1e9, exponent=1.2) == spring(1e9, 1.2)
    assert [quantity.help for quantity in quantities(lossy).values()] == ["loss"]
    assert (lossy.name, lossy.__doc__) == ("lossy", "A damping of the user's.")
    with pytest.raises(InputError, match="xi = -1"):
        lossy(-1.0)
    exec(f"def many(indentation, {', '.join(f'a{k}' for k in range(17))}):\n    return 0.0", scope := {})
    with pytest.raises(InputError, match="stiffness law 'many' has 17 parameters; allowed: at most 16"):
        element(slot="stiffness")(scope["many"])


def test_elastic_is_the_built_in_one():
    """Cross-check: Hertz's law as a user's function gives the time history of Hertz's impact."""
    own, built_in, damping = spring(Hertz().parameters(JOINT)[0]), Hertz(), Flores(0.7)
    pair = [bounce(at(law), row(law), at(damping), row(damping), 0.5, 2.0, step(built_in, 2.0, 0.5)) for law in (own, built_in)]
    assert pair[0] == pytest.approx(pair[1], rel=1e-10)


def test_damping_and_friction_are_the_built_in_ones():
    """Cross-check: Flores's damping and Coulomb's friction as users' functions."""
    own, built_in = lossy(Flores(0.6).factor), Flores(0.6)
    for rate in (-0.4, 0.0, 0.7):
        pair = [normal_force(at(law), 321.0, 1e-5, rate, 0.5, STATELESS, STATELESS, row(law)) for law in (own, built_in)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)
    assert normal_force(at(own), 321.0, 1e-5, -9.0, 0.5, STATELESS, STATELESS, row(own)) == 0.0
    own, coulomb = dry_friction(0.05), Coulomb(0.05)
    for v in (-0.1, 2e-5, 0.0):
        pair = [friction_force(at(law), v, 100.0, NOTHING, NOTHING, row(law)) for law in (own, coulomb)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)


def test_many_laws_at_once():
    """Identity: any number of user laws live side by side, each with its own numbers and pointer."""
    laws = [spring(1e9 * k, 1.0) for k in (1, 2, 3)] + [stiffness(lambda indentation: 7e8 * indentation)]
    assert [force(law, 1e-5) for law in laws] == pytest.approx([1e4, 2e4, 3e4, 7e3], rel=1e-14)


def test_survives_pickling():
    """Contract: a law travels to another process; the pointer is found anew there."""
    law = pickle.loads(pickle.dumps(spring(1e9, 1.0)))
    assert force(law, 1e-5) == pytest.approx(1e4, rel=1e-14)


def gives_nothing(indentation):
    """No number."""


def gives_text(indentation):
    """No number either."""
    return "soft"


def unknown_name(indentation):
    """A slip of the pen."""
    return stiff_ness * indentation  # noqa: F821


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (gives_nothing, "'gives_nothing' returns nothing"),
        (gives_text, "gives_text: unsupported value 'soft' in a kernel; allowed: numbers"),
        (unknown_name, "unknown_name: 'stiff_ness' in 'unknown_name' has no value"),
    ],
)
def test_laws_that_cannot_be_compiled_are_named(function, says):
    """Limit: a law that gives no number or cannot be compiled is refused in one line that names it and the cause."""
    with pytest.raises(InputError) as caught:
        tried(stiffness(function), JOINT)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_exception_inside_a_run_is_nan():
    """Limit: a law that passes the trial and raises later gives NaN, never an exception out of a kernel."""
    law = stiffness(lambda indentation: indentation if indentation < 0.1 else 1.0 / math.sqrt(-indentation))
    tried(law, JOINT)
    assert math.isnan(elastic_force(at(law), 0.2, row(law)))


def test_from_file(tmp_path):
    """Contract: a law in a file by its name; another text of the file is another law."""
    file = tmp_path / "my_laws.py"
    text = "import scissordyn as sd\n\n\n@sd.element(slot='stiffness')\ndef soft(indentation):\n    return 2e9 * indentation\n"
    file.write_text(text)
    law = element_class("stiffness", "my_laws.py:soft", tmp_path)()
    assert force(law, 1e-5) == pytest.approx(2e4, rel=1e-14)
    file.write_text(text.replace("2e9", "3e9"))
    assert force(element_class("stiffness", "my_laws.py:soft", tmp_path)(), 1e-5) == pytest.approx(3e4, rel=1e-14)
    with pytest.raises(InputError, match="has changed"):
        pickle.loads(pickle.dumps(law).replace(type(law).origin[1].encode(), b"0" * 16))


@pytest.mark.parametrize(
    ("text", "reference", "says"),
    [
        (
            "def soft(indentation):\n    return 1.0\n",
            "laws.py:soft",
            "soft' is not a stiffness law; allowed: a class or a function",
        ),
        ("def soft(d:\n", "laws.py:soft", "SyntaxError, line 1"),
        ("import a_module_that_is_not_there\n", "laws.py:soft", "a_module_that_is_not_there"),
        ("", "laws.py:soft", "unknown stiffness law 'soft' in"),
        ("", "other.py:soft", "of the stiffness law 'soft' does not exist"),
        ("", "laws.txt:soft", "a Python file and a function in it"),
    ],
)
def test_unfit_files_are_named(tmp_path: Path, text, reference, says):
    """Limit: whatever is wrong with the file is said in one line."""
    (tmp_path / "laws.py").write_text(text)
    with pytest.raises(InputError) as caught:
        element_class("stiffness", reference, tmp_path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def pulls(indentation):
    return 1e9 * indentation * (2e-4 - indentation)


def preloaded(indentation):
    """A force without indentation."""
    return 100.0 + 1e9 * indentation


def negative(indentation):
    """A sign the wrong way round."""
    return -1e9 * indentation


def hollow(indentation):
    """Not a number between two indentations."""
    return math.nan if 1.5e-4 < indentation < 2.5e-4 else 1e9 * indentation


def logarithm(indentation):
    """Finite wherever it is called, not a number at zero."""
    return 1e9 * indentation * math.log(1.0 + 1e-3 / indentation)


def nothing(indentation):
    """No force at all."""
    return 0.0


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (pulls, "a push at one clearance: above 0 N"),
        (negative, "gives -500000.0 at indentation = 0.0005; allowed: a push at one clearance"),
        (preloaded, "gives 100.0 at indentation = 0; allowed: a push up to the clearance: 0 N or more, and 0 N at 0 m"),
        (hollow, "gives nan at indentation = 0.000156"),
        (logarithm, "raises ZeroDivisionError (float division by zero) at indentation = 0"),
        (nothing, "gives 0.0 at indentation = 0.0005"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_laws_that_cannot_be_right_in_their_joint(function, says):
    """Limit: a stiffness law that pulls, has a force at the touch or is no number up to the clearance is refused."""
    with pytest.raises(InputError) as caught:
        tried(stiffness(function), JOINT)
    assert says in str(caught.value)
    assert f"stiffness law '{function.__name__}'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_pull_beyond_the_clearance_is_not_tried():
    """Limit: the same law in a joint of 0.1 mm never gets to where it pulls; at a guide surface the corner's radius counts."""
    tried(stiffness(pulls), replace(JOINT, clearance=1e-4, journal_radius=1e-3))
    with pytest.raises(InputError, match="a push at one corner radius"):
        tried(stiffness(pulls), replace(JOINT, clearance=math.inf, journal_radius=2e-3))


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (lambda indentation: 1e9 * indentation, []),
        (lambda indentation: 1e9 * min(indentation, 2e-4), ["the force does not grow from 0.2031 mm to 0.2109 mm"]),
        (lambda indentation: 1e9 * max(indentation - 1e-5, 0.0), ["the force does not grow from 0 mm to 5e-07 mm"]),
        (lambda indentation: 1e9 * indentation * (6e-4 - indentation), ["the force does not grow from 0.2969 mm to 0.3047 mm"]),
    ],
)
def test_doubtful_stiffness(function, says):
    """Limit: a force that stays level or falls, but never pulls, is used and said."""
    texts = doubts(stiffness(function), JOINT)
    assert len(texts) == len(says)
    for text, start in zip(texts, says, strict=True):
        assert text.startswith(start)


def damping(function):
    """A damping law that is one function without numbers."""
    return element(slot="damping")(function)()


def test_damping_that_is_not_a_number():
    """Limit: a damping that fails for one sign of the rate, at a force between decades or at an indentation is refused."""
    with pytest.raises(InputError, match=r"damping law '<lambda>' raises ValueError .* rate = -10"):
        tried(damping(lambda elastic, rate: elastic * math.sqrt(1.0 + rate)), JOINT)
    with pytest.raises(InputError, match="damping law '<lambda>' gives nan at elastic = 10,"):
        tried(damping(lambda elastic: math.nan if 5.0 < elastic < 50.0 else elastic), JOINT)
    with pytest.raises(InputError, match=r"gives nan at .* indentation = 5e-10"):
        tried(damping(lambda elastic, indentation: elastic if indentation > 6e-10 else math.nan), JOINT)


def test_doubtful_damping():
    """Limit: a damping that adds energy on approach or on rebound is used and said; a cut-off pull is no gain."""
    assert doubts(lossy(0.3), JOINT) == []
    assert doubts(damping(lambda elastic, rate: elastic + 1e3 * rate), JOINT) == []
    (rebound,) = doubts(damping(lambda elastic, rate, approach: elastic * (1.0 + 0.3 * abs(rate) / approach)), JOINT)
    assert "raises the elastic force on rebound (1e+06 N at -10 m/s)" in rebound
    (approach,) = doubts(damping(lambda elastic: 0.9 * elastic), JOINT)
    assert "lowers the elastic force on approach" in approach


def friction(function):
    """A friction law that is one function without numbers."""
    return element(slot="friction")(function)()


def test_friction_that_cannot_be_right():
    """Limit: friction that is no number, or against the sign of the slip speed, is refused; one-sided friction is not."""
    with pytest.raises(InputError, match=r"raises ZeroDivisionError .* at slip_speed = 0, normal_force = 0.001;"):
        tried(friction(lambda slip_speed, normal_force: normal_force / slip_speed if normal_force > 0.0 else 0.0), JOINT)
    with pytest.raises(InputError, match="a force of the sign of the slip speed"):
        tried(friction(lambda slip_speed, normal_force: -0.1 * normal_force * math.tanh(slip_speed)), JOINT)

    def turning(slip_speed, normal_force):
        return 0.1 * normal_force * math.tanh(slip_speed) if normal_force < 5.0 else -normal_force * slip_speed

    with pytest.raises(InputError, match=r"gives 100.0 at slip_speed = -10, normal_force = 10;"):
        tried(friction(turning), JOINT)
    assert doubts(friction(lambda slip_speed, normal_force: 0.1 * normal_force * max(slip_speed, 0.0)), JOINT) == []


def test_doubtful_friction():
    """Limit: friction without a normal force, and a coefficient above 10, are said."""
    (text,) = doubts(friction(lambda slip_speed, normal_force: (1.0 + 0.1 * normal_force) * math.tanh(slip_speed)), JOINT)[:1]
    assert text == "it gives a force where the normal force is zero"
    (text,) = doubts(friction(lambda slip_speed, normal_force: 2.0 * normal_force * slip_speed), JOINT)
    assert text == "its friction coefficient reaches 20 at 10 m/s or less"


def own():
    """A clearance with Liu's law, in no file."""

    @element(slot="stiffness")
    def foundation(indentation, stiffness=JOINT.length * 0.5 * np.pi * JOINT.modulus, clearance=0.5e-3):
        """Written by a user."""
        return stiffness * indentation * (indentation / (2.0 * (clearance + indentation))) ** 0.5

    return sd.Clearance(0.5e-3, stiffness=foundation())


def test_own_law_gives_the_same_run(array, clearance_run):
    """Cross-check: the user's copy of a built-in law gives its contacts to round-off's growth."""
    run = sd.simulate(array.with_clearance("A", own()), until=0.05)
    assert np.allclose(run["contact_start"][:5], clearance_run["contact_start"][:5], rtol=1e-8)
    assert np.allclose(run["peak_force"][:5], clearance_run["peak_force"][:5], rtol=1e-6)


def test_own_function_is_recorded_but_not_executed(array, tmp_path):
    """Contract: a saved run holds the source of a user's function; running it again asks for a file in one line."""
    run = sd.simulate(array.with_clearance("A", own()), until=0.001, samples=11)
    with pytest.warns(UserWarning, match=r"cannot be run again .* is in no file"):
        loaded = sd.load(sd.save(run, tmp_path / "run.nc"))
    assert "Written by a user" in loaded.attrs["configuration"]
    with pytest.raises(InputError, match=r"mine\.py:foundation"):
        replay(loaded)


def test_law_that_breaks_off_ends_the_run(array):
    """Contract: a law that gives NaN inside the run ends it with what was computed, the time and the joint."""
    hole = stiffness(lambda indentation: 1e9 * indentation if abs(indentation - 5.25e-5) > 1.5e-6 else math.nan)  # untried
    run = sd.simulate(array.with_clearance("A", sd.Clearance(0.5e-3, stiffness=hole)), until=0.05)
    assert run.attrs["status"] == "failed"
    assert "'A'" in run.attrs["cause"]
    assert "not a number" in run.attrs["cause"]
    assert np.all(np.isfinite(run["slider_position"]))
