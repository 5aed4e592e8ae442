"""Natural frequencies along the motion of the drive: the same as those of a mechanism built there, and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.errors import InputError


def array(angle: float) -> sd.Mechanism:
    """Two units of bars that bend, driven at 1 rad/s."""
    rigid = sd.scissor(units=2, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=angle)
    return rigid.with_bending(section="tube 60x60x1.56 mm", material="steel", elements=2).driven(speed=1.0)


@pytest.mark.parametrize("position", ["static", "concentric"])
def test_frequencies_at_a_later_position_are_those_of_an_array_built_there(position: str) -> None:
    """Second road: followed from 0.5 to 0.9 rad, and assembled at 0.9 rad."""
    followed = sd.modes(array(0.5), count=6, position=position, times=[0.0, 0.25, 0.4])
    built = sd.modes(array(0.9), count=6, position=position)
    assert followed["frequency"].dims == ("time", "mode")
    assert followed["input"].values.ravel() == pytest.approx([0.5, 0.75, 0.9], abs=1e-12)
    np.testing.assert_allclose(followed["frequency"][-1], built["frequency"], rtol=1e-7)
    np.testing.assert_allclose(followed["position"][-1], built["position"], atol=1e-8)
    first = sd.modes(array(0.5), count=6, position=position)
    np.testing.assert_allclose(followed["frequency"][0], first["frequency"], rtol=1e-9)


def test_a_rigid_pendulum_on_a_driven_crank_swings_alike_everywhere() -> None:
    """Closed form: omega^2 = 3 g/(2 L) of a uniform bar that hangs from the end of a crank, wherever the crank is held."""
    crank, rod = (
        sd.bar("crank", length=0.3, mass=1.0),
        sd.bar("rod", length=0.5, mass=2.0, position=(0.3, 0.0), angle=-math.pi / 2.0),
    )
    joints = (
        sd.Revolute("O", ("crank", "start"), ("ground", "O")),
        sd.Revolute("A", ("rod", "start"), ("crank", "end")),
    )
    made = sd.Mechanism((crank, rod), joints, ground=(("O", (0.0, 0.0)),), input_body="crank").driven(speed=2.0)
    found = sd.modes(made, times=np.linspace(0.0, 3.0, 7))
    assert found["angular_frequency"].values.ravel() == pytest.approx(np.full(7, math.sqrt(1.5 * 9.81 / 0.5)), rel=1e-7)
    assert found["angle"].sel(body="rod").values == pytest.approx(np.full(7, -math.pi / 2.0), abs=1e-7)


def test_what_has_no_stroke_is_refused() -> None:
    """Bad input: no drive, and times that go back."""
    free = sd.scissor(units=1).with_bending(bending_stiffness=1e4, axial_stiffness=1e7, elements=1)
    with pytest.raises(InputError, match="without a drive"):
        sd.modes(free, times=[0.0, 1.0])
    with pytest.raises(InputError, match="not increasing"):
        sd.modes(array(0.5), times=[0.1, 0.1])


def test_a_rod_that_is_driven_has_its_length_in_metres() -> None:
    """Contract: what each drive holds has its own unit; a bar on a jack and a spring, at the lengths that the jack is given."""
    jack = sd.Rod("jack", ("lever", "end"), ("ground", "foot"), motion=sd.Polynomial((0.5, 0.1)))
    made = sd.Mechanism(
        (
            sd.bar("lever", length=0.5, mass=1.0, angle=0.3),
            sd.bar("rod", length=0.4, mass=1.0, position=(0.0, 0.0), angle=-1.5),
        ),
        (sd.Revolute("O", ("lever", "start"), ("ground", "O")), sd.Revolute("P", ("rod", "start"), ("lever", "start"))),
        rods=(jack,),
        ground=(("O", (0.0, 0.0)), ("foot", (0.5, -0.4))),
    )
    found = sd.modes(made, times=[0.0, 0.2], count=1)
    assert found["drive"].values.tolist() == ["jack"]
    assert found["unit"].values.tolist() == ["m"]
    assert found["input"].values.ravel() == pytest.approx([0.5, 0.52])
