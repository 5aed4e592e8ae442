"""The tables of a case file, and what they describe."""

from __future__ import annotations

import dataclasses
import inspect
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, ValidationInfo, field_validator

from scissordyn.config.law import law_of, material_of, read_law
from scissordyn.config.motion import SAMPLE, read_motion
from scissordyn.config.table import Table, described, located
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.lankarani_nikravesh import LankaraniNikravesh
from scissordyn.laws.material import Material
from scissordyn.model.clearance import Clearance
from scissordyn.model.drive import ConstantSpeed, Harmonic, Motion, TableMotion
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor
from scissordyn.simulation.options import Options
from scissordyn.units import Quantity, quantities

__all__ = ["Case", "CaseTable", "ClearanceTable", "DriveTable", "Run", "ScissorTable"]

_ARRAY: dict[str, Any] = {name: parameter.default for name, parameter in inspect.signature(scissor).parameters.items()}
_GAP = quantities(Clearance)
_DEFAULT: dict[str, Any] = {
    field.name: field.default if field.default_factory is dataclasses.MISSING else field.default_factory().name
    for field in dataclasses.fields(Clearance)
}


class ScissorTable(Table):
    """A straight array of scissor units with a slider."""

    kind: Annotated[Literal["scissor"], Field(description="a straight array of scissor units", examples=["scissor"])]
    units: Annotated[int, Field(description="number of units")] = _ARRAY["units"]
    bar_length: Annotated[float, Quantity("m", above=0.0, help="length of a bar")] = _ARRAY["bar_length"]
    bar_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of a bar")] = _ARRAY["bar_mass"]
    slider_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the slider")] = _ARRAY["slider_mass"]
    angle: Annotated[float, Quantity("rad", help="half opening angle at the start, above 0 and below 90 deg")] = _ARRAY["angle"]
    gravity: Annotated[float, quantities(Mechanism)["gravity"]] = _ARRAY["gravity"]
    gravity_direction: Annotated[float, quantities(Mechanism)["gravity_direction"]] = _ARRAY["gravity_direction"]
    reading: Annotated[
        Literal["A", "B"], Field(description='"A": bar 1 is pinned to the ground and driven; "B": bar 2 is pinned and free')
    ] = _ARRAY["reading"]

    def mechanism(self) -> Mechanism:
        """The array with ideal joints and no drive."""
        return scissor(**{name: getattr(self, name) for name in _ARRAY})


def _table_motion(given: Any, info: ValidationInfo) -> TableMotion:
    return read_motion(given, (info.context or {}).get("folder", Path()))


class DriveTable(Table):
    """A prescribed angle: one of speed, harmonic and table."""

    speed: Annotated[float | None, quantities(ConstantSpeed)["speed"], Field(examples=["150 rpm"])] = None
    harmonic: Annotated[
        Harmonic | None,
        described(Harmonic, mean="45 deg", amplitude="15 deg", frequency="3 Hz"),
        Field(
            description="mean + amplitude sin(frequency t + phase), in place of speed",
            examples=[{"mean": "45 deg", "amplitude": "15 deg", "frequency": "3 Hz", "phase": "0 deg"}],
        ),
    ] = None
    table: Annotated[
        TableMotion | None,
        PlainValidator(_table_motion),
        Field(description='a file that starts with "time [ms], angle [deg]", in place of speed', examples=["motion.csv"]),
    ] = None
    body: Annotated[str, Field(description="the driven body", examples=["unit 1/bar 1"])] = ""

    def motion(self) -> Motion:
        """The one motion that is given."""
        speed = None if self.speed is None else ConstantSpeed(self.speed)
        given = [motion for motion in (speed, self.harmonic, self.table) if motion is not None]
        if len(given) != 1:
            raise InputError(
                f"{len(given)} motions", f"exactly one of speed, harmonic and table ({SAMPLE})", 'speed = "150 rpm"'
            )
        return given[0]


class ClearanceTable(Table):
    """A loose joint."""

    joint: Annotated[str, Field(description="the loose joint", examples=["A"])]
    clearance: Annotated[float, _GAP["clearance"], Field(examples=["0.5 mm"])]
    journal_radius: Annotated[float, _GAP["journal_radius"]] = _DEFAULT["journal_radius"]
    bearing_length: Annotated[float, _GAP["bearing_length"]] = _DEFAULT["bearing_length"]
    material: Annotated[
        Material,
        material_of,
        Field(description="of the journal, and of the bearing unless that is given", examples=[_DEFAULT["material"].name]),
    ] = _DEFAULT["material"]
    bearing_material: Annotated[
        Material | None, material_of, Field(description="of the bearing", examples=[_DEFAULT["material"].name])
    ] = None
    restitution: Annotated[
        float | None, quantities(LankaraniNikravesh)["restitution"], Field(examples=[LankaraniNikravesh().restitution])
    ] = None
    stiffness: Annotated[
        Elastic, law_of("stiffness"), Field(description="elastic part of the normal force", validate_default=True)
    ] = _DEFAULT["stiffness"]
    damping: Annotated[Damping, Field(description="damping part of the normal force", validate_default=True)] = _DEFAULT[
        "damping"
    ]
    friction: Annotated[
        Friction,
        law_of("friction"),
        Field(description='"none", or a law', examples=[{"law": "lugre", "kinetic": 0.05}], validate_default=True),
    ] = _DEFAULT["friction"]

    @field_validator("damping", mode="plain")
    @classmethod
    def _damping_with_restitution(cls, given: Any, info: ValidationInfo) -> Any:
        if info.data.get("restitution") is None:
            return read_law(given, "damping", (info.context or {}).get("folder", Path()))
        return read_law(given, "damping", (info.context or {}).get("folder", Path()), restitution=info.data["restitution"])

    def described(self) -> Clearance:
        """The loose joint as the model describes it."""
        return Clearance(**{name: getattr(self, name) for name in _DEFAULT})


@dataclasses.dataclass(frozen=True)
class Run(Options):
    """How to run a case: the options of `simulate`.

    Parameters
    ----------
    trust : bool
        Whether to run twice and report until when both runs agree.
    """

    trust: bool = False

    @property
    def keywords(self) -> dict[str, Any]:
        """What `simulate` is called with."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}


@dataclasses.dataclass(frozen=True)
class Case:
    """A mechanism and how to run it.

    Parameters
    ----------
    mechanism : Mechanism
    run : Run
    """

    mechanism: Mechanism
    run: Run


class CaseTable(Table):
    """A whole case file."""

    structure: Annotated[ScissorTable, Field(description="what is deployed", examples=[{"kind": "scissor"}])]
    drive: Annotated[DriveTable | None, Field(description="the motor")] = None
    clearance: Annotated[
        list[ClearanceTable], Field(description="a loose joint; as many of these tables as loose joints", default_factory=list)
    ]
    run: Annotated[Run, described(Run, until="50 ms"), Field(description="how to run it", examples=[{"until": "50 ms"}])]

    def case(self) -> Case:
        """What the file describes; an `InputError` with the place in the file if its tables do not fit together."""
        with located("structure"):
            mechanism = self.structure.mechanism()
        for index, table in enumerate(self.clearance):
            with located(f"clearance.{index}"):
                if any(loose.name == table.joint for loose in mechanism.loose):
                    raise InputError(f"joint '{table.joint}' given twice", "one [[clearance]] for each joint")
                mechanism = mechanism.loosen(table.joint, table.described())
        if self.drive is not None:
            with located("drive"):
                mechanism = mechanism.driven(self.drive.motion(), body=self.drive.body)
        return Case(mechanism, self.run)
