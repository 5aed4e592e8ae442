"""Components of a user's own: from Python and from a file, with states and guards, refused where they are wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.elastic.power_law import PowerLaw

from .shared import ENDS, METHODS, TIGHT, assert_balance, assert_documented, ball_on, checked, phases, read

# Python file with a user-defined component, a rubber band
RUBBER = '''
from typing import Annotated
import scissordyn as sd


def force(length, rate, stiffness, free_length):
    stretch = length - free_length
    return stiffness * stretch**3, 0.25 * stiffness * stretch**4, 0.0


@sd.component(port="line", force=force)
class RubberBand:
    """A cubic spring."""

    name: str
    start: tuple[str, str]
    end: tuple[str, str]
    stiffness: Annotated[float, sd.Quantity("N/m^3", above=0.0, help="of the cube of the stretch")]
    free_length: Annotated[float, sd.Quantity("m", minimum=0.0)] = 0.1
'''

# Case file with a ball on a user-defined rubber band
CASE = """
[structure]
kind = "mechanism"
gravity = "0 m/s^2"

[[ground]]
name = "O"
position = "0, 0 m"

[[body]]
name = "ball"
mass = "2 kg"
points = { centre = "0, 0 m" }
position = "0.5, 0 m"
velocity = "0, 0.3 m/s"

[[component]]
type = "rubber.py:RubberBand"
name = "band"
start = "ground.O"
end = "ball.centre"
stiffness = "900 N/m^3"

[run]
until = "1 s"
"""


PLACES = {"line": ("start", "end"), "frame": ("start", "end"), "point": ("point",), "travel": ("point",)}
"""Names of the fields of a component that are points of bodies, by port."""


def own(name: str, at: str, force: Any, numbers: Mapping[str, str] = MappingProxyType({}), **options: Any) -> Any:
    """Return a class of components at the port `at`; `numbers` are the units of its parameters by name."""
    fields: dict[str, Any] = {"name": str, **dict.fromkeys(PLACES[at], tuple[str, str])}
    fields |= {number: Annotated[float, sd.Quantity(unit, minimum=0.0)] for number, unit in numbers.items()}
    return sd.component(**{"port": at, "force": force, **options})(type(name, (), {"__annotations__": fields}))


SLIP = sd.State("slip", "m", scale=1e-2)  # Internal state of a user-defined component


def maxwell_force(length, rate, slip, stiffness, viscosity, free_length):
    """Return the force of a spring and a dashpot in series; the state is the elongation of the dashpot."""
    tension = stiffness * (length - free_length - slip)
    return tension, 0.5 * tension * tension / stiffness, tension * tension / viscosity, slip, tension / viscosity


Maxwell = own(
    *("Maxwell", "line", maxwell_force),
    {"stiffness": "N/m", "viscosity": "N s/m", "free_length": "m"},
    states=(SLIP,),
    outputs=(sd.Output("slip", "m", "of the dashpot"),),
)


def rope_gap(length, rate, mode, stiffness, free_length):
    """Copy of a kernel of the package's cable."""
    return length - free_length, rate


def rope_force(length, rate, mode, stiffness, free_length):
    """Copy of a kernel of the package's cable."""
    stretch = length - free_length
    if mode == 0.0 or stretch <= 0.0:
        return 0.0, 0.0, 0.0
    return stiffness * stretch, 0.5 * stiffness * stretch * stretch, 0.0


ROPE = {"stiffness": "N/m", "free_length": "m"}  # Names and units of the parameters of a user-defined rope
Rope = own("Rope", "line", rope_force, ROPE, gap=rope_gap, context=("mode",), events=("loose", "tight"))


@pytest.mark.parametrize("method", METHODS)
def test_case_file(method, tmp_path, capsys):
    """Cross-check by a second formulation: a class in a file beside the case file, against scipy; it is shown and saved."""
    (tmp_path / "rubber.py").write_text(RUBBER, encoding="utf-8")
    mechanism = read(tmp_path, CASE)
    assert "Rubber band band." in checked(tmp_path, CASE, capsys)
    run = sd.simulate(mechanism, until=1.0, method=method, samples=51, **TIGHT)

    def rate(mode: int, t: float, y: np.ndarray) -> tuple[float, ...]:
        length = math.hypot(y[0], y[1])
        pull = 900.0 * (length - 0.1) ** 3 / 2.0 / length
        return y[2], y[3], -pull * y[0], -pull * y[1]

    _, _, at = phases(rate, (lambda t, y: 1.0,) * 2, (0.5, 0.0, 0.0, 0.3), 1.0)
    np.testing.assert_allclose(run["position"][:, 0], at(run["time"].values)[:, :2], atol=1e-8)
    assert_balance(run)
    units = {"force": "N", "length": "m", "energy": "J", "peak_force": "N"}
    assert_documented(run, {f"rubber_band_{name}": unit for name, unit in units.items()})
    assert run["rubber_band_force"].dims == ("time", "rubber_band")
    with pytest.raises(sd.InputError, match="not executed unless you allow it"):
        sd.replay(run)
    again = sd.replay(run, allow_code=tmp_path / "rubber.py")
    np.testing.assert_array_equal(again["rubber_band_force"], run["rubber_band_force"])


def test_a_file_with_postponed_annotations(tmp_path):
    """Contract: annotations that are evaluated later mean the same."""
    (tmp_path / "rubber.py").write_text("from __future__ import annotations\n" + RUBBER, encoding="utf-8")
    assert read(tmp_path, CASE).components[0].free_length == 0.1


@pytest.mark.parametrize("method", METHODS)
def test_an_internal_state(method):
    """Closed form: a mass on a Maxwell element along the line is a linear system of three unknowns."""
    part = Maxwell("creep", *ENDS, 80.0, 20.0, 0.3)
    run = sd.simulate(ball_on(part), until=2.0, method=method, samples=41, **TIGHT)
    A = np.array([[0.0, 1.0, 0.0], [-40.0, 0.0, 40.0], [4.0, 0.0, -4.0]])
    values, vectors = np.linalg.eig(A)
    weights = np.linalg.solve(vectors, [0.2, 0.0, 0.0])
    exact = (np.exp(np.outer(run["time"], values)) * weights) @ vectors.T
    np.testing.assert_allclose(run["maxwell_length"][:, 0] - 0.3, exact[:, 0].real, atol=1e-9)
    np.testing.assert_allclose(run["maxwell_slip"][:, 0], exact[:, 2].real, atol=1e-9)
    assert_balance(run)


def test_a_guard_is_located_as_in_the_package():
    """Identity: the cable as a user's component has the same events and the same motion bit for bit."""
    one = sd.simulate(ball_on(Rope("rope", *ENDS, 200.0, 0.5), gravity=9.81, place=(0.1, -0.3)), until=1.5)
    other = sd.simulate(ball_on(sd.Cable("rope", *ENDS, 200.0, 0.5), gravity=9.81, place=(0.1, -0.3)), until=1.5)
    assert one.sizes["event"] >= 2
    np.testing.assert_array_equal(one["event_time"], other["event_time"])
    np.testing.assert_array_equal(one["position"], other["position"])
    assert [kind.replace("tight", "taut").replace("loose", "slack") for kind in one["event_kind"].values] == other[
        "event_kind"
    ].values.tolist()


def test_two_classes_in_one_mechanism():
    """Contract: each class has its own variables, as if it were alone."""
    maxwell, rope = Maxwell("creep", *ENDS, 80.0, 20.0, 0.3), Rope("rope", *ENDS, 200.0, 0.45)
    run = sd.simulate(ball_on(maxwell, rope), until=0.2, **TIGHT)
    length = run["position"].sel(body="ball", axis="x").values
    np.testing.assert_allclose(run["rope_force"][:, 0], np.maximum(0.0, 200.0 * (length - 0.45)), atol=1e-9)
    np.testing.assert_allclose(run["maxwell_force"][:, 0], 80.0 * (length - 0.3 - run["maxwell_slip"][:, 0]), atol=1e-9)
    assert run["rope"].values.tolist() == ["rope"]
    assert run["maxwell"].values.tolist() == ["creep"]


def weight(length, rate):
    """Return a constant pull."""
    return 1.0, length, 0.0


def part_on_a_line(**options: Any) -> Any:
    """Return a class of components that pull on two points, declared with these options."""
    return own("Part", "line", **{"force": weight, **options})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"port": "lines"}, r"port = 'lines' \(did you mean 'line'\?\)"),
        ({"symbol": "spirng"}, r"symbol = 'spirng' \(did you mean 'spring'\?\)"),
        ({"section": "my part"}, r"section = 'my part'.*letters, digits, underscores"),
        ({"context": ("hour",)}, "context 'hour'"),
        ({"port": "hinge"}, "has no field 'body'"),
        ({"states": ("slip",)}, r"state 'slip' has no unit or no error scale.*for example states=\(sd\.State\(\"slip\""),
        ({"states": (sd.State("slip", "m"),)}, r"state 'slip' has no unit or no error scale"),
        ({"gap": lambda length, spead: (length, spead)}, "kernel 'gap' has the unknown argument 'spead'.*length, rate"),
    ],
)
def test_a_wrong_declaration(options, message):
    """Contract: what does not fit together is refused where the class is defined, in one line."""
    with pytest.raises(sd.InputError, match=message):
        part_on_a_line(**options)


@pytest.mark.parametrize("section", ["spring", "time", "contact"])
def test_a_section_that_is_taken(section):
    """Contract: a section of the package, or a dimension of every run, is refused before the run."""
    with pytest.raises(sd.InputError, match=rf"section '{section}', which is already used"):
        ball_on(part_on_a_line(section=section)("part", *ENDS))


def test_no_file_no_class_no_component(tmp_path):
    """Contract: what a case file names must be a component in a file."""
    with pytest.raises(sd.InputError, match=r"file '.*rubber\.py' of the component"):
        read(tmp_path, CASE)
    (tmp_path / "rubber.py").write_text("class RubberBand:\n    pass\n", encoding="utf-8")
    with pytest.raises(sd.InputError, match=r"'RubberBand' in '.*rubber\.py' is not a component.*sd\.component"):
        read(tmp_path, CASE)


def test_a_kernel_without_an_answer():
    """Contract: a kernel that divides by zero where it starts is refused before the run."""

    def divided(length, rate):
        return 1.0 / (length - 0.5), 0.0, 0.0

    with pytest.raises(sd.InputError, match=r"part 'part': its kernel raises ZeroDivisionError"):
        sd.simulate(ball_on(part_on_a_line(force=divided)("part", *ENDS)), until=0.1)


def drag_force(x, y, cosine, sine, x_rate, y_rate, cosine_rate, sine_rate, viscosity):
    """Return the drag of a slow flow."""
    return -viscosity * x_rate, -viscosity * y_rate, 0.0, viscosity * (x_rate * x_rate + y_rate * y_rate)


Brake = own("Brake", "point", drag_force, {"viscosity": "N s/m"})


def rail_force(travel, speed, direction, stiffness):
    """Return the force of a spring along a direction."""
    return -stiffness * travel, 0.5 * stiffness * travel * travel, 0.0


Rail = own("Rail", "travel", rail_force, {"direction": "rad", "stiffness": "N/m"})


def mount_force(x, y, angle, x_rate, y_rate, speed, stiffness):
    """Return the force of a mount that is equally stiff in all directions."""
    return -stiffness * x, -stiffness * y, 0.0, 0.5 * stiffness * (x * x + y * y), 0.0


Mount = own("Mount", "frame", mount_force, {"stiffness": "N/m"})


def shake_force(x, y, cosine, sine, x_rate, y_rate, cosine_rate, sine_rate, time, amplitude):
    """Return a harmonic force along x."""
    return amplitude * math.sin(3.0 * time), 0.0


Shaker = own("Shaker", "point", shake_force, {"amplitude": "N"}, context=("time",), passive=False)


@pytest.mark.parametrize("method", METHODS)
def test_the_other_ports(method):
    """Closed form: drag at a point, a spring along a direction, a mount, a force of time; each alone on a mass of 2 kg."""

    def moved(part: object, **more: float) -> tuple[np.ndarray, np.ndarray]:
        run = sd.simulate(ball_on(part, **more), until=1.0, method=method, samples=21, **TIGHT)
        assert_balance(run)
        return run["time"].values, run["position"].values[:, 0] - [0.5, 0.0]

    t, place = moved(Brake("brake", ENDS[1], 3.0), gravity=9.81)
    fall = -9.81 / 1.5 * (t - (1.0 - np.exp(-1.5 * t)) / 1.5)
    np.testing.assert_allclose(place, np.stack([0.0 * t, fall], axis=1), atol=1e-9)
    t, place = moved(Rail("rail", ENDS[1], math.radians(60.0), 50.0))
    along = 0.25 * (np.cos(5.0 * t) - 1.0)
    np.testing.assert_allclose(place, along[:, None] * [0.5, math.sqrt(0.75)], atol=1e-9)
    t, place = moved(Mount("mount", *ENDS, 50.0))
    np.testing.assert_allclose(place[:, 0], 0.5 * (np.cos(5.0 * t) - 1.0), atol=1e-9)
    t, place = moved(Shaker("shaker", ENDS[1], 6.0))
    np.testing.assert_allclose(place[:, 0], t - np.sin(3.0 * t) / 3.0, atol=1e-9)


def test_a_travel_needs_its_direction():
    """Contract: the field is asked for where the class is defined."""
    with pytest.raises(sd.InputError, match="has no field 'direction'"):
        own("Part", "travel", weight)


@pytest.mark.parametrize(("free_length", "refused"), [(0.3, True), (0.0, False)])
def test_a_line_without_length(free_length, refused):
    """Limit: a component that pushes or pulls at zero length has no direction there; one without tension is no trouble."""
    mechanism = ball_on(Maxwell("creep", *ENDS, 80.0, 20.0, free_length), place=(0.0, 0.0), gravity=9.81)
    if not refused:
        assert sd.simulate(mechanism, until=0.01, samples=3).attrs["status"] == "complete"
        return
    with pytest.raises(sd.InputError, match="maxwell 'creep' has zero length"):
        sd.simulate(mechanism, until=0.01, samples=3)


def pressed(travel, speed, limit):
    """Return the indentation of a bumper, its rate and no slip."""
    return travel - limit, speed, 0.0


def pushed_back(normal):
    """Return the force of a bumper on its point."""
    return -normal


BUMPER = {"port": "travel", "gap": pressed, "force": pushed_back, "context": ("normal",), "contact": True, "symbol": "stop"}


@sd.component(**BUMPER)
class Bumper:
    """A stop with laws."""

    name: str
    point: tuple[str, str]
    direction: Annotated[float, sd.Quantity("rad")] = 0.0
    limit: Annotated[float, sd.Quantity("m")] = 0.6
    stiffness: Elastic = PowerLaw(1e8)
    damping: Damping = sd.Flores(0.5)
    friction: Friction = sd.NoFriction()
    surfaces = JointContact(math.inf, 0.1, 0.01, sd.STEEL, sd.STEEL)


def test_a_stop_with_laws_moves_as_the_end_stop():
    """Cross-check: a user-defined contact with a power law and Flores's damping is an end stop with the same numbers."""
    ends = sd.TravelStop("end", ENDS[1], 0.0, 0.6), Bumper("end", ENDS[1])
    runs = [sd.simulate(ball_on(end, velocity=(0.4, 0.0)), until=1.0, **TIGHT) for end in ends]
    np.testing.assert_allclose(runs[0]["position"].values, runs[1]["position"].values, atol=1e-12)
    np.testing.assert_allclose(runs[0]["event_time"].values, runs[1]["event_time"].values, rtol=1e-12)
    assert_balance(runs[1])
    assert float(runs[1]["bumper_peak_indentation"][0]) > 0.0


def test_a_contact_without_its_parts_is_refused():
    """Contract: laws, surfaces and the gap of a contact are needed, each in one line."""
    fields = {"name": str, "point": tuple[str, str], "direction": Annotated[float, sd.Quantity("rad")]}
    laws = dict.fromkeys(("stiffness", "damping", "friction"), Any)
    for given, more, missing in (({}, BUMPER, "stiffness"), (laws, BUMPER, "surfaces"), (laws, {**BUMPER, "gap": None}, "gap")):
        content = {"__annotations__": fields | given, **({"surfaces": None} if missing == "gap" else {})}
        with pytest.raises(sd.InputError, match=f"'Stump' with .* has no .*'{missing}'"):
            sd.component(**more)(type("Stump", (), content))
