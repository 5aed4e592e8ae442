"""DXF files of the package with the assembly, written and read again."""

import dataclasses
import io
import json
import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.exchange.assembly import BLOCK, left_out
from scissordyn.exchange.export import drawing

ezdxf = pytest.importorskip("ezdxf")


def slot():
    """Return a crank whose pin slides along a moving bar with a corner."""
    angle = math.atan2(0.2 * math.sin(0.4), 0.5 + 0.2 * math.cos(0.4))
    crank = sd.Body("crank", 1.0, 0.02, {"O": (0.0, 0.0), "P": (0.2, 0.0)}, (0.1, 0.0), angle=0.4)
    lever = sd.Body("lever", 2.0, 0.1, {"Q": (0.0, 0.0), "corner": (0.3, 0.1)}, (0.3, 0.0), position=(-0.5, 0.0), angle=angle)
    return sd.Mechanism(
        (crank, lever),
        (sd.Revolute("crank pin", ("crank", "O"), ("ground", "O")), sd.Revolute("lever pin", ("lever", "Q"), ("ground", "Q"))),
        guides=(sd.Guide("slot", ("crank", "P"), (0.0, 0.0), 0.0, "lever"),),
        ground=(("O", (0.0, 0.0)), ("Q", (-0.5, 0.0))),
        gravity=0.0,
    )


def pendulum():
    """Return three bars on one pin; one has no other point, and its mass centre is not at the pin."""
    bars = [sd.Body(name, 1.0, 0.02, {"O": (0.0, 0.0), "end": (0.3, 0.1)}, (0.1, 0.0), angle=0.4) for name in ("a", "b")]
    bars.append(sd.Body("c", 1.0, 0.02, {"O": (0.0, 0.0)}, (0.4, 0.1), angle=0.4))
    joints = tuple(sd.Revolute(f"O {name}", ("ground", "O"), (name, "O")) for name in "abc")
    return sd.Mechanism(tuple(bars), joints, ground=(("O", (0.0, 0.0)),), gravity=0.0)


def cross_slide():
    """Return a block without joints on two guides: an upright one on the ground and one along a crank."""
    crank = sd.bar("crank", length=1.0, mass=1.0, angle=0.5)
    block = sd.point_mass("block", mass=0.3, position=(0.5, 0.5 * math.tan(0.5)))
    guides = (
        sd.Guide("upright", ("block", "centre"), (0.5, 0.0), 0.5 * math.pi),
        sd.Guide("slot", ("block", "centre"), (0.0, 0.0), 0.0, "crank"),
    )
    pin = sd.Revolute("O", ("crank", "start"), ("ground", "O"))
    return sd.Mechanism((crank, block), (pin,), guides=guides, ground=(("O", (0.0, 0.0)),))


def tool():
    """Return a four-bar with a point mass on its coupler and no guide."""
    linkage = sd.four_bar(coupler_point=(0.1, 0.05))
    mass = sd.Body("tool", 0.5, None, {"centre": (0.0, 0.0)}, position=linkage.body("coupler").place("point"))
    holder = sd.Revolute("holder", ("tool", "centre"), ("coupler", "point"))
    return dataclasses.replace(linkage, bodies=(*linkage.bodies, mass), joints=(*linkage.joints, holder))


@pytest.mark.parametrize(
    "mechanism",
    [
        sd.scissor(units=3),
        sd.polar_scissor(),
        sd.four_bar(),
        sd.slider_crank(offset=0.01),
        sd.slider_crank(offset=0.01, slider_inertia=1e-4),
        slot(),
        cross_slide(),
        pendulum(),
        tool(),
    ],
)
def test_geometry_masses_pins_and_guides_return(mechanism):
    """Identity: bodies, joints and guides with their names, and the motion with the torque that it needs."""
    plain = dataclasses.replace(mechanism, gravity=0.0)
    again, notes = sd.read_dxf(drawing(plain, pin_radius=2e-3))
    assert [body.name for body in again.bodies] == [body.name for body in plain.bodies]
    assert {joint.name: {*joint.bodies} for joint in again.joints} == {joint.name: {*joint.bodies} for joint in plain.joints}
    assert [(guide.name, guide.follower[0], guide.body, guide.aligned) for guide in again.guides] == [
        (guide.name, guide.follower[0], guide.body, guide.aligned) for guide in plain.guides
    ]
    for body in plain.bodies:
        assert again.body(body.name).mass == body.mass
        assert again.body(body.name).inertia == body.inertia
        assert again.body(body.name).rotates == body.rotates
    runs = [sd.simulate(part.driven(speed=1.0, body=plain.bodies[0].name), until=0.2, samples=5) for part in (plain, again)]
    for name in ("position", "kinetic_energy", "drive_torque"):
        here, there = (run[name].values for run in runs)
        assert here == pytest.approx(there, rel=1e-9, abs=1e-11)
    assert notes[0] == f"block '{BLOCK}' of the DXF is read; the separately drawn parts are not"


def test_parts_alone_are_drawn_in_the_model_space():
    """Contract: who cuts the parts sees outlines and holes only; the assembly is a block without a reference."""
    document = ezdxf.read(io.StringIO(drawing(sd.four_bar(), pin_radius=2e-3)))
    assert {entity.dxf.layer for entity in document.modelspace()} == {"outline", "bore", "journal", "text"}
    assert not document.modelspace().query("INSERT")
    assert {entity.dxf.layer for entity in document.blocks.get(BLOCK)} == {"bars", "pins", "ground"}


def test_what_the_drawing_does_not_hold_is_named():
    """Contract: each kind with how many there are."""
    mechanism = sd.scissor(units=2).driven(speed=1.0).with_clearance("A", sd.Clearance(5e-4, journal_radius=0.01))
    assert left_out(mechanism) == [
        "drives: left out of the assembly in the DXF (1)",
        "clearances: left out of the assembly in the DXF (1)",
        "gravity: left out of the assembly in the DXF",
    ]


@pytest.mark.parametrize(
    ("name", "value"), [("pins", ["a"]), ("mass", "heavy"), ("mass", -1.0), ("centre", [1]), ("bar", None), ("pins", None)]
)
def test_damaged_data_are_one_line(name, value):
    """Contract: data that were changed by hand are an error."""
    document = ezdxf.read(io.StringIO(drawing(sd.four_bar(), pin_radius=2e-3)))
    entity = document.blocks.get(BLOCK).query("LWPOLYLINE")[0]
    data = json.loads("".join(tag.value for tag in entity.get_xdata("SCISSORDYN") if tag.code == 1000)) | {name: value}
    entity.set_xdata("SCISSORDYN", [(1000, json.dumps(data))])
    stream = io.StringIO()
    document.write(stream)
    with pytest.raises(sd.InputError) as error:
        sd.read_dxf(stream.getvalue())
    assert "\n" not in str(error.value)


def test_the_commands(tmp_path, capsys, answer, monkeypatch):
    """Contract: export and import by the command line; the files of a scissor array agree."""
    monkeypatch.chdir(tmp_path)
    assert status_of(["new", "slider-crank"]) == 0
    (tmp_path / "case.toml").write_text(capsys.readouterr().out)
    assert "left out of the assembly in the DXF" in answer("export", "case.toml", "bars.dxf", "--pin", "5 mm")
    answer("import", "bars.dxf", "-o", "again.toml")
    first, second = (sd.read_case(name).mechanism for name in ("case.toml", "again.toml"))
    assert [body.mass for body in first.bodies] == pytest.approx([body.mass for body in second.bodies])
    assert np.array([second.body(body.name).inertia or 0.0 for body in first.bodies]) == pytest.approx(
        np.array([body.inertia or 0.0 for body in first.bodies])
    )
