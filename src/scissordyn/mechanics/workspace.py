"""Initial state and workspace of the kernels."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.components.declaration import CONTEXT
from scissordyn.control.signal import SIGNALS
from scissordyn.mechanics.band import width
from scissordyn.mechanics.lanes import LANES, padded
from scissordyn.mechanics.system import (
    APPROACH_FLOOR,
    COMPONENT_RESULTS_MAX,
    CONTACT_RESULT,
    MechanismState,
    Model,
    Parameters,
    Workspace,
)


def initial_state(model: Model, angles: np.ndarray) -> MechanismState:
    """Return a state with everything open and with the placed angles of rotations, components and constraints."""
    guards, signals = model.guard_component.size, int(np.max(model.recorder, initial=-1)) + 1
    return MechanismState(
        mode=np.zeros(guards, np.int64),
        memory=np.full(guards, APPROACH_FLOOR),
        mass=np.zeros(guards),
        reference=angles.copy(),
        history=np.zeros((0, 2)),
        history_length=np.zeros(1, np.int64),
        initial_history=np.zeros(signals),
    )


def make_workspace(model: Model, parameters: Parameters) -> Workspace:
    """Return scratch arrays for a thread that works on a model."""
    n, nb, m = model.n, model.nb, parameters.value.size
    contacts, components = parameters.contact.size, model.component_port.size
    counts, states = np.diff(model.element_start), np.diff(model.state_start)
    entries, parts = model.constraint_column.size, model.part_constraint.size
    size, most = int(np.max(model.permutation, initial=-1)) + 1, int(np.max(states, initial=0))
    nz, lower, upper = int(model.state_start[-1]), int(model.band_limits[0]), int(model.band_limits[1])
    signals, vectors = len(SIGNALS), 2 * int(np.max(model.bar[:, 1], initial=0))
    inactive = np.zeros(m)
    inactive[model.latch[:, 0]] = 1.0
    values = np.zeros((4, m))
    values[0] = parameters.value
    blocks, pairs = int(model.block_start[-1]), int(model.force_state_start[-1])
    return Workspace(
        part_weight=model.part_full * (1.0 - inactive[model.part_constraint]),
        inactive=inactive,
        value=values,
        instant=np.array([math.nan]),
        pivots=np.zeros(2 * size, np.int64),
        row_factor=np.ones(n),
        unknown_factor=np.ones(n),
        gram_pivots=np.zeros(2 * m, np.int64),
        segment=np.array([-math.inf, math.inf]),
        near=np.array([0.0, 1.0, math.inf, math.inf]),
        contact=np.zeros(contacts, CONTACT_RESULT),
        basis=np.zeros((4, nb)),
        function_value=np.zeros(4),
        band=np.zeros((size, width(lower, upper))),
        aside=np.zeros((size if model.pair.size else 0, lower + upper + 1)),
        pair_size=np.zeros(model.pair.shape[0]),
        state_inverse=np.zeros(nz),
        gram=np.zeros((m, width(int(model.band_limits[2]), int(model.band_limits[3])))),
        gamma=np.zeros(1),
        wrench=np.zeros((contacts + components, 4)),
        rate_by_state=np.zeros(int(model.state_state_start[-1])),
        local=np.zeros((13, int(np.max(counts, initial=0)))),
        state_jacobian=np.zeros((most + 7, most)),
        context=np.zeros(len(CONTEXT)),
        result=np.zeros((components, COMPONENT_RESULTS_MAX)),
        slope=np.zeros((4 + most, signals + most + 1)),
        observed=np.zeros((components, 2)),
        work=np.zeros(n + m + nz),
        scratch=np.zeros(2 * n + nz),
        work_b=np.zeros(nb),
        with_energy=np.zeros(1, np.int64),
        bar=np.zeros((17, LANES + padded(int(np.max([model.bar[:, 1] + 2 * model.bar[:, 2], model.bar[:, 7]], initial=0))))),
        rail=np.zeros((8, max(8, int(np.max(counts, initial=0)), int(np.max(model.rail[:, 2], initial=0))))),
        **worn_surfaces(parameters),
        **_zeros(n + nb, "X", "V", "A", "force"),
        **_zeros((parts, 2), "direction", "direction_rate", "direction_acceleration", "frozen_direction", "frozen_rate"),
        **_zeros(entries, "gradient", "frozen_gradient"),
        **_zeros(m, "multiplier", "frozen_multiplier"),
        **_zeros(n, "prescribed_factor", "prescribed", "load", "gram_row"),
        **_zeros(blocks, "block_x", "block_v"),
        **_zeros(pairs, "force_by_state", "rate_by_x", "rate_by_v"),
        **_zeros((2, most), "state_work", "control_work"),
        **_zeros((components, 4), "coordinates", "coordinate_rates"),
        **_zeros(COMPONENT_RESULTS_MAX, "answer", "other_answer"),
        **_zeros(components, "stored_energy", "dissipation", "power_in"),
        **_zeros((4, 6), "gradient_q", "gradient_v"),
        **_zeros((6, 6), "by_map", "by_map_rate"),
        **_zeros(signals, "signal", "signal_rate"),
        **_zeros((vectors, vectors), "bar_by_x", "bar_by_v"),
    )


def worn_surfaces(parameters: Parameters) -> dict[str, np.ndarray]:
    """Return the scratch arrays for worn journals by name; their size depends on the contours."""
    contacts, angles = parameters.journal.shape
    return {"surface": np.zeros((contacts, angles, 3)), "slopes": np.zeros((contacts, angles)), "shares": np.zeros(angles)}


def _zeros(shape: int | tuple[int, ...], *names: str) -> dict[str, np.ndarray]:
    """Return zero arrays of one shape under several names."""
    return {name: np.zeros(shape) for name in names}
