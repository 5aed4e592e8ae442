"""Errors that state the given value, the allowed values and an example to type."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from difflib import get_close_matches

BREAKS = re.compile(r"[\t\n\v\f\r\x1c-\x1e\x85\u2028\u2029]+")  # Characters that end a line or jump within it


LONG_NUMBER = re.compile(r"(\d{12})\d{48,}")  # A number that nobody reads to its end


def shortened(text: str) -> str:
    """A text with the first digits of numbers of sixty digits and more."""
    return LONG_NUMBER.sub(lambda number: f"{number[1]}... ({len(number[0])} digits)", text)


def printable(text: str) -> str:
    r"""A text as one line that a terminal shows as it is: no line breaks, no escape codes, no change of direction."""
    line = BREAKS.sub(" ", text)
    if line.isascii() and line.isprintable():
        return line
    # control, format, surrogate, private and unassigned characters: what no font shows or a terminal obeys
    return "".join(
        letter.encode("unicode_escape").decode() if unicodedata.category(letter).startswith("C") else letter for letter in line
    )


def command(*words: object) -> str:
    """A command for the user to paste into a shell: each word is one word there, whatever characters it has."""
    import shlex

    return printable(" ".join(shlex.quote(str(word)) for word in words))


class ScissordynError(Exception):
    """Any error that the package raises on purpose; its text is one line for the user.

    Parameters
    ----------
    text : str
        Shown as `printable` makes it.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(shortened(text)))


class InputError(ScissordynError, ValueError):
    """An input that cannot be used.

    Parameters
    ----------
    what : str
        The given value, with its name.
    allowed : str, optional
        The allowed values.
    type_this : str or units.Sample, optional
        An example that the user can type.
    """

    def __init__(self, what: str, allowed: str = "", type_this: object = "") -> None:
        parts = [what.rstrip(".")]
        if allowed:
            parts.append(f"allowed: {allowed}")
        if type_this:
            parts.append(f"type: {type_this}")
        super().__init__("; ".join(parts))
        self.what, self.allowed, self.type_this = what, allowed, type_this


OTHER_WORDS = {
    "joint": "revolute hinge pin pivot bearing",
    "guide": "prismatic slider slide translational track",
    "spring": "damper dashpot spring_damper shock",
    "pin_friction": "bearing_friction hinge_friction friction",
    "guide_friction": "slide_friction slider_friction",
    "pin_lugre": "bristle_friction lugre stick_slip stiction",
    "gas_spring": "gas_strut strut lift_support air_spring",
    "nonlinear_spring": "spring_curve progressive_spring",
    "stroke_load": "cutting_force press_force load_curve force_table gas_pressure",
    "angle_load": "cogging gas_torque torque_table",
    "tabulated_motor": "torque_speed_curve motor_curve asynchronous_motor induction_motor engine",
    "linear_motor": "force_speed_curve linear_drive pneumatic_cylinder voice_coil",
    "torsion_spring": "torsional_spring rotational_spring rotary_spring rotational_damper torsional_damper",
    "actuator": "servo controller",
    "force": "load",
    "torque": "moment",
    "coupling": "gear gears gear_pair belt chain rack pinion rack_and_pinion screw lead_screw planetary mimic",
    "rod": "cylinder hydraulic_cylinder piston linear_actuator ram link distance",
    "clearance": "gap play",
    "body": "part segment",
    "weld": "fixed rigid",
    "cable": "rope wire tendon",
    "drive": "actuator motor input",
    "stop": "bumper limit",
    "angle_stop": "joint_limit",
    "speed": "velocity angular_velocity rate omega rpm",
    "until": "end t_end tend stop_time duration",
    "start": "from begin initial",
    "end": "to final",
    "kinetic": "mu mu_k coefficient",
    "static": "mu_s",
    "normal": "gauss gaussian",
    "latin-hypercube": "lhs latin_hypercube",
    "one-at-a-time": "oat",
    "deg": "grad gon grade",
    "s": "sec secs",
    "N m": "nm",
    "dopri5": "rk45 ode45 runge_kutta",
    "dop853": "rk8",
    "rodas5p": "ode15s bdf radau stiff implicit",
}
"""Words of the field, by what they are called here; a word stands for whichever of its lines a message allows first."""

ABSENT_WORDS = ("wheel",)  # Parts that there are not, so that a similar name is no hint


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """The known name nearest to `name`, as a question to append to a message, or nothing."""
    names = list(known)
    word = str(name).strip().casefold().replace(" ", "_").replace("-", "_")
    same = [candidate for candidate in names if candidate.casefold() == str(name).casefold()]  # "a" is "A" before it is "all"
    same = same or [candidate for candidate in names if word in OTHER_WORDS.get(candidate, "").split()]
    if word in ABSENT_WORDS and not same:
        return ""
    near = same or get_close_matches(str(name), names, n=1, cutoff=0.5)
    return f" (did you mean '{near[0]}'?)" if near else ""


def whole_number(name: str, value: object, least: int = 1, most: int | None = None, *, sample: str = "") -> int:
    """A count that a user gave."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least or (most is not None and value > most):
        allowed = f"a whole number >= {least}" + (f" and <= {most}" if most is not None else "")
        raise InputError(f"{name} = {value!r}", allowed, sample)
    return value
