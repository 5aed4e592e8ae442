"""Warnings of a run as data, a kind with a part and numbers, and the one table of their words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from string import Formatter
from types import MappingProxyType
from typing import Any

import numpy as np

NAMED = 3  # Most names of parts in one line

_LOADED = ": a contact that began at {speed:.3g} m/s was loaded to {force:.5g} N and is no impact at that speed: its damping "
_AT_LIMIT = ": the controller is at its limit of {limit:g} N m for "
_WARMED = ": the power lost would warm the oil by {rise:.3g} K if nothing cooled it, "

WORDS: Mapping[str, str] = MappingProxyType(
    {
        "plain": "{text}",
        # laws of a joint
        "fast": ": {fast} of {contacts} contacts start faster than {limit:.2g} m/s (up to {speed:.3g} m/s); above that "
        "impacts are not elastic and contact forces are estimates",
        "deep": ": indentation reaches {fraction:.0%} of the {size}; '{law}' assumes a contact that is small against the "
        "radii, up to {most:.0%}",
        "continued": ": indentation reaches {depth:.3g} mm; '{law}' describes up to {deepest:.3g} mm and is continued along "
        "its tangent",
        "doubt": ": {slot} law: {doubt}",
        "caveat": ": '{law}': {caveat}",
        "one material": ": '{law}' is for two surfaces of one material",
        "steel": ": '{law}' has the constants of steel built in",
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
        "touch: they start pressed in, with energy from nowhere",
        "not solved": "the impulses of {count} of {steps} steps with contacts are not solved: neither Newton's method nor "
        "pivoting finds modes that agree with each other, as with friction that locks surfaces (Painlevé); their impulses "
        "are those without friction",
        "over-determined": "in {count} of {steps} steps with contacts more contacts are closed than the position "
        "determines: their impulses are those of surfaces with the same small compliance, only their sums are determined",
        "overlap": ": hard surfaces overlap by {overlap:.2g} clearances{others}: the step of {step:.3g} s is too long",
        "not converged": "the losses of restitution have not converged: {unresolved:.3g} of {lost:.3g} J are those of "
        "contacts that follow the one before in their joint within {within:g} steps, and change with the step; compare "
        'trust = true, or step = "{step:.2g} s"',
        "jammed": "at rest or jammed: from t = {time:.6g} s on nothing moves, and the contacts of {names} stick",
        # components
        "at limit": _AT_LIMIT
        + "{fraction:.2g} of the run, first at t = {time:.6g} s, and there up to {behind:.3g} deg from its "
        "reference",
        "at limit, no reference": _AT_LIMIT + "{fraction:.2g} of the run, first at t = {time:.6g} s",
        "at limit between samples": _AT_LIMIT + "less than the time between two samples",
        "restless": ": between samples it changes from one limit to the other {reversals} times: its gains are too high for "
        "what it moves, or beside hard contact the step is too long (smaller gains, or compliant contact)",
        "at limit in a case": ": the controller reaches its limit of {limit:g} N m",
        "state scale": ": an error of {error:.2g} {unit}, which the tolerance allows in its state '{state}', is {share:.2g} "
        "of its largest {force}; the scale of {scale:.2g} {unit} is too large, about {fitting:.1g} {unit} would fit",
        "off the rail": " runs off the end of bar '{bar}' at t = {time:.6g} s, which goes on straight in the model",
        "beyond": " leaves its curve or stroke by up to {beyond:.3g} {unit} (t = {time:.6g} s), where its force is held",
        "impulse": " locks at t = {time:.6g} s by an impulse that the drives take up with {work:.3g} J; the largest driving "
        "torques do not contain it",
        "unseen force": ": bearings see the torques of this coupling, but not its force; teeth, a belt or a screw of the "
        "coupling say where it acts",
        "pulling flank": ": the flank that is given pulls for {fraction:.2g} of the run, with up to {force:.3g} {unit} on the "
        "output (t = {time:.6g} s); teeth part there, and the other flank carries",
        "moving centre": ": coupling '{coupling}' keeps a relation of angles also where this clearance lets the centre of "
        "'{body}' move by {clearance:.3g} mm: teeth or a belt would turn it by up to that over its pitch radius",
        # bars that bend
        "yield": " is stressed to {ratio:.3g} times its yield strength: the bar stays elastic in the model (t = {time:.6g} s)",
        "strain": " has a strain of {ratio:.3g}: the model is one of small strains (t = {time:.6g} s)",
        "buckling": " is compressed to {ratio:.3g} times the force at which the mechanism buckles with its drives locked (t "
        "= {time:.6g} s)",
        "bending modes": ": the contact at t = {time:.6g} s lasts {lasting:.3g} ms and excites bending up to "
        "{frequency:.3g} Hz; {short} of {bars} bars keep modes up to {highest:.3g} Hz: modes = {modes} keeps those of the "
        "contact",
        # films of oil
        "thin film": ": the film is thinner than three roughnesses of {roughness:.3g} m for {fraction:.2g} of the run, least "
        "{least:.3g} m at t = {time:.6g} s in the direction {angle:.3g} deg; asperities carry there beside "
        "the film",
        "roughness decides": ": the largest force, {force:.3g} N at t = {time:.6g} s, comes with a film of {thickness:.3g} m, "
        "below three roughnesses of {roughness:.3g} m: it depends on the roughness; asperities carry {share:.2g} of it",
        "thin film in a case": ": the film is thinner than three roughnesses of {roughness:.3g} m, least {least:.3g} m",
        "film pressure": ": film pressures reach {pressure:.2g} Pa (t = {time:.6g} s); above {limit:.0e} Pa oil thickens "
        "and surfaces yield: its forces are those of rigid surfaces",
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
        "oil, which the film does not have, is no small part of its pressure",
        "oil boils off": _WARMED + "beyond {limit:g} deg C, where oils evaporate and boil; in the model it stays as it is",
        "oil warms": _WARMED + "and its viscosity fall from {before:.3g} to {after:.3g} Pa s; both are fixed in the model",
        # energy and reactions
        "unbalanced": "the energy balance misses {residual:.3g} J{share}: the results are not accurate; try {finer}",
        "gain": "{source} gives energy: {variable} falls by {gain:.3g} J until t = {time:.6g} s; the energy balance does "
        "not see it",
        "event gain": "the event of '{name}' at t = {time:.6g} s gives {gain:.3g} J; the energy balance does not see it",
        "redundant joints": "there are redundant ideal joints; the reactions of {names} are not determined and are left out "
        "(NaN)",
        "aligned": "at {count} of {instants} instants, first at t = {time:.6g} s, bodies are aligned (a singular position): "
        "the reactions of {names} are not determined there and are left out (NaN)",
        "checkpoints": "the last checkpoints are missing: {problem}",
    }
)
"""What a warning of each kind says. Words after a part begin with a colon if several parts can share a line."""

WORST = MappingProxyType({"fast": "speed"})
"""The number that ranks the parts of a line; of other kinds it is the first that differs."""


@dataclass(frozen=True)
class RunWarning:
    """What is doubtful in a run; its text is a sentence."""

    kind: str  # Of `WORDS`
    part: str = ""  # Its name; empty if the warning is about the whole run
    what: str = "joint"  # What the part is
    numbers: Mapping[str, Any] = field(default_factory=dict)  # In the units of the words; texts where there is no number

    def __str__(self) -> str:
        prefix = f"{self.what} '{self.part}'" if self.part else ""
        return prefix + WORDS[self.kind].format(**self.numbers)

    @property
    def data(self) -> dict[str, Any]:
        """Plain data, from which `RunWarning(**data)` is the same warning."""
        return {"kind": self.kind, "part": self.part, "what": self.what, "numbers": dict(self.numbers)}


def warning(kind: str, part: str = "", what: str = "joint", /, **numbers: Any) -> RunWarning:
    """A warning of a kind of `WORDS`, with the numbers that these name."""
    return RunWarning(
        kind, part, what, {name: number.tolist() if hasattr(number, "tolist") else number for name, number in numbers.items()}
    )


def plain(texts: Iterable[str]) -> list[RunWarning]:
    """Sentences of other rooms as warnings."""
    return [warning("plain", text=text) for text in texts]


def group(warnings: Iterable[RunWarning]) -> list[list[RunWarning]]:
    """Warnings of one kind about parts that differ in numbers only, each group where its first one was."""
    groups: dict[Any, list[RunWarning]] = {}
    for item in warnings:
        texts = tuple(value for value in item.numbers.values() if isinstance(value, str))
        alone = str(item) if not WORDS[item.kind].startswith(":") else ""
        groups.setdefault((item.kind, item.what, texts, alone), []).append(item)
    return list(groups.values())


def line(warnings: list[RunWarning]) -> str:
    """A group in one line, with the ranges of its numbers and the part with the worst."""
    if len(warnings) == 1:
        return str(warnings[0])
    kind, what = warnings[0].kind, warnings[0].what
    words, differing = "", list[str]()
    for literal, name, form, _ in Formatter().parse(WORDS[kind]):
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
    names = [f"'{item.part}'" for item in warnings[:NAMED]]
    names += [f"{len(warnings) - NAMED} more"] if len(warnings) > NAMED else []
    worst = ""
    if differing:
        by = WORST[kind] if WORST.get(kind) in differing else differing[0]
        worst = f"; the worst is '{warnings[int(np.argmax([item.numbers[by] for item in warnings]))].part}'"
    return f"{len(warnings)} {what}s ({', '.join(names)}){words}{worst}"
