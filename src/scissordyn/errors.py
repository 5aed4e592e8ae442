"""Exceptions of the package: their text names the wrong value, the expected values and an example."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from difflib import get_close_matches

LINE_BREAKS = re.compile(r"[\t\n\v\f\r\x1c-\x1e\x85\u2028\u2029]+")  # pattern of line breaks and tabs in a message


# pattern of a number in a message that has too many digits to read; it is shortened
LONG_NUMBER = re.compile(r"(\d{12})\d{48,}")


def shortened(text: str) -> str:
    """Return a text in which numbers of sixty or more digits are truncated to their first digits."""
    return LONG_NUMBER.sub(lambda number: f"{number[1]}... ({len(number[0])} digits)", text)


def printable(text: str) -> str:
    """Return a text as one line without characters that a terminal interprets: line breaks, escape and direction codes."""
    line = LINE_BREAKS.sub(" ", text)
    if line.isascii() and line.isprintable():
        return line
    # replace control, format, surrogate, private and unassigned characters
    return "".join(
        letter.encode("unicode_escape").decode() if unicodedata.category(letter).startswith("C") else letter for letter in line
    )


def command(*words: object) -> str:
    """Return a command for a shell; each word is quoted if its characters require it."""
    import shlex

    return printable(" ".join(shlex.quote(str(word)) for word in words))


class ScissordynError(Exception):
    """Base class of all errors that the package raises on purpose; the text is one line for the user.

    Parameters
    ----------
    text : str
        Text of the error; it is shown as `printable` returns it.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(shortened(text)))


class InputError(ScissordynError, ValueError):
    """Error: an input cannot be used.

    Parameters
    ----------
    what : str
        The given value, with its name.
    expected : str, optional
        The values that are expected.
    example : str or units.Sample, optional
        An example that the user can type.
    """

    def __init__(self, what: str, expected: str = "", example: object = "") -> None:
        parts = [what.rstrip(".")]
        if expected:
            parts.append(f"expected {expected}")
        if example:
            parts.append(f"for example {example}")
        super().__init__("; ".join(parts))
        self.what, self.expected, self.example = what, expected, example


class AssemblyError(InputError):
    """Error: a mechanism cannot be assembled, because its parts do not fit together or contradict each other."""


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
"""Synonyms of the terms of this package, by term; for a synonym, messages suggest the first allowed term that has it."""

ABSENT_WORDS = ("wheel",)  # words for parts that the package does not have; no similar name is suggested for them


def did_you_mean(name: object, allowed: Iterable[str]) -> str:
    """Return the text " (did you mean '...'?)" with the most similar known name, to append to a message; or ""."""
    names = list(allowed)
    word = str(name).strip().casefold().replace(" ", "_").replace("-", "_")
    # compare with upper and lower case, so that "A" is closer to "a" than "all" is
    same = [candidate for candidate in names if candidate.casefold() == str(name).casefold()]
    same = same or [candidate for candidate in names if word in OTHER_WORDS.get(candidate, "").split()]
    if word in ABSENT_WORDS and not same:
        return ""
    near = same or get_close_matches(str(name), names, n=1, cutoff=0.5)
    return f" (did you mean '{near[0]}'?)" if near else ""


def whole_number(name: str, value: object, least: int = 1, most: int = 10_000_000, *, sample: str = "") -> int:
    """Return a count given by the user; raise `InputError` unless it is an int within the bounds."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise InputError(f"{name} = {value!r}", f"a whole number >= {least} and <= {most}", sample)
    return value
