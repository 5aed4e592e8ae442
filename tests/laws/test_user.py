"""A user's own laws, from Python and from a file."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from bouncing import JOINT, at, bounce, force, row, step

from scissordyn.errors import InputError
from scissordyn.laws import catalogue
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.evaluate import elastic_force, friction_force, normal_force
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.user import UserDamping, UserElastic, UserFriction

NOTHING = np.zeros(0)


def spring(indentation, stiffness, exponent):
    """A power law of the user's."""
    return stiffness * indentation**exponent


def factor(elastic, indentation, rate, approach, xi):
    """A damping of the user's."""
    return elastic * (1.0 + xi * rate / approach)


def dry_friction(slip_speed, normal_force, mu):
    """A friction of the user's."""
    return mu * normal_force * math.tanh(slip_speed / 1e-4)


def shallow(indentation):
    """A law that gives up at 1 um."""
    if indentation > 1e-6:
        raise ValueError("too deep")
    return 1e9 * indentation


def test_elastic_is_the_built_in_one():
    """Cross-check: Hertz's law as a user's function gives the time history of Hertz's impact."""
    stiffness = Hertz().parameters(JOINT)[0]
    own, built_in, damping = UserElastic(spring, (stiffness, 1.5)), Hertz(), Flores(0.7)
    found = [
        bounce(at(law), row(law), at(damping), row(damping), 0.5, 2.0, step(built_in, 2.0, 0.5)) for law in (own, built_in)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-10)


def test_damping_and_friction_are_the_built_in_ones():
    """Cross-check: Flores's damping and Coulomb's friction as users' functions."""
    own, built_in = UserDamping(factor, (Flores(0.6).factor,)), Flores(0.6)
    for rate in (-0.4, 0.0, 0.7):
        pair = [normal_force(at(law), 321.0, 1e-5, rate, 0.5, row(law)) for law in (own, built_in)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)
    assert normal_force(at(own), 321.0, 1e-5, -9.0, 0.5, row(own)) == 0.0
    own, coulomb = UserFriction(dry_friction, (0.05,)), Coulomb(0.05)
    for v in (-0.1, 2e-5, 0.0):
        pair = [friction_force(at(law), v, 100.0, NOTHING, NOTHING, row(law)) for law in (own, coulomb)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)


def test_many_laws_at_once():
    """Identity: any number of user laws live side by side, each with its own constants and address."""
    laws = [UserElastic(spring, (1e9 * k, 1.0)) for k in (1, 2, 3)] + [UserElastic(lambda delta: 7e8 * delta)]
    assert [force(law, 1e-5) for law in laws] == pytest.approx([1e4, 2e4, 3e4, 7e3], rel=1e-14)


def test_survives_pickling():
    """Contract: a description travels to another process; the address is found anew there."""
    law = pickle.loads(pickle.dumps(UserElastic(spring, (1e9, 1.0))))
    assert force(law, 1e-5) == pytest.approx(1e4, rel=1e-14)


def gives_nothing(indentation):
    """No number."""


def gives_text(indentation):
    """No number either."""
    return "soft"


def gives_nan(indentation):
    """Not a number, from 0.3 mm on."""
    return math.nan if indentation > 3e-4 else indentation


def unknown_name(indentation):
    """A slip of the pen."""
    return stiff_ness * indentation  # noqa: F821


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (gives_nothing, "gives None"),
        (gives_text, "gives 'soft'"),
        (gives_nan, "gives nan at indentation = 0.000316"),
        (unknown_name, "stiff_ness"),
        (shallow, "raises ValueError (too deep) at indentation"),
        (spring, "missing a required argument: 'stiffness'"),
        (3.0, "3.0 as a stiffness law"),
    ],
)
def test_unfit_laws_are_named(function, says):
    """Limit: a law that raises, gives no number or cannot be compiled is refused in one line that names it and the cause."""
    with pytest.raises(InputError) as caught:
        UserElastic(function)
    text = str(caught.value)
    assert says in text
    assert getattr(function, "__name__", "3.0") in text
    assert "\n" not in text


def test_unfit_constants():
    """Limit: constants that are not finite numbers, or too many, are refused."""
    with pytest.raises(InputError, match="finite numbers"):
        UserElastic(spring, (math.inf, 1.5))
    with pytest.raises(InputError, match="at most 15"):
        UserElastic(lambda delta, *more: delta, (1.0,) * 16)


def test_an_exception_inside_a_run_is_nan():
    """Limit: a law that passes the trial and raises later gives NaN, never an exception out of a kernel."""
    law = UserElastic(lambda delta: delta if delta < 0.1 else 1.0 / math.sqrt(-delta))
    assert math.isnan(elastic_force(at(law), 0.2, row(law)))


def test_exceptions_of_friction_and_damping_are_named():
    """Limit: the other two kinds are tried and named too."""
    with pytest.raises(
        InputError, match=r"friction law '<lambda>' raises ZeroDivisionError .* at slip_speed = 0, normal_force = 0.001;"
    ):
        UserFriction(lambda v, n: n / v if n > 0.0 else 0.0)
    with pytest.raises(InputError, match="damping law '<lambda>'"):
        UserDamping(lambda elastic, delta, rate, approach: math.nan)


def test_from_file(tmp_path):
    """Contract: a law in a file by its name; the saved description refuses the file once it has been edited."""
    file = tmp_path / "my_laws.py"
    file.write_text("import math\n\n\ndef soft(indentation):\n    return 2e9 * indentation\n")
    law = catalogue.from_file("my_laws.py:soft", "stiffness", tmp_path)
    assert force(law, 1e-5) == pytest.approx(2e4, rel=1e-14)
    file.write_text(file.read_text().replace("2e9", "3e9"))
    assert force(catalogue.from_file("my_laws.py:soft", "stiffness", tmp_path), 1e-5) == pytest.approx(3e4, rel=1e-14)
    with pytest.raises(InputError, match="has changed"):
        law.parameters(JOINT)


@pytest.mark.parametrize(
    ("text", "reference", "says"),
    [
        ("def soft(d):\n    return d\n", "laws.py:sofd", "no stiffness law 'sofd' in"),
        ("def soft(d):\n    return d\n", "laws.py:sofd", "did you mean 'soft'"),
        ("def soft(d:\n", "laws.py:soft", "SyntaxError, line 1"),
        ("import a_module_that_is_not_there\n", "laws.py:soft", "a_module_that_is_not_there"),
        ("", "other.py:soft", "for the stiffness law 'soft'"),
        ("", "laws.txt:soft", "a Python file and a function in it"),
    ],
)
def test_unfit_files_are_named(tmp_path, text, reference, says):
    """Limit: whatever is wrong with the file is said in one line."""
    (tmp_path / "laws.py").write_text(text)
    with pytest.raises(InputError) as caught:
        catalogue.from_file(reference, "stiffness", tmp_path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def pulls(indentation):
    """Pushes up to 0.2 mm and pulls beyond."""
    return 1e9 * indentation * (2e-4 - indentation)


def preloaded(indentation):
    """A force without indentation."""
    return 100.0 + 1e9 * indentation


def negative(indentation):
    """A sign the wrong way round."""
    return -1e9 * indentation


def hollow(indentation):
    """Not a number between two of the indentations of the first trial, 0.1 mm and 0.316 mm."""
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
    law = UserElastic(function)
    with pytest.raises(InputError) as caught:
        law.parameters(JOINT)
    assert says in str(caught.value)
    assert f"stiffness law '{function.__name__}'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_pull_beyond_the_clearance_is_not_tried():
    """Limit: the same law in a joint of 0.1 mm never gets to where it pulls; at a guide surface the corner's radius counts."""
    assert UserElastic(pulls).parameters(replace(JOINT, clearance=1e-4, journal_radius=1e-3)) == ()
    flat = replace(JOINT, clearance=math.inf, journal_radius=2e-3)
    with pytest.raises(InputError, match="a push at one corner radius"):
        UserElastic(pulls).parameters(flat)


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (lambda delta: 1e9 * delta, []),
        (lambda delta: 1e9 * min(delta, 2e-4), ["the force does not grow from 0.2031 mm to 0.2109 mm"]),
        (lambda delta: 1e9 * max(delta - 1e-5, 0.0), ["the force does not grow from 0 mm to 5e-07 mm"]),
        (lambda delta: 1e9 * delta * (6e-4 - delta), ["the force does not grow from 0.2969 mm to 0.3047 mm"]),
    ],
)
def test_doubtful_stiffness(function, says):
    """Limit: a force that stays level or falls, but never pulls, is used and said."""
    found = UserElastic(function).doubts(JOINT)
    assert len(found) == len(says)
    for text, start in zip(found, says, strict=True):
        assert text.startswith(start)


def test_damping_that_is_not_a_number():
    """Limit: a damping that fails for one sign of the rate, or only at a force between decades, is refused when it is given."""
    with pytest.raises(InputError, match=r"damping law '<lambda>' raises ValueError .* rate = -10"):
        UserDamping(lambda elastic, delta, rate, approach: elastic * math.sqrt(1.0 + rate))
    with pytest.raises(InputError, match="damping law '<lambda>' gives nan at elastic = 10,"):
        UserDamping(lambda elastic, delta, rate, approach: math.nan if 5.0 < elastic < 50.0 else elastic)
    with pytest.raises(InputError, match=r"gives nan at .* indentation = 5e-10"):
        UserDamping(lambda elastic, delta, rate, approach: elastic if delta > 6e-10 else math.nan).parameters(JOINT)


def test_doubtful_damping():
    """Limit: a damping that adds energy on approach or on rebound is used and said; a cut-off pull is no gain."""
    assert UserDamping(factor, (0.3,)).doubts(JOINT) == []
    assert UserDamping(lambda elastic, delta, rate, approach: elastic + 1e3 * rate).doubts(JOINT) == []
    (rebound,) = UserDamping(lambda elastic, delta, rate, approach: elastic * (1.0 + 0.3 * abs(rate) / approach)).doubts(JOINT)
    assert "raises the elastic force on rebound (1e+06 N at -10 m/s)" in rebound
    (approach,) = UserDamping(lambda elastic, delta, rate, approach: 0.9 * elastic).doubts(JOINT)
    assert "lowers the elastic force on approach" in approach


def test_friction_that_drives_is_refused():
    """Limit: a friction law against the sign of the slip speed would drive the surfaces; one-sided friction would not."""
    with pytest.raises(InputError, match="a force of the sign of the slip speed"):
        UserFriction(lambda slip, normal: -0.1 * normal * math.tanh(slip))
    with pytest.raises(InputError, match=r"gives 100.0 at slip_speed = -10, normal_force = 10;"):
        UserFriction(lambda slip, normal: 0.1 * normal * math.tanh(slip) if normal < 5.0 else -normal * slip)
    assert UserFriction(lambda slip, normal: 0.1 * normal * max(slip, 0.0)).doubts(JOINT) == []


def test_doubtful_friction():
    """Limit: friction without a normal force, and a coefficient above 10, are said."""
    (text,) = UserFriction(lambda slip, normal: (1.0 + 0.1 * normal) * math.tanh(slip)).doubts(JOINT)[:1]
    assert text == "it gives a force where the normal force is zero"
    (text,) = UserFriction(lambda slip, normal: 2.0 * normal * slip).doubts(JOINT)
    assert text == "its friction coefficient reaches 20 at 10 m/s or less"
