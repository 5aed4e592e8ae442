"""Cases of the runs in the paper's figures: parameters from its text, and a choice of those whose tables are lost."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

from scissordyn.casefile.case import Case
from scissordyn.casefile.structure import ClearanceTable
from scissordyn.casefile.table import add_prefix, instance
from scissordyn.config.file import make_case
from scissordyn.errors import InputError
from scissordyn.model.clearance import Clearance, SlipKind
from scissordyn.model.options import Options, StartKind
from scissordyn.units import Quantity, check_quantities, degrees, quantities, rpm

SPEED = rpm(150)  # Angular velocity of the driven bar in most runs [rad/s]
SPEEDS = (rpm(100), SPEED, rpm(250))  # Angular velocities of figure 7 [rad/s]
CLEARANCES = (0.7e-3, 0.6e-3, 0.5e-3, 0.4e-3, 0.3e-3, 0.2e-3)  # Clearances of figures 9 and 10 [m]
SIZES = (0.6e-3, 0.4e-3, 0.2e-3)  # Clearances of figure 8 [m]
FRICTION = (0.01, 0.03, 0.05, 0.1)  # Kinetic friction coefficients of figures 11 and 12
CONTROLLED = (0.7e-3, 0.5e-3, 0.3e-3, 0.1e-3)  # Clearances of figure 13, with control [m]
ARRAY_CLEARANCE = 0.5e-3  # Clearance of the runs in which another parameter is varied [m]
STROKE_DURATION = 0.05  # Longest run of one stroke [s]; the text describes the time after 0.03 s
MARGIN = degrees(10)  # A falling stroke ends at this angle [rad], before zero, where the two assembly modes of the array meet
SAMPLE_SPACING = 2.5e-5  # Time between two recorded instants [s]: a tenth of the shortest contacts
OSCILLATION = degrees(15)  # Amplitude of the periodic drive [rad]; its largest speed is that of the stroke

OSCILLATION_PERIODS = 2  # Number of periods of a run with the periodic drive

DRIVEN_BAR_TEXTS = {"pinned": "pinned bar driven", "slider": "slider bar driven"}  # The two variants of the driven bar in words

LUGRE_UNITS = {
    "stribeck_speed": "m/s",
    "bristle_stiffness": "1/m",
    "bristle_damping": "s/m",
    "viscous": "s/m",
    "damping_speed": "m/s",
}
"""Units of the constants of LuGre friction, by their field in `Choice`."""

Travel = Literal["rising", "falling", "oscillating"]


@dataclass(frozen=True)
class Choice:
    """Values of the parameters whose tables in the paper are lost, or which its text describes ambiguously."""

    driven_bar: Literal["pinned", "slider"] = "pinned"  # The driven bar, see `scissor`
    # Angle of the driven bar at the start, the mean angle of an oscillation [rad]
    angle: Annotated[float, Quantity("rad", above=0.0, help="angle at the start")] = degrees(30)
    travel: Travel = "rising"  # Motion of the angle: it grows or falls at constant speed, or oscillates
    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient")] = 0.9  # c_e
    bearing_length: Annotated[float, quantities(Clearance)["bearing_length"]] = 15e-3  # L_b [m]
    # The elastic foundation, its formula as printed in later literature, or a constant stiffness
    stiffness: Literal["liu", "bai-zhao-as-printed", "hertz"] = "liu"
    damping: str = "flores"
    journal_radius: Annotated[float, quantities(Clearance)["journal_radius"]] = 10e-3  # [m]
    material: str = "steel"
    bearing_material: str = ""  # Material of the bearing; that of the journal if empty
    gravity: float = 9.81  # [m/s^2]
    start: StartKind = "concentric"  # Start of the runs without control
    slip: SlipKind = "surfaces"
    static: float = 1.5  # Static over kinetic coefficient of LuGre friction, and its other constants [SI]
    stribeck_speed: float = 1e-3
    bristle_stiffness: float = 1e5
    bristle_damping: float = 316.0
    damping_speed: float = 0.0  # Speed at which sigma_1 fades; with 0 the speed at which friction stays within its static limit
    viscous: float = 0.0
    tolerance: float = 1e-8  # Error tolerance of the authors' integrator
    method: str = "auto"  # Method of the authors' integrator
    step: float = 0.0  # Fixed step size of the authors' integrator [s]; 0 if errors determine the step size
    samples: int = 0  # Number of points of the authors' curves, if their numbers are read from these; otherwise 0

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def words(self) -> str:
        """Text of the choice in one short line."""
        travel = {"rising": "rising from", "falling": "falling from", "oscillating": "oscillating about"}[self.travel]
        length = "" if self.stiffness == "bai-zhao-as-printed" else f", L_b = {_number(1e3 * self.bearing_length)} mm"
        return (
            f"{DRIVEN_BAR_TEXTS[self.driven_bar]}, {travel} {_number(math.degrees(self.angle))} deg, "
            f"c_e = {_number(self.restitution)}"
            f"{length}, {self.stiffness}"
            + "".join(
                f", {field.name.replace('_', ' ')} {getattr(self, field.name)}"
                for field in dataclasses.fields(self)[6:]
                if getattr(self, field.name) != field.default
            )
        )


DEFAULT = Choice()  # Choice of this report, made before its agreement with the paper was known


@dataclass(frozen=True)
class PaperCase:
    """Case of one run: the parameters that the figures vary, and a choice of the unknown parameters."""

    # Radial clearance of joint A [m]; None for ideal joints
    clearance: Annotated[float | None, Quantity("m", above=0.0, help="radial clearance")] = ARRAY_CLEARANCE
    # Angular velocity of the driven bar [rad/s]; for an oscillation its largest value
    speed: Annotated[float, Quantity("rad/s", above=0.0, help="speed of the driven bar")] = SPEED
    # Kinetic coefficient of LuGre friction; None without friction
    friction: Annotated[float | None, Quantity("1", above=0.0, help="kinetic friction coefficient")] = None
    constrained: bool = False  # True if the contact is constrained, as by the paper's control
    start: StartKind = "concentric"
    choice: Choice = DEFAULT

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.clearance is None and (self.friction is not None or self.constrained):
            raise InputError("a case with friction or control but without clearance", "a clearance")

    @property
    def name(self) -> str:
        """Name of the run in file names; cases with the same choice have different names."""
        parts = ["ideal" if self.clearance is None else f"c-{_number(1e3 * self.clearance)}mm", f"{self.rpm}rpm"]
        parts += [] if self.friction is None else [f"friction-{_number(self.friction)}"]
        parts += ["constrained"] if self.constrained else []
        parts += [self.start] if self.start != "concentric" else []
        return "_".join(parts)

    @property
    def words(self) -> str:
        """Text of the clearance or friction coefficient, as in the figures."""
        return f"c = {1e3 * (self.clearance or 0.0):g} mm" if self.friction is None else f"friction {self.friction:g}"

    @property
    def rpm(self) -> str:
        """Text of the speed of the driven bar in revolutions per minute."""
        return _number(self.speed * 30.0 / math.pi)

    @property
    def until(self) -> float:
        """End of the run [s]."""
        if self.choice.travel == "oscillating":
            return OSCILLATION_PERIODS * 2.0 * math.pi * OSCILLATION / self.speed
        if self.choice.travel == "falling":
            return min(STROKE_DURATION, (self.choice.angle - MARGIN) / self.speed)
        return STROKE_DURATION

    @property
    def ideal(self) -> PaperCase:
        """Case with the same drive and ideal joints."""
        return PaperCase(None, self.speed, choice=self.choice)

    @property
    def without_contact_laws(self) -> PaperCase:
        """The same case with default contact laws, on which cases with ideal joints or constrained contact do not depend."""
        kept = {name: getattr(self.choice, name) for name in ("driven_bar", "angle", "travel", "gravity")}
        return dataclasses.replace(self, choice=Choice(**kept, samples=0 if self.constrained else self.choice.samples))

    @property
    def options(self) -> Options:
        """Options of the run; cases with friction use a stiff method, because an explicit one would need 1e6 steps."""
        choice, frictional = self.choice, self.friction is not None
        return Options(
            float(_number(self.until)),
            self.start if self.clearance is None or self.constrained or self.start != "concentric" else choice.start,
            choice.samples or 1 + round(self.until / SAMPLE_SPACING),
            choice.tolerance,
            method="auto" if frictional else choice.method,
            step=None if frictional else choice.step or None,
        )

    @property
    def toml(self) -> str:
        """Text of the case file; constrained contact is not in it, because only a Python function can set the constraint."""
        choice = self.choice
        lines = [
            f"# {self.name}: {choice.words}",
            *(
                ["# simulate(constrain_contact(mechanism)) keeps the contact closed; this file alone has free contact"]
                * self.constrained
            ),
            "[structure]",
            'kind = "scissor"',
            "units = 2",
            'bar_length = "2 m"',
            'bar_mass = "5.68 kg"',
            'slider_mass = "5 kg"',
            f'angle = "{_number(math.degrees(choice.angle))} deg"',
            f'gravity = "{_number(choice.gravity)} m/s^2"',
            f'driven_bar = "{choice.driven_bar}"',
            "",
            "[drive]",
            self._drive(),
        ]
        if self.clearance is not None:
            lines += [
                "",
                "[[clearance]]",
                'joint = "A"',
                f'clearance = "{_number(1e3 * self.clearance)} mm"',
                f'journal_radius = "{_number(1e3 * choice.journal_radius)} mm"',
                f'bearing_length = "{_number(1e3 * choice.bearing_length)} mm"',
                f'material = "{choice.material}"',
                *([f'bearing_material = "{choice.bearing_material}"'] if choice.bearing_material else []),
                f"restitution = {_number(choice.restitution)}",
                f'stiffness = "{choice.stiffness}"',
                f'damping = "{choice.damping}"',
                'reference = "onset"',
                f"friction = {self._lugre()}",
                f'slip = "{choice.slip}"',
            ]
        options = self.options
        lines += ["", "[run]", f'until = "{options.until!r} s"', f'start = "{options.start}"']
        lines += [f"samples = {options.samples}", f"rtol = {options.rtol!r}"]
        lines += [f'method = "{options.method}"'] + ([] if options.step is None else [f'step = "{options.step!r} s"'])
        return "\n".join(lines) + "\n"

    def _lugre(self) -> str:
        """Return the value of `friction` in the case file: the LuGre law with the constants of the choice, or "none"."""
        if self.friction is None:
            return '"none"'
        choice = self.choice
        parts = [f"kinetic = {_number(self.friction)}", f"static = {_number(choice.static * self.friction)}"]
        parts = parts[: 1 + (choice.static != DEFAULT.static)]
        for name, unit in LUGRE_UNITS.items():
            if getattr(choice, name) != getattr(DEFAULT, name):
                parts.append(f'{name} = "{_number(getattr(choice, name))} {unit}"')
        return "{ " + ", ".join(['law = "lugre"', *parts]) + " }"

    def build(self) -> Case:
        """Return mechanism and options of the case."""
        with add_prefix(self.name):
            return make_case(tomllib.loads(self.toml), {"folder": Path()})

    def build_from(self, ideal: Case) -> Case:
        """Return mechanism and options of a case with clearance, built from the parts of the ideal case to save time."""
        with add_prefix(self.name):
            (table,) = tomllib.loads(self.toml)["clearance"]
            read: Any = instance(ClearanceTable, table, {"folder": Path()})
            mechanism = ideal.mechanism.with_clearance(read.joint, read.result())
            return Case(mechanism, self.options)

    def _drive(self) -> str:
        if self.choice.travel == "oscillating":
            frequency = _number(self.speed / OSCILLATION)
            mean, amplitude = _number(math.degrees(self.choice.angle)), _number(math.degrees(OSCILLATION))
            return (
                f'harmonic = {{ mean = "{mean} deg", amplitude = "{amplitude} deg", angular_frequency = "{frequency} rad/s" }}'
            )
        return f'speed = "{"-" if self.choice.travel == "falling" else ""}{self.rpm} rpm"'


def every_case(choice: Choice) -> tuple[PaperCase, ...]:
    """Return the cases of all runs that the figures and statements need, each once."""
    cases = [PaperCase(None, speed, choice=choice) for speed in SPEEDS]
    cases += [PaperCase(clearance, choice=choice) for clearance in CLEARANCES]
    cases += [PaperCase(speed=speed, choice=choice) for speed in SPEEDS]
    cases += [PaperCase(friction=friction, choice=choice) for friction in FRICTION]
    cases += [PaperCase(clearance, choice=choice) for clearance in CONTROLLED]
    cases += [PaperCase(clearance, constrained=True, choice=choice) for clearance in CONTROLLED]
    return tuple(dict.fromkeys(cases))


def contact_starts(choice: Choice) -> tuple[PaperCase, ...]:
    """Return the cases without control that start like those with control, to separate the effect of the start in contact."""
    return tuple(PaperCase(clearance, start="in-contact", choice=choice) for clearance in CONTROLLED)


def _number(value: float) -> str:
    """Return a number as text of a case file with twelve digits, without the round-off of conversions."""
    return f"{value:.12g}"


def three_digits(value: float) -> str:
    """Return a number rounded to three digits as text, without a power of ten."""
    return f"{Decimal(f'{value:.3g}'):f}"
