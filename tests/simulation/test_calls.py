"""How much of a run is Python."""

import sys
from types import FrameType

import scissordyn as sd


def array() -> sd.Mechanism:
    """The paper's array with clearance at joint A."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))


def calls(mechanism: sd.Mechanism) -> tuple[int, int]:
    """Calls of the package's own functions in one run, and how many of them reduce a mechanism."""
    counted = [0, 0]

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and "scissordyn" in frame.f_code.co_filename:
            counted[0] += 1
            counted[1] += frame.f_code.co_name == "reduce_mechanism"

    sys.setprofile(note)
    try:
        sd.simulate(mechanism, until=0.05)
    finally:
        sys.setprofile(None)
    return counted[0], counted[1]


def test_python_calls_of_a_run() -> None:
    """Limit: 700 for a known mechanism, 750 for a variation of it; 1750 with the reduction, which is made once."""
    known = array()
    sd.simulate(known, until=0.05)
    again, varied, new = calls(known), calls(known.replace("A.clearance", 0.4e-3)), calls(array())
    assert again[0] <= 700
    assert varied[0] <= 750
    assert new[0] <= 1750
    assert (again[1], varied[1], new[1]) == (0, 0, 1)
