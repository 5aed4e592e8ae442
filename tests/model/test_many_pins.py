"""Friction in many ideal pins at once: names, virtual work of a large array, case files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.errors import InputError

RUBBING = {"radius": 0.01, "kinetic": 0.15}


def test_array_of_twenty_units() -> None:
    """Identity: in 60 pins of a driven array the torque beyond that without friction has the power that friction takes."""
    array = sd.scissor(units=20).driven(sd.Cycloidal(0.4, 0.8, 0.5))
    rubbing = sd.with_joint_friction(array, "all", **RUBBING)
    without, run = (sd.simulate(part, until=0.5, samples=11) for part in (array, rubbing))
    assert run["pin_friction"].values.tolist() == [joint.name for joint in array.ideal_joints]
    torque, angle = run["pin_friction_torque"].values[1:-1], run["angular_velocity"]
    parts = {part.name: part for part in rubbing.components}
    speed = np.stack(
        [
            angle.sel(body=parts[name].body) - (0.0 if parts[name].base == "ground" else angle.sel(body=parts[name].base))  # type: ignore[attr-defined]
            for name in run["pin_friction"].values.tolist()
        ],
        axis=1,
    )[1:-1]
    beyond = (run["drive_torque"] - without["drive_torque"]).values.reshape(11, -1)[1:-1, 0]
    power = -np.sum(torque * speed, axis=1)
    assert np.all(power > 0.0)
    np.testing.assert_allclose(beyond * angle.sel(body=array.input_body).values[1:-1], power, rtol=1e-9)
    size, joints = np.linalg.norm(run["reaction"].values, axis=2), run["joint"].values.tolist()
    exact = size[:, [joints.index(name) for name in run["pin_friction"].values.tolist()]]
    np.testing.assert_allclose(run["pin_friction_reaction"], exact, atol=1e-9 * exact.max())


def test_patterns() -> None:
    """Contract: groups and patterns; a later call replaces an earlier one; clearance joints and names of others are refused."""
    array = sd.scissor(units=3)
    pivots = sd.with_joint_friction(array, "pivots", **RUBBING)
    assert [part.name for part in pivots.components] == ["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"]
    other = sd.with_joint_friction(pivots, "unit 2/*", radius=0.02, kinetic=0.3, bristle_stiffness=1e5)
    kinds = {part.name: type(part) for part in other.components}
    assert kinds["unit 1/pivot"] is sd.PinFriction
    assert kinds["unit 2/pivot"] is sd.PinLuGre
    assert len(kinds) == len(other.components) == 5
    loose = array.with_clearance("A", sd.Clearance(1e-4))
    assert "A" not in {part.name for part in sd.with_joint_friction(loose, **RUBBING).components}
    with pytest.raises(InputError, match="ideal joint 'A'"):
        sd.with_joint_friction(loose, "A", **RUBBING)
    named = sd.with_joint_friction(array, "unit 1/pivot", **RUBBING).components[0]
    own = array.with_parts({"components": (sd.PinFriction("mine", named.body, 0.01, 0.1, named.base),)})  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="friction in pin 'unit 1/pivot', which has 'mine' already; allowed: one of both"):
        sd.with_joint_friction(own, **RUBBING)


CASE = """
[structure]
kind = "scissor"
units = 2

[drive]
speed = "10 rpm"

[[joint_friction]]
joint = "all"
radius = "10 mm"
kinetic = 0.1

[[joint_friction]]
joint = "pivots"
radius = "15 mm"
kinetic = 0.2
bristle_stiffness = "1e5 1/m"

[run]
until = "10 ms"
"""


def test_case_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Contract: tables go over the pins in order; `check` names each; what is written is the same; --set reaches all."""
    from scissordyn.cli.main import status_of

    path = tmp_path / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    mechanism = sd.read_case(path).mechanism
    array = sd.scissor(units=2)
    first = sd.with_joint_friction(array, radius=0.01, kinetic=0.1)
    both = sd.with_joint_friction(first, "pivots", radius=0.015, kinetic=0.2, bristle_stiffness=1e5)
    assert mechanism.components == both.components
    assert status_of(["check", str(path)]) == 0
    assert "Pin friction unit 1/pivot" in capsys.readouterr().out
    sd.write_case(mechanism, tmp_path / "again.toml")
    assert sd.read_case(tmp_path / "again.toml").mechanism == mechanism
    changed = sd.read_case(path, ["pin_friction.all.kinetic=0.3", "joint_friction.pivots.kinetic=0.4"]).mechanism
    assert {(type(part), part.kinetic) for part in changed.components} == {(sd.PinFriction, 0.3), (sd.PinLuGre, 0.4)}  # type: ignore[attr-defined]


def test_bars_that_bend(tmp_path: Path) -> None:
    """Contract: pins keep their names on bars that bend, and friction finds their cross-sections in either order."""
    array = sd.scissor(units=1)
    bars = {"bending_stiffness": 2e3, "axial_stiffness": 2e6}
    before = sd.with_bending(sd.with_joint_friction(array, **RUBBING), **bars)
    after = sd.with_joint_friction(sd.with_bending(array, **bars), **RUBBING)
    friction = [{p for p in m.components if isinstance(p, sd.PinFriction)} for m in (before, after)]
    assert friction[0] == friction[1]
    assert len(friction[0]) == len(array.ideal_joints)
