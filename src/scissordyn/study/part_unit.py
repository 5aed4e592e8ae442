"""Units of the parts of a measure: of components, some exert a force and others a torque."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.study.requirement import BY_COMPONENT, COMPONENT_UNIT, Response, units_of_parts

__all__ = ["check_unit", "component_units", "possible_units", "whole_responses", "with_units"]


def component_units(mechanism: Mechanism) -> dict[str, str]:
    """The unit of what each component exerts, as its port declares it.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    dict of str to str
        "N" or "N m" by the names of the components, in their order.
    """
    return {each.name: each.declaration.port.outputs[0].unit for each in mechanism.components}


def possible_units(mechanism: Mechanism, response: Response) -> tuple[str, ...]:
    """The units that the parts of a response have.

    Parameters
    ----------
    mechanism : Mechanism
    response : Response
        About a measure by component.

    Returns
    -------
    tuple of str
        Each once; none without components.
    """
    units = component_units(mechanism)
    return (units[response.part],) if response.part in units else tuple(dict.fromkeys(units.values()))


def check_unit(mechanism: Mechanism, response: Response) -> None:
    """Raise `InputError` for a response that no component has, or that would compare forces with torques.

    Parameters
    ----------
    mechanism : Mechanism
    response : Response
    """
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


def with_units(results: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Results of cases whose measures by component have the units that the components declare.

    Parameters
    ----------
    results : Dataset
        Of `simulate_many`.
    mechanism : Mechanism

    Returns
    -------
    Dataset
        With the coordinate `component_unit` along `component`; `units` of a measure are those of all its components.
    """
    measured = [name for name in BY_COMPONENT if name in results]
    if not measured:
        return results
    units = list(component_units(mechanism).values())
    found = results.assign_coords({COMPONENT_UNIT: ("component", np.array(units, dtype=str))})
    every = " or ".join(dict.fromkeys(units)) or "1"
    return found.assign({name: found[name].assign_attrs(units=every) for name in measured})


def whole_responses(results: xr.Dataset, measure: str) -> list[Response]:
    """The responses of a measure without a part: one, or one of the forces and one of the torques.

    Parameters
    ----------
    results : Dataset
    measure : str

    Returns
    -------
    list of Response
    """
    units = list(dict.fromkeys(units_of_parts(results, measure)))
    return [Response(measure, unit=unit) for unit in units] if len(units) > 1 else [Response(measure)]
