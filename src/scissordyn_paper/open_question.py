"""The paper's open question: bars that bend and oil in the joint, each and together, as data and runs.

The conclusion of the paper expects that both "may reduce the energy consumption", and cites that flexible bars reduce the
collisions. Its stroke at 150 rpm starts at full speed, so that the drive's work is mostly kinetic energy; a deployment from
rest to rest is added, after which what the drive gave beyond the weight is lost or vibrates.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from scissordyn.casefile.case import Case
from scissordyn.casefile.table import add_prefix, toml
from scissordyn.config.file import make_case
from scissordyn.errors import ScissordynError
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.simulate import simulate
from scissordyn.units import degrees
from scissordyn_paper.cases import DEFAULT, SIZES, Choice, PaperCase
from scissordyn_paper.measures import JOINT
from scissordyn_paper.periodic import PERIODIC

Manoeuvre = Literal["stroke", "deployment"]

MANOEUVRES: Mapping[Manoeuvre, str] = {
    "stroke": "stroke of 50 ms at 150 rpm, from full speed",
    "deployment": "deployment from 30 to 75 deg in 0.5 s, from rest to rest, and 0.1 s more",
}

BARS: Mapping[str, Mapping[str, str]] = {
    "rigid": {},
    "solid steel": {"section": "solid 19.02x19.02 mm", "material": "steel"},
    "steel tube": {"section": "tube 60x60x1.56 mm", "material": "steel"},
    "aluminium tube": {"section": "tube 60x60x4.76 mm", "material": "aluminium"},
}
"""Bars: section and material in the case file, by name. All have the mass of the paper's bars, 5.68 kg for 2 m."""

TUBE = 42_743.0, 7.66e7  # Bending stiffness EI [N m^2] and axial stiffness EA [N] of the steel tube

STIFFER = {f"{factor:g} times the tube": factor for factor in (10.0, 100.0, 1000.0)}
"""Bars stiffer than the steel tube: ratio of their stiffness to that of the tube, by name."""

OILS = (0.01, 0.1)  # Viscosities of the oils [Pa s]

NEIGHBOUR_RUNS = 2
"""Number of runs of each case, whose clearances differ by a relative 1e-12; effects below their differences are not real."""

RUN_SAMPLES = 2001  # Number of samples of a run

MEASURES: Mapping[str, tuple[str, float]] = {
    "contacts": ("contacts", 1.0),
    "contact_fraction": ("in contact [%]", 100.0),
    "peak_force": ("largest force [kN]", 1e-3),
    "peak_metal_force": ("largest force of metal [kN]", 1e-3),
    "fastest_approach": ("fastest approach [m/s]", 1.0),
    "dissipated": ("dissipated [J]", 1.0),
    "drive_work": ("work of the drive [J]", 1.0),
    "drive_work_given": ("given by the drive [J]", 1.0),
    "output_error": ("slider off by [mm]", 1e3),
    "utilisation": ("largest stress over yield strength", 1.0),
    "trusted_until": ("trusted until [ms]", 1e3),
}
"""Measures of a run: title in the table and factor from SI units, by name."""

COMPARED: Mapping[str, str] = {
    "contacts": "contacts",
    "peak_force": "largest force",
    "dissipated": "dissipated energy",
    "drive_work": "work of the drive",
    "drive_work_given": "energy that the drive gives",
}
"""Titles of the measures by which bars and joints are compared, by name."""


@dataclass(frozen=True)
class OpenCase:
    """Case of a run of the paper's array with flexible bars or oil in the joint."""

    manoeuvre: Manoeuvre = "stroke"
    bars: str = "rigid"  # A key of `BARS` or `STIFFER`
    oil: float | None = None  # Viscosity [Pa s]; None for a dry joint
    clearance: float = SIZES[1]  # [m]
    member: int = 0  # Number of the neighbour: its clearance is larger by this multiple of a relative 1e-12
    choice: Choice = DEFAULT  # Choice of the parameters that the paper leaves open

    @property
    def name(self) -> str:
        """Name of the case in file names."""
        joint = "dry" if self.oil is None else f"oil-{1e3 * self.oil:g}"
        parts = [self.manoeuvre, self.bars.replace(" ", "-"), joint, f"{1e3 * self.clearance:g}mm"]
        if self.choice != DEFAULT:
            parts.append(self.choice.words.replace(" ", "-").replace(",", ""))
        return "_".join([*parts, f"{self.member}"])

    @property
    def joint(self) -> str:
        """Text of the kind of joint."""
        return "dry" if self.oil is None else f"{1e3 * self.oil:g} mPa s"

    @property
    def rigid(self) -> OpenCase:
        """The same case with rigid bars."""
        return dataclasses.replace(self, bars="rigid")

    @property
    def dry(self) -> OpenCase:
        """The same case with a dry joint."""
        return dataclasses.replace(self, oil=None)

    @property
    def toml(self) -> str:
        """Text of the case file; the first line has the member number, which changes the clearance of a neighbour."""
        tree = tomllib.loads(PaperCase(self.clearance, choice=self.choice).toml)
        tree["run"]["samples"] = RUN_SAMPLES
        if self.manoeuvre == "deployment":
            tree["drive"] = {"cycloidal": {"start": "30 deg", "end": "75 deg", "duration": "0.5 s"}}
            tree["run"].update(until="0.6 s", start="static")
        if self.oil is not None:
            tree["clearance"][0]["lubrication"] = {"viscosity": f"{self.oil:g} Pa s"}
        bars: dict[str, Any] = dict(BARS.get(self.bars, {}))
        if self.bars in STIFFER:
            rigidity, axial = (STIFFER[self.bars] * each for each in TUBE)
            bars = {"bending_stiffness": f"{rigidity:g} N m^2", "axial_stiffness": f"{axial:g} N"}
        if bars:
            tree["bending"] = [{"bars": "unit */bar *", **bars, "modes": "auto"}]
        return f"# {self.name}\n{_written(tree)}"


def _written(tree: Mapping[str, Any]) -> str:
    """Return tables as TOML text."""
    parts = []
    for section, tables in tree.items():
        heading = f"[[{section}]]" if isinstance(tables, list) else f"[{section}]"
        listed = tables if isinstance(tables, list) else [tables]
        parts += ["\n".join((heading, *(f"{key} = {toml(value)}" for key, value in table.items()))) + "\n" for table in listed]
    return "\n".join(parts)


_CHANGES: tuple[dict[str, Any], ...] = (
    {},
    {"driven_bar": "slider"},
    *({"angle": degrees(angle)} for angle in (15, 45, 60)),
    *({"angle": degrees(angle), "travel": "falling"} for angle in (60, 75)),
    *({"restitution": value} for value in (0.5, 0.7)),
    *({"bearing_length": value} for value in (10e-3, 30e-3)),
    {"stiffness": "bai-zhao-as-printed"},
)
ONE_AT_A_TIME = (*(dataclasses.replace(DEFAULT, **change) for change in _CHANGES), PERIODIC)
"""The default choice, and those that differ from it in one parameter. At 150 rpm a stroke is 45 deg: the falling ones are the
reverse of the first two rising ones; the others would start at 90 deg or beyond, where the array cannot be assembled."""


def _every_case() -> tuple[OpenCase, ...]:
    """Return all cases: combinations of bars, joints and clearances, stiffer bars, and other values of lost parameters."""
    cases = [
        OpenCase(manoeuvre, bars, oil, size, member)
        for manoeuvre in MANOEUVRES
        for bars in BARS
        for oil in (None, *OILS)
        for size in SIZES
        for member in range(NEIGHBOUR_RUNS)
    ]
    cases += [OpenCase(bars=bars) for bars in STIFFER]
    cases += [
        OpenCase(bars=bars, oil=oil, choice=choice)
        for choice in ONE_AT_A_TIME
        for bars in ("rigid", "steel tube")
        for oil in (None, OILS[-1])
    ]
    return tuple(dict.fromkeys(cases))


OPEN_CASES = _every_case()  # All runs that answer the open question, each once

LONGEST_FIRST = tuple(sorted(OPEN_CASES, key=lambda case: (case.bars == "rigid", case.manoeuvre, case.member)))


@lru_cache(8)
def _described(text: str) -> Case:
    return make_case(tomllib.loads(text), {"folder": Path()})


def compute(case: OpenCase) -> xr.Dataset:
    """Simulate a case and return its measures."""
    with add_prefix(case.name):
        described = _described(case.toml)
        mechanism = described.mechanism
        if case.member:
            mechanism = mechanism.replace("A.clearance", case.clearance * (1.0 + case.member * 1e-12))
        trusted = case.bars == "rigid" and case.member == 0 and case.choice == DEFAULT
        run = raise_if_interrupted(simulate(mechanism, **{**described.run.keywords, "trust": trusted}))
        ideal = raise_if_interrupted(simulate(_ideal(case), **_described(_ideal_case(case).toml).run.keywords))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{case.name}': {run.attrs['cause']}")
    found = {name: ((), value) for name, value in _measured(run, ideal, case).items()}
    place = run["eccentricity"].sel(joint=JOINT).transpose("time", "axis").values
    return xr.Dataset(
        {**found, "eccentricity": (("time", "axis"), place), "time": ("time", run["time"].values)},
        attrs={"warnings": run.attrs["warnings"]},
    )


def _ideal_case(case: OpenCase) -> OpenCase:
    return dataclasses.replace(case, bars="rigid", oil=None, member=0)


def _ideal(case: OpenCase) -> Any:
    """Return the mechanism of a case with rigid bars, ideal joints and the same drive."""
    mechanism = _described(_ideal_case(case).toml).mechanism
    return mechanism.ideal()


def _largest_at(run: xr.Dataset) -> float:
    """Return the largest force of metal and film together at the clearance joint [N]."""
    return float(run["joint_peak_force"].values[np.isfinite(run["clearance"].values)].max())


def _measured(run: xr.Dataset, ideal: xr.Dataset, case: OpenCase) -> dict[str, float]:
    """Return the measures of a run by name [SI]."""
    work = run["drive_work"].values
    work = work if work.ndim == 1 else work.sum(axis=-1)
    peaks, length = run["peak_force"].values, np.nan_to_num(run["contact_duration"].values, nan=0.0)
    end = float(run["time"].values[-1])
    last = run["contact_start"].values[np.isnan(run["contact_duration"].values)]  # lasts to the end
    return {
        "modes": float(run["flexible_bar_modes"].max()) if "flexible_bar_modes" in run else 0.0,
        "contacts": float(peaks.size),
        "contact_fraction": (float(length.sum()) + float(np.sum(end - last))) / end,
        "peak_force": float(np.max(peaks, initial=0.0)) if case.oil is None else _largest_at(run),
        "peak_metal_force": float(np.max(peaks, initial=0.0)),
        "fastest_approach": float(np.max(run["approach_speed"].values, initial=0.0)),
        "dissipated": float(run["dissipated_energy"].values[-1]),
        "drive_work": float(work[-1]),
        "drive_work_given": float(np.sum(np.maximum(np.diff(work), 0.0))),
        "output_error": float(np.max(np.abs(run["slider_position"].values - ideal["slider_position"].values))),
        "utilisation": float(run["beam_utilisation"].max()) if "beam_utilisation" in run else math.nan,
        "trusted_until": float(run.attrs.get("trusted_until", math.nan)),
    }
