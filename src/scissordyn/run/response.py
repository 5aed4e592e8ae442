"""Responses: a measure of a run, or that of one of its joints, drives, components or tracked points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.measure import IDEAL_JOINTS, MEASURES, parts_of

# Name of a load, force or torque, by its SI unit
LOAD_KINDS: Mapping[str, str] = MappingProxyType({"N": "force", "N m": "torque"})

ALIASES = {"error": "peak_track_deviation", "end_error": "end_track_deviation"}
"""Measures by the short names that can follow the name of a tracked point: ``tip.error``."""


@dataclass(frozen=True)
class Response:
    """One number of each case: a measure of the whole mechanism, or of one joint, drive or component."""

    measure: str
    part: str = ""  # Name of the joint, drive or component; empty for the largest of all
    smallest: bool = False  # True if the smallest value of all parts counts instead of the largest
    unit: str = ""  # Unit of component loads that count, "N" or "N m"; empty for all

    @property
    def name(self) -> str:
        """Name of the response in a study file, with the selected components if not all count."""
        if self.part:
            return f"{self.part}.{self.measure}"
        return f"{self.measure} ({LOAD_KINDS[self.unit]})" if self.unit else self.measure


def read_response(text: str, own_units: Mapping[str, str] | None = None) -> tuple[str, str, str]:
    """Read part, measure and unit of the response of a requirement or goal."""
    units = {name: measure.units for name, measure in MEASURES.items()} | dict(own_units or {})
    if text in units:
        return "", text, units[text]
    part, dot, measure = text.rpartition(".")
    measure = ALIASES.get(measure, measure) if dot and measure not in units else measure
    if measure not in units:
        names = [*units, *ALIASES] if dot else [*units]
        raise InputError(f"unknown measure '{measure}'{did_you_mean(measure, names)}", ", ".join(names))
    return part, measure, units[measure]


def check_part(mechanism: Mechanism, response: Response) -> None:
    """Raise `InputError` if a response is about a joint, drive, component or tracked point that its measure does not have."""
    for joint in mechanism.contacts if response.measure == "peak_force" else ():
        if joint.clearance is not None and joint.clearance.contact == "hard" and response.part in ("", joint.name):
            raise InputError(
                f"'{response.name}' of joint '{joint.name}', whose contact is hard: its impacts have no largest force",
                "peak_force_estimate, or compliant contact",
                'contact = "compliant"',
            )
    dims = MEASURES[response.measure].dims if response.measure in MEASURES else ()
    names = parts_of(mechanism)
    parts = [name for dim in dims for name in names[dim]]
    if response.part == IDEAL_JOINTS and response.part in parts and response.measure != "peak_force":
        raise InputError(
            f"'{response.name}': {IDEAL_JOINTS} have no contacts", f"'{IDEAL_JOINTS}.peak_force', or the name of a joint"
        )
    if response.part and response.part not in parts:
        others = {dim for dim, dim_parts in names.items() if response.part in dim_parts}
        part_measures = [f"{response.part}.{name}" for name, measure in MEASURES.items() if others & set(measure.dims)]
        raise InputError(
            f"'{response.name}': no {dims[0] if dims else 'part'} '{response.part}' with a {response.measure}"
            f"{did_you_mean(response.part, parts)}",
            ", ".join(part_measures or parts) or (f"a case with a {dims[0]}" if dims else response.measure),
        )
