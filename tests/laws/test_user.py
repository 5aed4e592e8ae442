"""A user's own laws, from Python and from a file."""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys

import numba
import numpy as np
import pytest
from bouncing import JOINT, bounce, force, row, step

from scissordyn.errors import InputError
from scissordyn.laws import catalogue
from scissordyn.laws.damping.flores import Flores
from scissordyn.laws.dispatch import elastic_force, friction_force, normal_force
from scissordyn.laws.elastic.hertz import Hertz
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
        bounce(law.kernel_kind, row(law), damping.kernel_kind, row(damping), 0.5, 2.0, step(built_in, 2.0, 0.5))
        for law in (own, built_in)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-10)


def test_damping_and_friction_are_the_built_in_ones():
    """Cross-check: Flores's damping and Coulomb's friction as users' functions."""
    own, built_in = UserDamping(factor, (Flores(0.6).factor,)), Flores(0.6)
    for rate in (-0.4, 0.0, 0.7):
        pair = [normal_force(law.kernel_kind, 321.0, 1e-5, rate, 0.5, row(law)) for law in (own, built_in)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)
    assert normal_force(own.kernel_kind, 321.0, 1e-5, -9.0, 0.5, row(own)) == 0.0
    own, coulomb = UserFriction(dry_friction, (0.05,)), Coulomb(0.05)
    for v in (-0.1, 2e-5, 0.0):
        pair = [friction_force(law.kernel_kind, v, 100.0, NOTHING, NOTHING, row(law)) for law in (own, coulomb)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)


def test_many_laws_at_once():
    """Identity: any number of user laws live side by side, each with its own constants and address."""
    laws = [UserElastic(spring, (1e9 * k, 1.0)) for k in (1, 2, 3)] + [UserElastic(lambda delta: 7e8 * delta)]
    assert [force(law, 1e-5) for law in laws] == pytest.approx([1e4, 2e4, 3e4, 7e3], rel=1e-14)


def test_a_compiled_function_is_as_good():
    """Identity: a function that the user has compiled already."""
    assert force(UserElastic(numba.njit(spring), (1e9, 1.0)), 1e-5) == pytest.approx(1e4, rel=1e-14)


def test_address_is_exact():
    """Identity: the address survives the row of float64."""
    address = UserElastic(spring, (1e9, 1.0)).parameters(JOINT)[0]
    assert address == int(address)
    assert 0 < address < 2**53


def test_survives_pickling():
    """Identity: a description travels to another process; the address is found anew there."""
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
    assert math.isnan(elastic_force(law.kernel_kind, 0.2, row(law)))


def test_exceptions_of_friction_and_damping_are_named():
    """Limit: the other two kinds are tried and named too."""
    with pytest.raises(
        InputError, match=r"friction law '<lambda>' raises ZeroDivisionError .* at slip_speed = 0, normal_force = 1;"
    ):
        UserFriction(lambda v, n: n / v if n > 0.0 else 0.0)
    with pytest.raises(InputError, match="damping law '<lambda>'"):
        UserDamping(lambda elastic, delta, rate, approach: math.nan)


def test_from_file(tmp_path):
    """Identity: a law in a file by its name; the saved description refuses the file once it has been edited."""
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
        ("def soft(d):\n    return d\n", "laws.py:sofd", "did you mean 'soft'"),
        ("def soft(d:\n", "laws.py:soft", "SyntaxError, line 1"),
        ("import a_module_that_is_not_there\n", "laws.py:soft", "a_module_that_is_not_there"),
        ("", "other.py:soft", "no file"),
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


def test_an_edit_counts_in_the_next_process(tmp_path):
    """Identity: kernels come from the disk cache, the user's law from the file as it is now."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path; import bouncing; from scissordyn.laws import catalogue\n"
        "print(bouncing.force(catalogue.from_file('my_laws.py:soft', 'stiffness', Path(sys.argv[2])), 1e-5))\n"
        "print(sum(bouncing.elastic_force.stats.cache_misses.values()))\n"
    )
    environment = {**os.environ, "SCISSORDYN_CACHE": str(tmp_path / "cache")}
    forces, compiled = [], []
    for stiffness in ("2e9", "3e9"):  # the same size and, to the second, the same time
        (tmp_path / "my_laws.py").write_text(f"def soft(indentation):\n    return {stiffness} * indentation\n")
        command = [sys.executable, "-c", program, os.path.dirname(__file__), tmp_path]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        force_text, misses = done.stdout.split()
        forces.append(float(force_text))
        compiled.append(int(misses))
    assert forces == pytest.approx([2e4, 3e4], rel=1e-14)
    assert compiled == [1, 0]
