"""Whether the scales that components declare for their internal states fit the forces that these make."""

from __future__ import annotations

import numpy as np

from scissordyn.component.declaration import Component
from scissordyn.mechanics import functions
from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.run.options import Options
from scissordyn.run.start.tolerance import state_tolerance
from scissordyn.units import State
from scissordyn.warning import RunWarning, warning

COARSE = 1e3
"""A state whose allowed error changes a force by more than this times the tolerance, as a part of the largest force of its
component, has a scale that does not fit: three digits are lost. One that fits loses none."""

MOST = 500  # Samples at which this is looked at


def scale_warnings(options: Options, path: Trajectory) -> list[RunWarning]:
    """A warning for each state whose declared scale is so large that its allowed error is seen in the force."""
    places = _places(path)
    instants = path.samples.time.size
    if not places or not instants:
        return []
    content, warnings, samples, state = path.system.content, list[RunWarning](), path.samples, path.system.content.state
    allowed = state_tolerance(options.rtol, options.atol)
    change, size = np.zeros(len(places)), np.zeros(len(places))
    for at in np.unique(np.linspace(0, instants - 1, min(instants, MOST)).astype(int)).tolist():
        state.mode[:], state.memory[:], state.reference[:] = samples.mode[at], samples.memory[at], samples.reference[at]
        functions.activate(path.system.address)
        y = samples.state[at].copy()
        for k, (i, component, entry, _) in enumerate(places):
            forces, here = len(component.declaration.port.forces), y[entry]
            error = allowed * content.parameters.state_scale[entry - 2 * path.plan.coordinates.free]
            answers = []
            for moved in (here, here + error, here - error):
                y[entry] = moved
                functions.rate(samples.time[at], y, path.system.address, np.zeros(y.size))
                answers.append(np.array(content.work.result[i, :forces]))
            y[entry] = here
            size[k] = max(size[k], np.abs(answers[0]).max())
            change[k] = max(change[k], 0.5 * np.abs(answers[1] - answers[2]).max())
    for k, (_, component, entry, declared) in enumerate(places):
        if not change[k] > COARSE * allowed * size[k] > 0.0:
            continue
        scale, share = content.parameters.state_scale[entry - 2 * path.plan.coordinates.free], change[k] / size[k]
        force = component.declaration.port.forces[0].partition("_")[0]
        numbers = {"error": allowed * scale, "unit": declared.unit, "state": declared.name, "share": share, "force": force}
        numbers |= {"scale": scale, "fitting": scale * allowed / share}
        warnings.append(warning("state scale", component.name, component.declaration.label, **numbers))
    return warnings


def _places(path: Trajectory) -> list[tuple[int, Component, int, State]]:
    """Of each state of a component: the component's number, itself, the entry of y, the declared state."""
    start, places = path.system.content.model.state_start, []
    controlled = dict(path.plan.actuators)
    for i, component in enumerate(path.plan.acting):
        if i not in controlled:
            first = 2 * path.plan.coordinates.free + int(start[len(path.plan.contacts) + i])
            places += [(i, component, first + s, state) for s, state in enumerate(component.states)]
    return places
