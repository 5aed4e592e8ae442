"""Warnings about laws outside their range of validity."""

import math
from dataclasses import replace

import pytest
from bouncing import JOINT

import scissordyn as sd
from scissordyn.laws.catalogue import DAMPING, ELASTIC, MATERIALS
from scissordyn.laws.validity import contact_failure, contact_warnings


def warnings(stiffness="liu", damping="exact", joint=JOINT, speed=0.01, indentation=1e-6):
    laws = ELASTIC[stiffness](), DAMPING[damping]()
    return texts("A", joint, *laws, approach_speed=[speed], indentation=indentation)


def texts(*given, **named):
    return [str(warning) for warning in contact_warnings(*given, **named)]


def test_nothing_to_say():
    """Contract: a slow, shallow contact of steel gives no warning."""
    assert warnings() == []


def test_fast_contacts():
    """Closed form: the speed limit of steel is 1e-5 sqrt(E/rho) = 0.0515 m/s; of two materials the slower one counts."""
    assert warnings(speed=0.0515) == []
    (text,) = warnings(speed=0.0516)
    assert "joint 'A': 1 of 1 contacts start faster than 0.052 m/s" in text
    ptfe = replace(JOINT, bearing=MATERIALS["ptfe"])
    assert "0.0048 m/s" in warnings(joint=ptfe)[0]


@pytest.mark.parametrize(("stiffness", "count"), [("hertz", 1), ("johnson", 1), ("liu", 0), ("persson", 0)])
def test_deep_contacts(stiffness, count):
    """Contract: a fifth of the clearance is too deep for laws of small contacts, not for conformal ones."""
    assert warnings(stiffness, indentation=0.199 * JOINT.clearance) == []
    assert len(warnings(stiffness, indentation=0.201 * JOINT.clearance)) == count


def test_as_printed():
    """Contract: a law with inconsistent units is warned of."""
    assert "as printed" in warnings("bai-zhao-as-printed")[0]


def test_materials():
    """Contract: laws for one material, and laws for steel, are warned of with other materials."""
    mixed = replace(JOINT, bearing=MATERIALS["bronze"])
    assert "one material" in warnings("persson", joint=mixed)[0]
    assert "steel" in warnings("braendlein", joint=mixed)[0]
    assert warnings("braendlein") == []


def test_returned_restitution():
    """Published number: lankarani-nikravesh returns 0.725 for c_e = 0.5; flores returns 0.470, close enough for no warning."""
    law = DAMPING["lankarani-nikravesh"](restitution=0.5)
    (text,) = texts("A", JOINT, ELASTIC["liu"](), law, approach_speed=[], indentation=0.0)
    assert "0.725 for 0.5" in text
    assert (
        contact_warnings("A", JOINT, ELASTIC["liu"](), DAMPING["flores"](restitution=0.5), approach_speed=[], indentation=0)
        == []
    )


def test_claimed_range():
    """Contract: a restitution outside the range that a law's source claims is warned of."""

    class Narrow(DAMPING["exact"]):
        restitution_range = (0.7, 1.0)

    (text,) = texts("A", JOINT, ELASTIC["liu"](), Narrow(0.5), approach_speed=[], indentation=0.0)
    assert "0.7 to 1, not 0.5" in text


def test_indentation_beyond_the_journal_radius():
    """Contract: an indentation beyond the journal's radius, corner radius or gap fails the run; the cause names the joint."""
    assert contact_failure("A", JOINT, JOINT.journal_radius) == ""
    text = contact_failure("A", JOINT, 1.01 * JOINT.journal_radius)
    assert text.startswith("joint 'A': indentation 9.595 mm exceeds the journal radius of 9.5 mm")
    corner = replace(JOINT, clearance=math.inf, journal_radius=2e-3)
    assert "exceeds the corner radius of 2 mm" in contact_failure("block/1", corner, 2.1e-3)
    sharp = replace(corner, journal_radius=1e-9, gap=1e-4)
    assert contact_failure("block/1", sharp, 1e-4) == ""
    assert "exceeds the gap of 0.1 mm" in contact_failure("block/1", sharp, 1.1e-4)


@pytest.mark.parametrize(("stiffness", "share"), [("johnson", 0.527), ("persson", 6.0)])
def test_continued_laws(stiffness, share):
    """Contract: an indentation in the tangent continuation of a law is warned of."""
    words = "is continued along its tangent"
    assert not any(words in text for text in warnings(stiffness, indentation=0.99 * share * JOINT.clearance))
    (text,) = [text for text in warnings(stiffness, indentation=1.01 * share * JOINT.clearance) if words in text]
    assert f"'{stiffness}' describes up to {1e3 * share * JOINT.clearance:.2g}" in text


def test_doubts_about_users_laws_are_warnings():
    """Contract: doubts about each kind of user-defined law become warnings with the joint's name."""
    flat = sd.element(slot="stiffness")(lambda indentation: 1e9 * min(indentation, 1e-4))()
    gaining = sd.element(slot="damping")(lambda elastic: 0.5 * elastic)()
    viscous = sd.element(slot="friction")(lambda slip_speed: slip_speed)()
    found = texts("A", JOINT, flat, gaining, viscous, approach_speed=[], indentation=0.0)
    assert [text.split(": ")[:2] for text in found] == [
        ["joint 'A'", f"{kind} law"] for kind in ("stiffness", "damping", "friction")
    ]
