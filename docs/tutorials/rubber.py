
from typing import Annotated

import scissordyn as sd


def force(length, rate, stiffness, free_length):
    stretch = length - free_length
    return stiffness * stretch**3, 0.25 * stiffness * stretch**4, 0.0


@sd.component(port="line", force=force, symbol="spring")
class RubberBand:
    """A cubic spring."""

    name: str
    start: tuple[str, str]
    end: tuple[str, str]
    stiffness: Annotated[float, sd.Quantity("N/m^3", above=0.0, help="of the cube of the stretch")]
    free_length: Annotated[float, sd.Quantity("m", minimum=0.0, help="length without force")] = 0.1
