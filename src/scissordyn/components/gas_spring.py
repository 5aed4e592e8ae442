"""Gas spring between two points."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.curve import check_start
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import LINE, Output
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.plugin.element import numbers
from scissordyn.units import Quantity


@kernel
def force(length, rate, force, extended_length, stroke, gas_length, exponent, friction, friction_speed, damping):
    """Return tension [N], stored energy [J], dissipated power [W], and the excess of the length beyond the stroke [m]."""
    pressed = extended_length - length
    inside = min(stroke, max(0.0, pressed))
    part = 1.0 - inside / gas_length
    push = force * part ** (-exponent)
    if exponent == 1.0:
        energy = -force * gas_length * math.log(part)
    else:
        energy = force * gas_length * (part ** (1.0 - exponent) - 1.0) / (exponent - 1.0)
    energy += push * (pressed - inside)
    resisting = friction * math.tanh(rate / friction_speed) + damping * rate
    return resisting - push, energy, resisting * rate, max(-pressed, pressed - stroke)


@component(
    port=LINE,
    force=force,
    outputs=(Output("beyond", "m", "how far the length is beyond the stroke", monitored=True),),
    symbol="gas",
    example={
        "start": "rod.end",
        "end": "ground.O",
        "force": "300 N",
        "extended_length": "1.8 m",
        "stroke": "0.9 m",
        "progression": 1.4,
        "friction": "20 N",
    },
    source="Holman 1988, Thermodynamics, 4th edition, McGraw-Hill (polytropic processes)",
)
class GasSpring:
    r"""Gas spring or gas strut: gas in a closed cylinder pushes the ends apart.

    .. math:: F = F_1\left(1 - \frac{s}{\ell}\right)^{-n} - F_r\tanh\frac{\dot l}{v_r} - d\,\dot l,\qquad s = l_1 - l,\qquad
        \ell = \frac{h}{1 - 1/k}

    s is how far the spring of the length l is pressed in, of its stroke h. The length of its gas follows from the progression
    k, the force pressed in over the force extended that catalogues give, measured slowly (n = 1). In a fast motion, which is
    adiabatic, n is 1.4. Beyond the stroke the force stays, and there is a warning; stops are other components.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    force: Annotated[float, Quantity("N", above=0.0, maximum=1e9, help="force F_1 of the extended spring")]
    extended_length: Annotated[float, Quantity("m", above=0.0, maximum=1e4, help="length l_1 of the extended spring")]
    stroke: Annotated[float, Quantity("m", above=0.0, maximum=1e4, help="how far it can be pressed in, h")]
    progression: Annotated[
        float, Quantity("1", above=1.0, maximum=1e3, help="force pressed in over force extended, slowly, k")
    ] = 1.3
    exponent: Annotated[float, Quantity("1", minimum=1.0, maximum=1.7, help="n: 1 isothermal, 1.4 adiabatic")] = 1.0
    friction: Annotated[float, Quantity("N", minimum=0.0, maximum=1e9, help="friction F_r of the seal")] = 0.0
    friction_speed: Annotated[
        float, Quantity("m/s", above=0.0, maximum=1e3, help="v_r, over which friction changes its sign")
    ] = 1e-3
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping d")] = 0.0

    def check(self) -> None:
        if self.stroke >= self.extended_length:
            raise InputError(
                f"gas spring '{self.name}': a stroke of {self.stroke:g} m of a length of {self.extended_length:g} m",
                "a stroke below the extended length",
            )

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters; the length of the gas follows from the progression."""
        ends = ((self.extended_length - self.stroke, 0.0), (self.extended_length, 0.0))
        check_start(f"gas spring '{self.name}'", ends, start[0], "m")
        gas_length = self.stroke / (1.0 - 1.0 / self.progression)
        return numbers(self, gas_length=gas_length)
