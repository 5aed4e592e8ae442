"""Warnings about a run and sentences about a study as data (kind, part, numbers), and the table of their texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from string import Formatter
from types import MappingProxyType
from typing import Any

import numpy as np

NAMES_MAX = 3  # at most this many names of parts in a line of text
LISTED_MAX = 6  # largest number of entries in a list or row of pictures; further entries are only counted

_LOADED = ": a contact that began at {speed:.3g} m/s was loaded to {force:.5g} N, not by an impact at that speed: its damping "
_AT_LIMIT = ": the controller is at its limit of {limit:g} N m for "
_WARMED = ": the dissipated power would warm the oil by {rise:.3g} K without cooling, "

WARNING_TEXTS: Mapping[str, str] = MappingProxyType(
    {
        "plain": "{text}",
        # laws of a joint
        "fast": ": {fast} of {contacts} contacts start faster than {limit:.2g} m/s (up to {speed:.3g} m/s); above that "
        "impacts are not elastic and contact forces are estimates",
        "deep": ": indentation reaches {fraction:.0%} of the {size}; '{law}' assumes a contact that is small compared "
        "with the radii, up to {most:.0%}",
        "continued": ": indentation reaches {depth:.3g} mm; '{law}' describes up to {deepest:.3g} mm and is continued along "
        "its tangent",
        "doubt": ": {slot} law: {doubt}",
        "caveat": ": '{law}': {caveat}",
        "one material": ": '{law}' is for two surfaces of one material",
        "steel": ": '{law}' contains the constants of steel",
        "restitution range": ": '{law}' is for restitution coefficients from {low:g} to {high:g}, not {restitution:g}",
        "restitution": ": '{law}' returns a restitution coefficient of {returned:.3f} for {restitution:g}; the damping law "
        "'exact' returns the given one",
        # contacts in motion
        "failed": "the contact model has failed, and the results from t = {time:.6g} s on are not valid: {failure}",
        "failed in a case": "the contact model has failed: {failure}",
        "loaded": _LOADED + "refers to {reference:.3g} m/s instead, and its restitution coefficient damps vibrations only",
        "loaded at onset": _LOADED + "refers to that speed and can be far too large; compare reference = 'loaded'",
        "friction": ": friction reaches {ratio:.3g} times the static limit of its law, and exceeds {limit:g} times it for "
        "{seconds:.3g} s; see bristle_damping and damping_speed",
        "negative force": ": negative normal force from t = {first:.6g} s on (N falls to {force:.6g} N at t = {time:.6g} "
        "s); constrained contact is not possible there",
        "immobile": " cannot move: the rest of the mechanism is rigid there, so the clearance has no effect",
        "painleve": ": Painlevé's paradox at {count} of {samples} samples in contact, first at t = {time:.6g} s: with "
        "friction of {ratio:.3g} of the normal force the contact force presses the surfaces together; a rigid contact has "
        "no or several solutions there, and the motion depends on stiffness and damping of the contact",
        # hard contacts
        "contacts with steps": "contacts begin and end with steps of {step:g} s, whatever their error, not where surfaces "
        "touch; contacts start with an indentation, which adds energy",
        "not solved": "the impulses of {count} of {steps} steps with contacts are not solved: neither Newton's method nor "
        "pivoting finds consistent modes, for example if friction locks surfaces (Painlevé); their impulses "
        "are computed without friction",
        "over-determined": "in {count} of {steps} steps with contacts more contacts are closed than the position "
        "determines: only the sums of their impulses are determined; each is that of surfaces with the same small compliance",
        "overlap": ": hard surfaces overlap by {overlap:.2g} clearances{others}: the step of {step:.3g} s is too long",
        "not converged": "the losses of restitution have not converged: {unresolved:.3g} of {lost:.3g} J are lost in "
        "contacts within {within:g} steps of the previous contact of their joint, and depend on the step; compare "
        'trust = true, or step = "{step:.2g} s"',
        "jammed": "at rest or jammed: from t = {time:.6g} s on nothing moves, and the contacts of {names} stick",
        # components
        "at limit": _AT_LIMIT
        + "{fraction:.2g} of the run, first at t = {time:.6g} s, and there up to {behind:.3g} deg from its "
        "reference",
        "at limit, no reference": _AT_LIMIT + "{fraction:.2g} of the run, first at t = {time:.6g} s",
        "at rising limit": ": the controller is at its rising limit, which reaches {limit:g} N m after {ramp:g} s, until t = "
        "{time:.6g} s, and there up to {behind:.3g} deg from its reference",
        "at limit between samples": _AT_LIMIT + "less than the time between two samples",
        "restless": ": between samples it changes from one limit to the other {reversals} times: its gains are too high for "
        "the moved mass, or the step is too long for hard contact; use smaller gains, or compliant contact",
        "at limit in a case": ": the controller reaches its limit of {limit:g} N m",
        "state scale": ": an error of {error:.2g} {unit}, which the tolerance allows in its state '{state}', is {share:.2g} "
        "of its largest {force}; the scale of {scale:.2g} {unit} is too large, about {fitting:.1g} {unit} would fit",
        "recoil": ": bristles recoil at {recoil:.3g} m/s (t = {time:.6g} s), faster than the Stribeck speed of {speed:.3g} "
        "m/s: loads between the kinetic and the static coefficient ({kinetic:g} and {static:g}) start a slip if they begin "
        "suddenly; bristle_stiffness = {stiffer:.2g} or a larger stribeck_speed holds them",
        "off the rail": " runs off the end of bar '{bar}' at t = {time:.6g} s; the model extends the bar straight",
        "table overshoots": "{table}: between its pairs the curve leaves the values of the table by {share:.3g} times their "
        "range ({place}); expected closer or equally spaced pairs there",
        "beyond": " leaves its curve or stroke by up to {beyond:.3g} {unit} (t = {time:.6g} s), where its force is constant",
        "impulse": " locks at t = {time:.6g} s; the drives do {work:.3g} J of work in this impulse, which the largest driving "
        "torques do not include",
        "unseen force": ": bearings carry the torques of this coupling, but not its force; add teeth, a belt or a screw to the "
        "coupling to state where its force acts",
        "pulling flank": ": the given flank pulls for {fraction:.2g} of the run, with up to {force:.3g} {unit} on the "
        "output (t = {time:.6g} s); real teeth separate then, and the other flank carries",
        "moving centre": ": coupling '{coupling}' keeps its relation of angles although this clearance lets the centre of "
        "'{body}' move by {clearance:.3g} mm; teeth or a belt would turn it by up to this distance divided by its pitch radius",
        # bars that bend
        "yield": " is stressed to {ratio:.3g} times its yield strength; the model of the bar is elastic (t = {time:.6g} s)",
        "strain": " has a strain of {ratio:.3g}; the model is valid for small strains (t = {time:.6g} s)",
        "buckling": " is compressed to {ratio:.3g} times the force at which the mechanism buckles with its drives locked (t "
        "= {time:.6g} s)",
        "bending modes": ": the contact at t = {time:.6g} s lasts {lasting:.3g} ms and excites bending up to "
        "{frequency:.0f} Hz; {short} of {bars} bars keep modes up to {highest:.0f} Hz: modes = {modes} keeps those of the "
        "contact",
        # films of oil
        "thin film": ": the film is thinner than three roughnesses of {roughness:.3g} m for {fraction:.2g} of the run, least "
        "{least:.3g} m at t = {time:.6g} s in the direction {angle:.3g} deg; asperities carry part of the load "
        "there",
        "roughness decides": ": the largest force, {force:.3g} N at t = {time:.6g} s, occurs in a film of {thickness:.3g} m, "
        "below three roughnesses of {roughness:.3g} m, and depends on the roughness; asperities carry {share:.2g} of it",
        "thin film in a case": ": the film is thinner than three roughnesses of {roughness:.3g} m, least {least:.3g} m",
        "film pressure": ": film pressures reach {pressure:.2g} Pa (t = {time:.6g} s); above {limit:.0e} Pa oil thickens "
        "and surfaces yield, but the model has rigid surfaces",
        "full film pulls": ": the full film pulls with pressures down to {tension:.2g} Pa below the surroundings at t = "
        "{time:.6g} s; oil boils {bears:.2g} Pa below them: full = true is not possible there",
        "cavitation": ": the film cavitates beyond the model: to follow the journal its oil would have to go to "
        "{tension:.2g} Pa below the surroundings at t = {time:.6g} s, and for {fraction:.2g} of the run to more than the "
        "{bears:.2g} Pa that drive oil back; the model fills the clearance at any time, so films after that can be too "
        "strong",
        "boiling": ": the oil boils at the {ambient:.3g} Pa around it: its vapour pressure is {vapour:.3g} Pa",
        "vacuum": ": oil evaporates in a vacuum, at the {ambient:.3g} Pa around it; the film stays in the model: give the "
        "vapour_pressure of an oil that is made for a vacuum, or leave the joint dry",
        "vortices": ": Reynolds' number {number:.3g} exceeds {limit:.3g}, above which the film has vortices",
        "squeeze": ": the squeeze Reynolds number rho c |e'|/mu reaches {number:.3g}; above {limit:g} the inertia of the "
        "oil, which the model neglects, is a considerable part of its pressure",
        "oil boils off": _WARMED + "beyond {limit:g} deg C, where oils evaporate and boil; the model keeps the oil unchanged",
        "oil warms": _WARMED + "and its viscosity fall from {before:.3g} to {after:.3g} Pa s; both are constant in the model",
        # energy and reactions
        "unbalanced": "energy balance error: {residual:.3g} J{share}; the results are not accurate; try {finer}",
        "gain": "{source} gives energy: {variable} falls by {gain:.3g} J until t = {time:.6g} s; this is not "
        "included in the energy balance",
        "event gain": "the event of '{name}' at t = {time:.6g} s gives {gain:.3g} J; this is not included in the energy "
        "balance",
        "redundant joints": "there are redundant ideal joints; the reactions of {names} are not determined and are left out "
        "(NaN)",
        "aligned": "at {count} of {instants} instants, first at t = {time:.6g} s, bodies are aligned (a singular position): "
        "the reactions of {names} are not determined there and are left out (NaN)",
        "checkpoints": "the last checkpoints are missing: {problem}",
        # wear
        "unworn": ": wear of a joint with lubrication or slip of the contact points: it is left unworn",
        "unused coefficient": "no joint takes the wear coefficient of '{pair}'",
        "ideal forces": "estimated from forces of ideal joints: close while journals stay in contact, but without the wear of "
        "impacts, as after a concentric start or at forces near zero; that of '{joint}' falls to {percent:.3g} % of its "
        "largest",
        "ideal deviation": "the life until a tracked point leaves its tolerance needs simulated cycles",
        "cycle error": ": the error of a single cycle exceeds the tolerance of {tolerance}",
        "scatter": ": cycles do not repeat: the wear of a cycle scatters by {percent:.2g} % (standard deviation); more members "
        "narrow the interval",
        "drift": ": cycles have not settled: the wear changes by {percent:.2g} % within the averaged cycles; let more periods "
        "settle",
        # studies: whether the requirements are met
        "undecided": "No case is complete: the requirements cannot be judged.",
        "probability": "Probability that all requirements are met: {fraction:.1%}{interval}, from {trials} samples.",
        "met": "{met} of {tried} points meet all requirements: {fraction:.1%} of the {of}{interval}.",
        "met and partly": "{met} of {tried} points meet all requirements, and {partly} more in some of their cases: "
        "{fraction:.1%} of the {of}{interval}.",
        "partly": "No point meets all requirements in all its cases (0 of {tried}), and {partly} meet them in some: "
        "{fraction:.1%} of the {of}{interval}.",
        "nowhere": "No point meets all requirements (0 of {tried}): {fraction:.1%} of the {of}{interval}.",
        # studies: the point to build
        "recommended": "Point {point} is recommended; its smallest margin is {margin}, of {requirement}.",
        "nearest": "Point {point} is nearest to the requirements; its smallest margin is {margin}, of {requirement}.",
        "only point": "The smallest margin is {margin}, of {requirement}.",
        "samples": "All requirements are met in {hits} of {samples} samples of the uncertain parameters: probability "
        "{fraction:.0%} (95 % interval {low:.1%} to {high:.1%}).",
        "same samples": "The point meets all requirements in {hits} of {samples} samples of the uncertain parameters: "
        "probability {fraction:.0%} (95 % interval {low:.1%} to {high:.1%}); the same samples chose it, so new samples decide.",
        # studies: members, cheap and accurate runs
        "members agree": "Members (runs whose starts differ by round-off) agree to {least:.1%} of every measure at all points.",
        "members differ": "Members (runs whose starts differ by round-off) differ by more than {least:.1%} of a measure at "
        "{differ} of {tried} points, and on the requirements at {undecided}: the motion is chaotic there.",
        "cheap and accurate": "{fraction:.1%} of the range meets all requirements (95 % interval {low:.1%} to {high:.1%}), "
        "from {cheap} cheap and {accurate} accurate runs{saved}.",
        "confirmed": "Of the best {tried} points of the search, {met} meet all requirements in accurate runs; all other "
        "values of the search come from cheap runs.",
        "confirmed front": "Of {tried} points of the search that were run accurately, {best} meet all requirements and are "
        "best there; all other values of the search come from cheap runs.",
    }
)
"""Text of each kind of warning and sentence, with placeholders for its numbers.

A text begins with a colon if warnings on several parts can be joined in one line.
"""

RANKING_NUMBER = MappingProxyType({"fast": "speed"})
"""Number that determines the worst part in a line, by kind of warning; for other kinds it is the first that differs."""


@dataclass(frozen=True)
class RunWarning:
    """Warning about a run, or sentence about a study: its kind, the part, and the numbers in its text."""

    kind: str  # key of `WARNING_TEXTS`
    part: str = ""  # name of the part; empty if it is about the whole run or study
    what: str = "joint"  # kind of part
    numbers: Mapping[str, Any] = field(default_factory=dict)  # numbers and texts that fill the placeholders of the text

    def __str__(self) -> str:
        prefix = f"{self.what} '{self.part}'" if self.part else ""
        return prefix + WARNING_TEXTS[self.kind].format(**self.numbers)

    @property
    def data(self) -> dict[str, Any]:
        """Dictionary for JSON; `RunWarning(**data)` is the same warning."""
        return {"kind": self.kind, "part": self.part, "what": self.what, "numbers": dict(self.numbers)}


def warning(kind: str, part: str = "", what: str = "joint", /, **numbers: Any) -> RunWarning:
    """Return a warning of a kind in `WARNING_TEXTS`, with the numbers for its text."""
    return RunWarning(
        kind, part, what, {name: number.tolist() if hasattr(number, "tolist") else number for name, number in numbers.items()}
    )


def plain(texts: Iterable[str]) -> list[RunWarning]:
    """Convert sentences to warnings of the kind "plain"."""
    return [warning("plain", text=text) for text in texts]


def first_of_each(warnings: Iterable[RunWarning]) -> list[RunWarning]:
    """Return warnings without those that differ from an earlier one only in numbers."""
    first: dict[Any, RunWarning] = {}
    for item in warnings:
        texts = tuple(value for value in item.numbers.values() if isinstance(value, str))
        first.setdefault((item.kind, item.what, item.part, texts), item)
    return list(first.values())


def group(warnings: Iterable[RunWarning]) -> list[list[RunWarning]]:
    """Group warnings of one kind that differ only in part and numbers, in the order of the first warning of each group."""
    groups: dict[Any, list[RunWarning]] = {}
    for item in warnings:
        texts = tuple(value for value in item.numbers.values() if isinstance(value, str))
        alone = str(item) if not WARNING_TEXTS[item.kind].startswith(":") else ""
        groups.setdefault((item.kind, item.what, texts, alone), []).append(item)
    return list(groups.values())


def line(warnings: list[RunWarning]) -> str:
    """Return the text of a group in one line, with the ranges of its numbers and the part with the worst number."""
    if len(warnings) == 1:
        return str(warnings[0])
    kind, what = warnings[0].kind, warnings[0].what
    words, differing = "", list[str]()
    for literal, name, form, _ in Formatter().parse(WARNING_TEXTS[kind]):
        words += literal
        if name is None:
            continue
        values = [item.numbers[name] for item in warnings]
        if isinstance(values[0], str):
            words += values[0]
            continue
        low, high = (format(extreme, form or "") for extreme in (min(values), max(values)))
        words += low if low == high else f"{low} to {high}"
        differing += [name] if low != high else []
    names = [f"'{item.part}'" for item in warnings[:NAMES_MAX]]
    names += [f"{len(warnings) - NAMES_MAX} more"] if len(warnings) > NAMES_MAX else []
    worst = ""
    if differing:
        by = RANKING_NUMBER[kind] if RANKING_NUMBER.get(kind) in differing else differing[0]
        worst = f"; the worst is '{warnings[int(np.argmax([item.numbers[by] for item in warnings]))].part}'"
    return f"{len(warnings)} {what}s ({', '.join(names)}){words}{worst}"
