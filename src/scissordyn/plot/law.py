"""Draw contact and friction laws: the loop of one impact, friction over slip, and a comparison of all laws."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.evaluate import elastic_force
from scissordyn.laws.experiment import impact, oscillation, steady_coefficient
from scissordyn.laws.material import STEEL
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    IDEAL,
    LINE_WIDTH,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Canvas,
    legend,
    literal,
    normal,
    number_decades,
    panels,
)
from scissordyn.plugin.element import pointers, row_of

DEFAULT_JOINT = JointContact(clearance=0.5e-3, journal_radius=10e-3, length=15e-3, journal=STEEL, bearing=STEEL)
"""Clearance joint in pictures of laws if none is given: that of `Clearance` with c = 0.5 mm."""

OSCILLATION = 2e-6, 5.0
"""Amplitude [m] and frequency [Hz] of the slip in pictures of friction laws: a few bristle lengths, up to 63 um/s."""

SLIP_SPEEDS = np.logspace(-6, 0, 400)  # Slip speeds of the steady sliding curve [m/s]

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, GREY)  # Colours of the laws in a picture, in order
DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)))
"""Line styles that distinguish laws of the same colour in a gallery."""


def draw_law(
    law: Elastic | Damping | Friction,
    *,
    axes: Canvas = None,
    joint: JointContact = DEFAULT_JOINT,
    mass: float = 5.0,
    speed: float = 0.5,
) -> list[Axes]:
    """Draw the curves of one law, in the impact of a free body with a mass [kg] at an approach speed [m/s].

    An elastic law is shown in the loop of an impact with Flores's damping, a damping law in an impact with Liu's elastic law.
    The elastic part alone is drawn next to each loop. A friction law is shown in steady sliding and in an oscillation of a few
    micrometres.
    """
    if isinstance(law, Friction):
        return _draw_friction(law, axes, joint)
    stiffness, damping = (law, Flores()) if isinstance(law, Elastic) else (Liu(), law)
    (panel,) = drawn = panels(axes, 1, size=(5.6, 3.6))
    history = impact(stiffness, damping, joint, mass=mass, speed=speed)
    depth = np.linspace(0.0, float(history.indentation.max()), 200)[1:]
    row, pointer = row_of(stiffness, joint), pointers(stiffness)["force"]
    elastic = np.array([elastic_force(pointer, delta, row) for delta in depth])
    force, length = engineering("N", history.force, elastic), engineering("m", depth)
    x, y = length.factor * history.indentation, force.factor * history.force
    panel.plot(x, y, linewidth=LINE_WIDTH, color=BLUE, label=literal(f"{stiffness.name} + {damping.name}"))
    panel.plot(length.factor * depth, force.factor * elastic, **IDEAL, label=literal(f"{stiffness.name} alone"))
    for part in (0.35, 0.65):  # arrow heads show the direction of the loop
        k = int(part * history.time.size)
        arrow = {"arrowstyle": "-|>", "color": BLUE, "lw": 0.0}
        panel.annotate("", xy=(x[k], y[k]), xytext=(x[k - 8], y[k - 8]), arrowprops=arrow)
    back = history.restitution * speed
    title = f"{law.name}: {mass:g} kg at {speed:g} m/s, rebounds at {back:.3g} m/s"
    panel.set_title(literal(title), loc="left", fontsize=normal())
    _label(panel, force, length)
    panel.legend(loc="upper left", frameon=False, fontsize="small")
    return drawn


def _label(axes: Axes, force: Scale, length: Scale) -> None:
    axes.set(xlabel=length.label("indentation"), ylabel=force.label("normal force"), xlim=(0.0, None), ylim=(0.0, None))


def _draw_friction(friction: Friction, axes: Canvas, joint: JointContact) -> list[Axes]:
    sliding, sticking = panels(axes, 1, 2, size=(8.0, 3.4), share=False)
    sliding.semilogx(SLIP_SPEEDS, steady_coefficient(friction, joint, SLIP_SPEEDS), color=BLUE, linewidth=LINE_WIDTH)
    sliding.set(xlabel="slip speed [m/s]", ylabel="friction force / normal force", ylim=(0.0, None))
    number_decades(sliding.xaxis)
    sliding.set_title(literal(f"{friction.name}: steady sliding"), loc="left", fontsize=normal())
    amplitude, frequency = OSCILLATION
    history = oscillation(friction, joint, amplitude=amplitude, frequency=frequency)
    length = engineering("m", history.displacement)
    sticking.plot(length.factor * history.displacement, history.coefficient, color=BLUE, linewidth=LINE_WIDTH)
    sticking.set(xlabel=length.label("slip"), ylabel="friction force / normal force")
    sticking.set_title(f"oscillation at {frequency:g} Hz", loc="left", fontsize=normal())
    for panel in (sliding, sticking):
        panel.axhline(0.0, color=BLACK, linewidth=0.5)
    return [sliding, sticking]


def _line_style(index: int) -> dict[str, Any]:
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index // len(COLOURS) % len(DASHES)]}


def _law_with_restitution(law: type[Any], restitution: float) -> Any:
    return law(restitution=restitution) if any(field.name == "restitution" for field in fields(law)) else law()


def draw_gallery(
    *, axes: Canvas = None, joint: JointContact = DEFAULT_JOINT, mass: float = 5.0, speed: float = 0.5, restitution: float = 0.5
) -> list[Axes]:
    """Draw all laws in one impact and in steady sliding, with default parameters except the restitution coefficient.

    Damping laws are alike for restitution coefficients near 1. The free body has a mass [kg] and an approach speed [m/s].
    """
    elastic, damping, friction = panels(axes, 3, size=(7.2, 9.6), share=False)
    for panel, pairs in (
        (elastic, [(name, law(), Flores()) for name, law in ELASTIC.items()]),
        (damping, [(name, Liu(), _law_with_restitution(law, restitution)) for name, law in DAMPING.items()]),
    ):
        # a much softer elastic law would squeeze the other curves against the axis
        histories = [(name, impact(spring, damper, joint, mass=mass, speed=speed)) for name, spring, damper in pairs]
        deepest = np.array([history.indentation.max() for _, history in histories])
        shown = deepest <= 3.0 * np.median(deepest)
        length = engineering("m", deepest[shown])
        force = engineering("N", *(history.force for _, history in histories))
        for index, (name, history) in enumerate(histories):
            label = name if shown[index] else f"{name} (to {length.factor * deepest[index]:.3g} {length.unit})"
            x, y = length.factor * history.indentation, force.factor * history.force
            panel.plot(x, y, linewidth=LINE_WIDTH, label=label, **_line_style(index))
        _label(panel, force, length)
        panel.set_xlim(0.0, 1.05 * length.factor * float(deepest[shown].max()))
    elastic.set_title(f"stiffness, with flores: {mass:g} kg at {speed:g} m/s", loc="left", fontsize=normal())
    damping.set_title(f"damping, on liu, restitution {restitution:g} where the law has one", loc="left", fontsize=normal())
    for index, (name, law) in enumerate(FRICTION.items()):
        friction.semilogx(
            SLIP_SPEEDS, steady_coefficient(law(), joint, SLIP_SPEEDS), linewidth=LINE_WIDTH, label=name, **_line_style(index)
        )
    friction.set(xlabel="slip speed [m/s]", ylabel="friction force / normal force")
    number_decades(friction.xaxis)
    friction.set_title("friction, in steady sliding", loc="left", fontsize=normal())
    for panel in (elastic, damping, friction):
        legend([panel])
    return [elastic, damping, friction]
