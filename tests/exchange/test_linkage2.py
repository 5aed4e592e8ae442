"""Files of the Linkage program."""

import cmath
import math

import numpy as np
import pytest

import scissordyn as sd

# File of the Linkage program with a four-bar linkage
FOUR_BAR = """<linkage2>
	<program zoom="2.2" xoffset="365" units="Millimeters" scalefactor="1.000000"/>
	<connector id="7" layer="16" x="20" y="-180" anchor="true" input="true" rpm="30"/>
	<connector id="10" layer="16" x="280" y="-180" anchor="true"/>
	<connector id="12" layer="16" x="80" y="-100" draw="true"/>
	<connector id="2" layer="16" x="330" y="0" name="tip"/>
	<connector id="99" layer="1" x="0" y="0"/>
	<Link id="2" layer="16"><connector id="12"/><connector id="7"/></Link>
	<Link id="3" layer="16"><connector id="7"/><connector id="10"/></Link>
	<Link id="1" layer="16"><connector id="2"/><connector id="12"/></Link>
	<Link id="4" layer="16"><connector id="2"/><connector id="10"/></Link>
	<selected/>
</linkage2>
"""

# File of the Linkage program with a slider on the ground or on a link
SLIDER = """<linkage2>
	<connector id="0" x="0" y="0" anchor="true" input="true" rpm="-15"/>
	<connector id="1" x="0" y="50"/>
	<connector id="3" x="50" y="-10" anchor="true"/>
	<connector id="4" x="350" y="-10" {anchor}/>
	<connector id="6" x="130" y="-10" slider="true"><slidelimit id="3"/><slidelimit id="4"/></connector>
	<Link id="0"><connector id="0"/><connector id="1"/></Link>
	<Link id="1"><connector id="3"/><connector id="4"/></Link>
	<Link id="2"><connector id="6"/><connector id="1"/></Link>
</linkage2>
"""

LENGTH_UNIT = 0.0254 / 96.0  # [m] length unit of files of the Linkage program, 1/96 inch


def test_a_four_bar_of_linkage_moves_as_two_circles_intersect():
    """Closed form: the coupler's pin is where two circles meet; a positive speed turns clockwise."""
    mechanism, notes = sd.read_linkage2(FOUR_BAR)
    assert "the input at 'pin 7' turns 'link 2' by 30 rpm clockwise" in notes
    run = sd.simulate(mechanism, until=2.0, samples=41)
    pivot, other, crank, tip = (LENGTH_UNIT * z for z in (20 - 180j, 280 - 180j, 80 - 100j, 330 + 0j))
    for time, angle in zip(run["time"].values, run["angle"].sel(body="link 4").values, strict=True):
        joint = pivot + (crank - pivot) * cmath.exp(-1j * math.pi * time)
        span, a, b = other - joint, abs(tip - crank), abs(tip - other)
        turn = cmath.acos((a**2 + abs(span) ** 2 - b**2) / (2 * a * abs(span)))
        meet = joint + a * span / abs(span) * cmath.exp(1j * turn)
        assert cmath.exp(1j * angle) == pytest.approx((other - meet) / b, abs=1e-9)


@pytest.mark.parametrize("anchor", ['anchor="true"', ""])
def test_a_slider_of_linkage_keeps_to_its_line(anchor):
    """Identity: the slider is on the line between its two connectors, on the ground or on a link that turns."""
    mechanism, notes = sd.read_linkage2(SLIDER.format(anchor=anchor))
    assert "'pin 6' slides along a line without ends" in notes
    assert [body.name for body in mechanism.bodies] == ["link 0", *(["link 1"] * (not anchor)), "link 2"]
    run = sd.simulate(mechanism, until=0.5, samples=11)
    turn = np.exp(1j * run["angle"].sel(body="link 2").values)
    slider = run["position"].sel(body="link 2").values @ np.array([1, 1j]) - 0.5 * LENGTH_UNIT * abs(50j - 130 + 10j) * turn
    slot = 1.0 if anchor else np.exp(-1j * run["angle"].sel(body="link 1").values)
    assert abs(np.imag((slider - LENGTH_UNIT * (50 - 10j)) * slot)).max() < 1e-12
    assert abs(turn - turn[0]).max() > 0.1


# File of the Linkage program with a link that slides over two anchors
SLOT = """<linkage2>
	<connector x="0" y="0" id="0"/>
	<connector x="100" y="40" id="1"/>
	<connector x="200" y="0" id="2"/>
	<connector anchor="true" x="60" y="0" id="3" slider="true"><slidelimit id="0"/><slidelimit id="2"/></connector>
	<connector anchor="true" x="140" y="0" id="4" slider="true"><slidelimit id="0"/><slidelimit id="2"/></connector>
	<connector anchor="true" input="true" rpm="15" x="300" y="50" id="5"/>
	<connector x="300" y="90" id="6"/>
	<Link id="0"><connector id="0"/><connector id="1"/><connector id="2"/></Link>
	<Link id="1"><connector id="3"/></Link>
	<Link id="3"><connector id="5"/><connector id="6"/></Link>
	<Link id="4"><connector id="1"/><connector id="6"/></Link>
</linkage2>
"""


def test_a_link_of_linkage_slides_over_two_anchors():
    """Closed form: two anchors in one slot leave a translation, so that the linkage is a slider-crank."""
    run = sd.simulate(sd.read_linkage2(SLOT).mechanism, until=2.0, samples=21)
    angle = run["angle"].sel(body="link 0").values
    assert abs(angle - angle[0]).max() < 1e-10
    crank = LENGTH_UNIT * (300 + 50j + 40j * np.exp(-0.5j * math.pi * run["time"].values))
    length, height = LENGTH_UNIT * abs(200 + 50j), LENGTH_UNIT * 40
    moved = crank.real - np.sqrt(length**2 - (crank.imag - height) ** 2) - LENGTH_UNIT * 100
    x = run["position"].sel(body="link 0", axis="x").values
    assert x - x[0] == pytest.approx(moved, abs=1e-10)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<linkage2>", "<linkage2><ratios><ratio/></ratios>", "the file contains gears or chains"),
        ('<Link id="1"', '<Link id="1" actuator="true"', "link line 10: actuators are not read"),
        ('x="80"', 'x="nan"', "line 5: x = 'nan'"),
        ('<connector id="12"/><', '<connector id="13"/><', "refers to the unknown connector '13'"),
        ("<linkage2>", "<svg><linkage2>", "cannot read the model"),
    ],
)
def test_a_file_of_linkage_that_is_not_read_is_one_line(old, new, said):
    """Contract: the error names what came."""
    with pytest.raises(sd.InputError, match=said):
        sd.read_linkage2(FOUR_BAR.replace(old, new, 1))


def test_inputs_of_linkage_that_are_left_out_are_named():
    """Contract: an input without a constant speed is not a drive."""
    for more, said in (('alwaysmanual="true"', "it is operated by hand"), ('limitangle="90"', "it turns to and fro")):
        found = sd.read_linkage2(FOUR_BAR.replace('rpm="30"', f'rpm="30" {more}'))
        assert f"the input at 'pin 7' is left out: {said}" in found.notes
        assert not found.mechanism.drives
