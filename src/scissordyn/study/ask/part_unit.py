"""Units of the parts of a measure: of components, some exert a force and others a torque."""

from __future__ import annotations

import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.answer.measure import component_units
from scissordyn.study.ask.requirement import BY_COMPONENT, Response, units_of_parts


def possible_units(mechanism: Mechanism, response: Response) -> tuple[str, ...]:
    units = component_units(mechanism)
    return (units[response.part],) if response.part in units else tuple(dict.fromkeys(units.values()))


def check_unit(mechanism: Mechanism, response: Response) -> None:
    """Raise `InputError` for a response that no component has, or that would compare forces with torques."""
    if response.measure not in BY_COMPONENT:
        return
    units, possible = component_units(mechanism), possible_units(mechanism, response)
    allowed = ", ".join(f"{name}.{response.measure} [{unit}]" for name, unit in units.items()) or "a case with a component"
    if response.unit and response.unit not in possible:
        raise InputError(f"'{response.name}' in {response.unit}: no such component", allowed)
    if not possible:
        raise InputError(f"'{response.name}': the case has no component", allowed)
    if not response.unit and len(possible) > 1:
        raise InputError(f"'{response.name}' of forces and of torques", allowed)


def whole_responses(results: xr.Dataset, measure: str) -> list[Response]:
    """The responses of a measure without a part: one, or one of the forces and one of the torques."""
    units = list(dict.fromkeys(units_of_parts(results, measure)))
    return [Response(measure, unit=unit) for unit in units] if len(units) > 1 else [Response(measure)]
