"""Positions and speeds that a description gives are those of the start; those that it does not give follow from them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.config.case_text import case_text
from scissordyn.errors import InputError

LENGTHS = {"crank": 1.0, "coupler": 3.0, "rocker": 2.0}


def four_bar(**changes: dict[str, Any]) -> sd.Mechanism:
    """Crank, coupler and rocker of 1, 3 and 2 m on a ground of 4 m, placed roughly; `changes` are what is given of each."""
    places = {"crank": {"angle": math.radians(60.0)}, "coupler": {}, "rocker": {"position": (4.0, 0.0)}}
    bodies = [sd.bar(name, length=length, mass=2.0) for name, length in LENGTHS.items()]
    bodies = [replace(body, **(places[body.name] | changes.get(body.name, {}))) for body in bodies]
    pins = [
        ("crank.start", "ground.O"),
        ("coupler.start", "crank.end"),
        ("coupler.end", "rocker.end"),
        ("rocker.start", "ground.C"),
    ]
    joints = [
        sd.Revolute(name, tuple(one.split(".")), tuple(other.split(".")))
        for name, (one, other) in zip("ABDC", pins, strict=True)
    ]
    return sd.Mechanism(tuple(bodies), tuple(joints), ground=(("O", (0.0, 0.0)), ("C", (4.0, 0.0))))


def angles_at(crank: float) -> tuple[float, float]:
    """Angles of coupler and rocker, the branch with the coupler's end above the ground [rad]."""
    end = 4.0 - np.exp(1j * crank)  # from the crank's end to C
    distance = abs(end)
    opening = math.acos((distance**2 + 9.0 - 4.0) / (6.0 * distance))
    coupler = float(np.angle(end)) + opening
    return coupler, float(np.angle(np.exp(1j * crank) + 3.0 * np.exp(1j * coupler) - 4.0))


def speeds_at(crank: float, speed: float) -> dict[str, float]:
    """The loop's angular velocities for that of the crank: a e^(ia) wa + b e^(ib) wb = c e^(ic) wc."""
    coupler, rocker = angles_at(crank)
    rows = np.array([[3.0 * np.exp(1j * coupler)], [-2.0 * np.exp(1j * rocker)]])[:, 0]
    b, c = np.linalg.solve(np.array([rows.real, rows.imag]), -speed * np.array([math.cos(crank), math.sin(crank)]))
    return {"crank": speed, "coupler": float(b), "rocker": float(c)}


def started(mechanism: sd.Mechanism, **options: Any) -> Any:
    """The first sample and the warnings of a run."""
    run = sd.simulate(mechanism, until=1e-4, samples=2, **options)
    return run.isel(time=0), run.attrs["warnings"]


CRANK = math.radians(60.0)
COUPLER, ROCKER = angles_at(CRANK)
EXACT = {"coupler": {"angle": COUPLER, "position": (math.cos(CRANK), math.sin(CRANK))}, "rocker": {"angle": ROCKER}}
TRUE = speeds_at(CRANK, 5.0)


@pytest.mark.parametrize("name", LENGTHS)
@pytest.mark.parametrize("placed", [EXACT, {"coupler": {"angle": 0.3}}], ids=["closed", "nearly"])
def test_speed_of_any_bar_is_kept(name: str, placed: dict[str, Any]) -> None:
    """Closed form: the other angular velocities follow from the loop, whatever place the other bars were drawn at."""
    changes = {body: dict(placed.get(body, {})) for body in LENGTHS}
    changes[name]["angular_velocity"] = TRUE[name]
    first, warnings = started(four_bar(**changes))
    angle = {body: float(first["angle"].sel(body=body)) for body in LENGTHS}
    if placed is EXACT:
        assert angle == pytest.approx({"crank": CRANK, "coupler": COUPLER, "rocker": ROCKER}, abs=1e-12)
    wanted = speeds_at(angle["crank"], 1.0)
    found = {body: float(first["angular_velocity"].sel(body=body)) for body in LENGTHS}
    assert found == pytest.approx({body: TRUE[name] / wanted[name] * speed for body, speed in wanted.items()}, rel=1e-9)
    assert "speeds" not in warnings


@pytest.mark.parametrize("angle", [20.0, 60.0, 100.0, -40.0])
def test_angle_is_kept_where_nothing_is_given_of_the_others(angle: float) -> None:
    """Closed form: the crank stays at its angle to round-off, coupler and rocker close the loop by the law of cosines."""
    crank = math.radians(angle)
    first, warnings = started(four_bar(crank={"angle": crank}))
    assert float(first["angle"].sel(body="crank")) == pytest.approx(crank, abs=1e-11)
    branches = [angles_at(crank), tuple(-other for other in angles_at(-crank))]
    found = [float(first["angle"].sel(body=body)) for body in ("coupler", "rocker")]
    assert min(np.max(np.abs(np.exp(1j * np.array(found)) - np.exp(1j * np.array(branch)))) for branch in branches) < 1e-9
    assert warnings == "[]"


@pytest.mark.parametrize("digits", [17, 12, 4, 1])
def test_speeds_that_are_all_given(digits: int) -> None:
    """Limit: what agrees is kept, what differs in its last digits is met to them; what differs by more is named."""
    rounded = {name: float(f"{speed:.{digits}g}") for name, speed in TRUE.items()}
    changes = {name: EXACT.get(name, {}) | {"angular_velocity": speed} for name, speed in rounded.items()}
    first, warnings = started(four_bar(**changes))
    for name, speed in rounded.items():
        assert float(first["angular_velocity"].sel(body=name)) == pytest.approx(speed, rel=4.0 * 10.0**-digits + 1e-11)
    assert ("speeds" in warnings) == (digits < 6)


def test_contradictions_are_named_with_both_numbers() -> None:
    """Identity: a turning crank and a rocker at rest, and a drive with another speed than the one that is given."""
    changes = {"crank": {"angular_velocity": 5.0}, "rocker": EXACT["rocker"] | {"angular_velocity": 0.0}}
    first, warnings = started(four_bar(coupler=EXACT["coupler"], **changes))
    speeds = first["angular_velocity"]
    assert 0.0 < float(speeds.sel(body="crank")) < 5.0
    assert f"body 'crank' starts at {float(speeds.sel(body='crank')):.4g} rad/s, given are 5 rad/s" in warnings
    assert f"body 'rocker' starts at {float(speeds.sel(body='rocker')):.4g} rad/s, given are 0 rad/s" in warnings
    driven = four_bar(crank={"angular_velocity": 5.0}).driven(speed=2.0, body="crank")
    assert "body 'crank' starts at 2 rad/s, given are 5 rad/s" in started(driven)[1]
    assert "starts at 0 rad/s, given are 5 rad/s" in started(four_bar(crank={"angular_velocity": 5.0}), start="static")[1]
    with pytest.raises(InputError, match="of a body that does not rotate"):
        sd.Body("stone", 1.0, None, angular_velocity=1.0)


def test_slider_crank_and_scissor_unit_from_the_speed_of_the_slider() -> None:
    """Closed form: x = r cos a + l cos b with r sin a + l sin b = 0; a unit of bars L is L sin(a) high."""
    crank = sd.slider_crank(angle=0.7, gravity=0.0)
    slider = crank.body("slider")
    r, rod = (math.dist(*(crank.body(name).points[end] for end in ("start", "end"))) for name in ("crank", "rod"))
    first, warnings = started(crank.replace("slider.velocity", (0.3, 0.0)))
    tilt = -math.asin(r * math.sin(0.7) / rod)
    speed = 0.3 / (-r * math.sin(0.7) + r * math.cos(0.7) * math.tan(tilt))
    assert slider.velocity is None
    assert float(first["angular_velocity"].sel(body="crank")) == pytest.approx(speed, rel=1e-9)
    assert float(first["velocity"].sel(body="slider", axis="x")) == pytest.approx(0.3, rel=1e-11)
    assert warnings == "[]"
    unit = sd.scissor(units=1, bar_length=2.0, angle=0.5, gravity=0.0)
    bars = [body.name for body in unit.bodies if body.rotates]
    first, _ = started(unit.replace(f"{unit.output_body}.velocity", (0.0, 0.4)))
    rate = 0.4 / (2.0 * math.cos(0.5))
    assert first["angular_velocity"].sel(body=bars).values == pytest.approx([rate, -rate], rel=1e-9)


def rows_of(mechanism: sd.Mechanism, first: Any) -> tuple[np.ndarray, np.ndarray]:
    """Joints as rows of velocities (x, y, angle) of mass centres, and the masses, from a sample."""
    names = [body.name for body in mechanism.bodies]
    rows = np.zeros((2 * len(mechanism.joints), 3 * len(names)))
    for k, joint in enumerate(mechanism.joints):
        for sign, (body, point) in ((1.0, joint.journal), (-1.0, joint.bearing)):
            if body == "ground":
                continue
            at, angle = 3 * names.index(body), float(first["angle"].sel(body=body))
            arm = np.array(mechanism.body(body).points[point]) - mechanism.body(body).centre
            cos, sin = math.cos(angle), math.sin(angle)
            rows[2 * k : 2 * k + 2, at : at + 2] += sign * np.eye(2)
            rows[2 * k : 2 * k + 2, at + 2] += sign * np.array([-sin * arm[0] - cos * arm[1], cos * arm[0] - sin * arm[1]])
    return rows, np.array([[body.mass, body.mass, body.inertia or 0.0] for body in mechanism.bodies]).ravel()


@pytest.mark.parametrize("seed", range(12))
def test_random_loops_with_one_speed(seed: int) -> None:
    """Cross-check by a second formulation: joints as rows in coordinates of mass centres, the rest of smallest energy.

    Loops of 3 to 6 bars between two pins at ground have 1 to 4 degrees of freedom. Of all motions with the given speed the
    start has that nearest to a given bar that turns about its origin, the others at rest.
    """
    random = np.random.default_rng(seed)
    count = 3 + seed % 4
    steps = random.uniform(0.4, 1.0, count) * np.exp(1j * np.linspace(1.4, -1.4, count) + 1j * random.uniform(-0.2, 0.2, count))
    corners = np.concatenate([[0.0], np.cumsum(steps)])
    number, speed = int(random.integers(count)), float(random.uniform(-4.0, 4.0))
    bodies = tuple(
        sd.bar(
            f"bar {k}",
            length=abs(step),
            mass=float(random.uniform(0.5, 2.0)),
            position=(corners[k].real, corners[k].imag),
            angle=float(np.angle(step)),
        )
        for k, step in enumerate(steps)
    )
    bodies = tuple(replace(body, angular_velocity=speed) if k == number else body for k, body in enumerate(bodies))
    ends = [("ground", "O"), *((f"bar {k}", "end") for k in range(count))]
    joints = [sd.Revolute(f"pin {k}", (f"bar {k}", "start"), ends[k]) for k in range(count)]
    joints.append(sd.Revolute("last", ends[-1], ("ground", "P")))
    ground = (("O", (0.0, 0.0)), ("P", (float(corners[-1].real), float(corners[-1].imag))))
    loop = sd.Mechanism(bodies, tuple(joints), ground=ground)
    first, warnings = started(loop)
    rows, weight = rows_of(loop, first)
    pick = np.zeros((1, rows.shape[1]))
    pick[0, 3 * number + 2] = 1.0
    guess = np.zeros(rows.shape[1])
    step = steps[number]
    guess[3 * number : 3 * number + 3] = -0.5 * speed * step.imag, 0.5 * speed * step.real, speed
    tall, root = np.vstack([rows, pick]), np.sqrt(weight)
    right = np.append(np.zeros(rows.shape[0]), speed) - tall @ guess
    wanted = guess + np.linalg.lstsq(tall / root, right, rcond=1e-12)[0] / root
    found = np.column_stack([first["velocity"].values, first["angular_velocity"].values]).ravel()
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.max(np.abs(wanted)))
    assert warnings == "[]"


def test_zero_is_given_and_stays_so_in_files() -> None:
    """Identity: a number that is 0 differs from one that is not given, in the text of a case too."""
    given = four_bar(rocker={"angular_velocity": 0.0}, coupler={"velocity": (0.0, 0.0)})
    text = case_text(given)
    assert text.count("angular_velocity") == 1
    assert text.count("\nvelocity") == 1
    assert "velocity" not in case_text(four_bar())


def test_restart_from_a_sample_keeps_all_numbers() -> None:
    """Identity: the state of a run, given in full, is the start of the next one to round-off."""
    run = sd.simulate(four_bar(crank={"angular_velocity": 5.0}), until=0.1, samples=3, rtol=1e-10, atol=1e-10)
    last, bodies = run.isel(time=-1), []
    mechanism = four_bar()
    for body in mechanism.bodies:
        part = last.sel(body=body.name)
        angle, speed = float(part["angle"]), float(part["angular_velocity"])
        x, y = body.centre[0] * math.cos(angle), body.centre[0] * math.sin(angle)
        place, velocity = part["position"].values, part["velocity"].values
        origin = float(place[0] - x), float(place[1] - y)
        rate = float(velocity[0] + speed * y), float(velocity[1] - speed * x)
        bodies.append(replace(body, position=origin, angle=angle, velocity=rate, angular_velocity=speed))
    first, warnings = started(replace(mechanism, bodies=tuple(bodies)))
    for name in ("position", "angle", "velocity", "angular_velocity"):
        assert first[name].values == pytest.approx(last[name].values, abs=1e-11)
    assert warnings == "[]"
