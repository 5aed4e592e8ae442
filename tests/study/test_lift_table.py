"""The shipped study of the lightest bars: its masses, what the chosen bars do, and what the next lighter ones miss."""

from __future__ import annotations

from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.config.file import read_case

CASE = Path(__file__).parents[2] / "examples" / "lift_table.toml"
LOOSER = ["run.rtol=1e-6", "run.atol=1e-6"]


def bars(material: str, section: str) -> list[str]:
    """Changes of the case."""
    return [f"structure.bars.material={material}", f"structure.bars.section={section}", *LOOSER]


def test_mass_is_density_times_area() -> None:
    """Closed form: four bars of a metre, and the 15 kg of table and slider."""
    chosen = read_case(CASE, bars("aluminium", "tube 80x80x2 mm")).mechanism
    area = 0.08**2 - 0.076**2
    assert sum(body.mass for body in chosen.bodies) == pytest.approx(15.0 + 4 * 2700.0 * area, rel=1e-12)


def test_sag_at_rest_is_that_of_other_beams() -> None:
    """Second formulation: chains of beam elements in place of modes, in static equilibrium."""
    sag = []
    for also in ([], ["structure.bars.modes=auto", "structure.bars.elements=4"]):
        case = read_case(CASE, [*bars("aluminium", "tube 80x80x2 mm"), *also])
        run = sd.simulate(case.mechanism, until=1e-6, samples=2, start="static")
        sag.append(float(run["track_deviation"].values[0, 0]))
    assert sag[0] == pytest.approx(sag[1], rel=2e-3)
    assert sag[0] == pytest.approx(4.55e-3, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("material", "section", "off", "stress"),
    [
        ("aluminium", "tube 80x80x2 mm", 16.45e-3, 0.261),
        ("titanium", "tube 80x80x1 mm", 19.59e-3, 0.143),
        ("steel", "tube 80x80x1 mm", 10.34e-3, 0.528),
    ],
)
def test_what_is_chosen_and_what_misses(material: str, section: str, off: float, stress: float) -> None:
    """The numbers of docs/study_results.md."""
    case = read_case(CASE, bars(material, section))
    run = sd.simulate(case.mechanism, **case.run.keywords)
    assert float(run["track_deviation"].max()) == pytest.approx(off, rel=2e-3)
    assert float(run["bar_largest_utilisation"].max()) == pytest.approx(stress, rel=5e-3)
