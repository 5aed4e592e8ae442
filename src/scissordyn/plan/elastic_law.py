"""The stiffness law of a contact, for kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.plugin.element import pointers, row_of


class ElasticLaw(NamedTuple):
    """The stiffness law of a contact, for kernels."""

    force: int  # Pointers; 0 for an energy by quadrature
    energy: int
    row: np.ndarray  # (PARAMETERS,) Its numbers


def elastic_law(clearance: Clearance | GuideClearance) -> ElasticLaw:
    kernels = pointers(clearance.stiffness)
    return ElasticLaw(kernels["force"], kernels["energy"], row_of(clearance.stiffness, clearance.surfaces))
