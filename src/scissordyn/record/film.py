"""Variables and warnings of oil films in lubricated joints: thickness, pressure, Reynolds numbers, warming, validity."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from scissordyn.laws.oil import TEMPERATURE_RANGE
from scissordyn.mechanics.monitored import JOINT_FORCE
from scissordyn.model.clearance import Clearance, Lubrication
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import state_kept
from scissordyn.record.results import Run, Variables, described
from scissordyn.record.sampling import time_mean
from scissordyn.record.trajectory import Trajectory
from scissordyn.record.transmitted import in_chunks, recorded_ends
from scissordyn.record.variable import Variable
from scissordyn.warning import RunWarning, warning

MIXED_RATIO_MAX = 3.0  # [combined rms roughnesses] film thickness (lambda ratio) below which asperities of an oil film touch

# Meaning, in a run, of the direction of least film thickness
THINNEST = "direction of the thinnest place of the film in the bearing's body, at least_thickness_time"
RECORDED = "at samples and ends of steps"  # Part of a meaning: where the largest value of a film variable is sought
SQUEEZE_TEXT = f"largest squeeze Reynolds number rho c |e'|/mu {RECORDED}"  # meaning of `squeeze_reynolds_number`

AT_PEAK = "at the instant of the joint's largest force"  # Part of a meaning: the instant for which a film variable is reported


def _films_over_time(plan: Plan, path: Trajectory) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return samples and recorded instants in order of time, shape (nt,) [s], and outputs of films, (nt, films, components)."""
    first, time = len(plan.components) - len(plan.lubricated), np.zeros(0)
    results, coordinates = list[np.ndarray](), list[np.ndarray]()
    with state_kept(path.system):
        for part in in_chunks(path, [path.samples, *recorded_ends(path)]):
            outputs, time = path.record(part), np.append(time, part.time)
            results.append(outputs.result[:, first:])
            coordinates.append(outputs.coordinate[:, first:])
    order, films = np.argsort(time, kind="stable"), dict[str, np.ndarray]()
    for output in plan.components[-1].declaration.reported:
        values = np.concatenate(coordinates if output.coordinate else results)
        films[output.name] = values[order, :, output.first : output.first + output.components]
    return time[order], films


def film_variables(plan: Plan, path: Trajectory, variables: Mapping[str, Variable], heat_capacity: float = 2000.0) -> Variables:
    """Return per film: smallest thickness with instant and direction, fractions of time, Reynolds numbers and warming.

    `heat_capacity`: typical heat capacity of mineral oils [J/(kg K)].
    """
    joints = plan.lubricated
    if not joints:
        return {}
    time, films = _films_over_time(plan, path)
    film = {name: values[..., 0] for name, values in films.items()}

    clear = np.array([gap.clearance for _, gap, _ in joints])
    rough = np.array([oil.roughness for _, _, oil in joints])
    bears = np.array([oil.ambient_pressure - oil.vapour_pressure for _, _, oil in joints])
    inverse = np.array([oil.mass_density / oil.dynamic_viscosity for _, _, oil in joints])
    content = np.array([2.0 * math.pi * gap.journal_radius * gap.clearance * gap.bearing_length for _, gap, _ in joints])
    capacity = heat_capacity * content * np.array([oil.mass_density for _, _, oil in joints])
    thickness, eccentricity = film["thickness"], variables["film_peak_eccentricity"].values
    when, largest = variables["film_peak_eccentricity_time"].values, path.peaks(JOINT_FORCE)
    dry = mixed = torn = heat = direction = at_peak = share = np.full(len(joints), math.nan)
    if len(time):
        is_dry, is_thin = thickness <= 0.0, thickness < MIXED_RATIO_MAX * rough
        is_torn = film["tension"] > np.maximum(bears, 0.0)
        dry, mixed, torn = (time_mean(part, time) for part in (is_dry, is_thin & ~is_dry, is_torn))
        heat = np.trapezoid(film["power_lost"], time, axis=0)
        index = np.arange(len(joints))
        nearest, highest = (np.argmin(np.abs(time[:, None] - at), axis=0) for at in (when, largest["largest_time"]))
        direction = np.arctan2(*films["displacement"][nearest, index].T[::-1])
        at_peak, carried = thickness[highest, index], film["asperity_force"][highest, index]
        share = np.divide(carried, largest["largest"], out=np.zeros_like(carried), where=largest["largest"] > 0.0)
    sliding, squeezing = (np.max(np.abs(film[f"{name}_speed"]), axis=0, initial=0.0) for name in ("sliding", "squeeze"))
    answers = (
        ("peak_force_thickness", at_peak, "m", f"film thickness {AT_PEAK}"),
        ("peak_force_asperity_share", share, "1", f"part of the force that the asperities carry {AT_PEAK}"),
        ("least_thickness", clear - eccentricity, "m", "least film thickness, negative in contact"),
        ("least_thickness_time", when, "s", "instant of the least film thickness"),
        ("least_thickness_angle", direction, "rad", THINNEST),
        ("dry_share", dry, "1", "part of the time in which the surfaces touch"),
        ("mixed_share", mixed, "1", "part of the time with a film below three roughnesses"),
        ("full_share", 1.0 - dry - mixed, "1", "part of the time with a full film"),
        ("torn_share", torn, "1", "part of the time in which the journal leaves faster than oil can follow"),
        ("reynolds_number", inverse * clear * sliding, "1", f"largest rho U c/mu of the sliding surfaces, {RECORDED}"),
        ("squeeze_reynolds_number", inverse * clear * squeezing, "1", SQUEEZE_TEXT),
        ("heating", heat / capacity, "K", "how much the power lost would warm the oil in the joint"),
    )
    return {f"film_{name}": described("film", values, units, text) for name, values, units, text in answers}


def film_warnings(plan: Plan, run: Run) -> list[RunWarning]:
    """Warn of films that were too thin, cavitating, too hot or turbulent, and of largest forces that depend on roughness."""
    warnings = list[RunWarning]()
    for k, (joint, gap, oil) in enumerate(plan.lubricated):
        numbers = {str(name)[5:]: part.values for name, part in run.variables.items() if part.dims == ("film",)}
        film = {name: float(values[k]) for name, values in numbers.items() if values.dtype.kind == "f"}
        if film["least_thickness"] < MIXED_RATIO_MAX * oil.roughness:
            where = {"time": film["least_thickness_time"], "angle": math.degrees(film["least_thickness_angle"])}
            where |= {"least": film["least_thickness"], "fraction": film["dry_share"] + film["mixed_share"]}
            warnings.append(warning("thin film", joint.name, roughness=oil.roughness, **where))
        if film["peak_force_thickness"] < MIXED_RATIO_MAX * oil.roughness:
            at = plan.places([joint.name])[0]
            peak = {"force": run["joint_peak_force"].values[at], "time": run["joint_peak_force_time"].values[at]}
            peak |= {"thickness": film["peak_force_thickness"], "share": film["peak_force_asperity_share"]}
            warnings.append(warning("roughness decides", joint.name, roughness=oil.roughness, **peak))
        warnings += _torn(joint.name, oil, film) + _inertia(joint.name, gap, film) + _hot(joint.name, oil, film["heating"])
    return warnings


def film_peak_warnings(
    name: str, oil: Lubrication, pressure: float, time: float, pressure_max: float = 1e8, vacuum: float = 1.0
) -> list[RunWarning]:
    """Warn of too high film pressure, and of oil that boils or evaporates at the ambient pressure.

    `pressure_max`: [Pa] At higher pressures viscosity rises several times and steel surfaces deform elastically.

    `vacuum`: [Pa] Ambient pressure below which oil of unknown vapour pressure is assumed to evaporate.
    """
    warnings = (
        [warning("film pressure", name, pressure=pressure, time=time, limit=pressure_max)] if pressure > pressure_max else []
    )
    if 0.0 < oil.vapour_pressure >= oil.ambient_pressure:
        warnings.append(warning("boiling", name, ambient=oil.ambient_pressure, vapour=oil.vapour_pressure))
    elif oil.ambient_pressure < vacuum and oil.vapour_pressure == 0.0:
        warnings.append(warning("vacuum", name, ambient=oil.ambient_pressure))
    return warnings


def _torn(name: str, oil: Lubrication, film: Mapping[str, float]) -> list[RunWarning]:
    """Warn of film pressures so low that the oil cavitates."""
    tension, time, bears = film["peak_tension"], film["peak_tension_time"], oil.ambient_pressure - oil.vapour_pressure
    if not tension > max(bears, 0.0):
        return []
    if oil.full:
        return [warning("full film pulls", name, tension=tension, time=time, bears=bears)]
    return [warning("cavitation", name, tension=tension, time=time, fraction=film["torn_share"], bears=max(bears, 0.0))]


def _inertia(
    name: str, gap: Clearance, film: Mapping[str, float], taylor: float = 41.2, squeezing: float = 1.0
) -> list[RunWarning]:
    """Warn of Taylor vortices and of squeeze flow with significant inertia.

    `taylor`: [-] Taylor vortices begin at the Reynolds number rho U c/mu = 41.2 sqrt(R/c).

    `squeezing`: [-] Reynolds number of a squeeze film, rho c |e'|/mu, above which the inertia of the oil is not negligible.
    """
    number, limit = film["reynolds_number"], taylor * math.sqrt(gap.journal_radius / gap.clearance)
    squeeze = film["squeeze_reynolds_number"]
    warnings = [warning("vortices", name, number=number, limit=limit)] if number > limit else []
    return warnings + ([warning("squeeze", name, number=squeeze, limit=squeezing)] if squeeze > squeezing else [])


def _hot(name: str, oil: Lubrication, rise: float, thinned: float = 0.8) -> list[RunWarning]:
    """Warn of oil that dissipation heats beyond the temperatures for which its properties are known.

    `thinned`: [-] A warning is given if heating reduces the viscosity below this fraction.
    """
    if not np.isfinite(rise):
        return []
    temperature = oil.temperature + rise
    if temperature > TEMPERATURE_RANGE[1]:
        return [warning("oil boils off", name, rise=rise, limit=TEMPERATURE_RANGE[1] - 273.15)]
    if oil.oil is None:
        return []
    before, after = oil.dynamic_viscosity, oil.oil.viscosity(temperature)
    return [warning("oil warms", name, rise=rise, before=before, after=after)] if after < thinned * before else []
