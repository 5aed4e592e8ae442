"""Oils: the viscosity index compared with worked examples, and grades with their definition."""

import pytest

import scissordyn as sd
from scissordyn.laws.oil import OILS, hot_viscosity, viscosity_index


@pytest.mark.parametrize(("cold", "hot", "index"), [(73.30, 8.86, 92.43), (22.83, 5.05, 156.37)])
def test_viscosity_index_of_worked_examples(cold, hot, index):
    """Published numbers: examples of ASTM D2270 for both of its procedures (their references are read from tables)."""
    assert viscosity_index(cold, hot) == pytest.approx(index, abs=0.1)
    assert hot_viscosity(cold, index) == pytest.approx(hot, rel=5e-4)


def test_viscosity_index_is_continuous():
    """Identity: parabolas of neighbouring ranges meet within the tables' rounding; the index grows with the viscosity."""
    for edge in (3.8, 4.4, 5.0, 6.4, 7.0, 7.7, 9.0, 12.0, 15.0, 18.0, 22.0, 28.0, 40.0, 55.0, 70.0):
        cold = 8.0 * edge
        assert viscosity_index(cold, edge) == pytest.approx(viscosity_index(cold, edge * (1.0 + 1e-12)), abs=0.5)
    assert viscosity_index(46.0, 6.5) < viscosity_index(46.0, 7.0) < viscosity_index(46.0, 9.0)


def test_grades_follow_their_definition():
    """Published numbers: the viscosity at 40 deg C is within 10 % of the grade (ISO 3448); the index is 95 unless stated."""
    for name, oil in OILS.items():
        grade = float(name.removeprefix("ISO VG "))
        assert 1e6 * oil.viscosity_40 == pytest.approx(grade, rel=0.1)
        assert oil.viscosity(313.15) == pytest.approx(oil.density * oil.viscosity_40, rel=1e-12)
        if "index 95" in oil.source:
            assert viscosity_index(1e6 * oil.viscosity_40, 1e6 * oil.viscosity_100) == pytest.approx(95.0, abs=0.1)


def test_oil_of_a_viscosity_index():
    """Contract: the oil has the given index; one that would be too thin when hot is refused."""
    made = sd.Oil.of_index("synthetic", 46e-6, 140.0, density=830.0)
    assert viscosity_index(46.0, 1e6 * made.viscosity_100) == pytest.approx(140.0, abs=1e-6)
    assert made.density == 830.0
    with pytest.raises(sd.InputError, match="viscosity index -500"):
        sd.Oil.of_index("thin", 5e-6, -500.0)
