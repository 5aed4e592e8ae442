"""Oil in the joints of bars that bend: energy, the limit of rigid bars, and which integrator is chosen."""

import json
from typing import Any

import numpy as np
import pytest

import scissordyn as sd

TUBE = 42743.0, 7.5e7  # EI [N m^2] and EA [N]


def array(viscosity: float = 0.1, stiffness: float | None = 1.0, clearance: float = 4e-4, **how: Any) -> sd.Mechanism:
    """The array of the paper with oil in joint A; its bars are tubes, so many times as stiff."""
    made = sd.scissor(units=2)
    oiled = sd.Clearance(clearance, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=viscosity))
    made = made.with_clearance("A", oiled)
    if stiffness is not None:
        rigidity, axial = (stiffness * each for each in TUBE)
        made = made.with_bending(bending_stiffness=rigidity, axial_stiffness=axial, **how)
    return made.driven(speed=sd.rpm(150))


@pytest.mark.parametrize("how", [{"modes": 4}, {"elements": 2}])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_film_on_bars_that_bend_keeps_the_balance_of_energy(method: str, how: dict[str, int]) -> None:
    """Identity: to 1e-8 of the change of kinetic energy, with both formulations and integrators, down to a thin film."""
    run = sd.simulate(array(**how), until=4e-3, samples=41, method=method, rtol=1e-9)
    assert run.attrs["status"] == "complete"
    assert float(run["film_least_thickness"].min()) < 0.2 * 4e-4
    assert float(run["film_power_lost"].max()) > 1.0
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(np.ptp(run["kinetic_energy"].values))


def test_stiff_bars_with_a_film_tend_to_rigid_ones() -> None:
    """Limit: the largest deviation of the journal over a millisecond as 1/EI tends to zero, of the first order."""
    length, apart = 1e-3, []
    rigid = sd.simulate(array(stiffness=None), until=length, samples=41)["eccentricity"].sel(joint="A").values
    for factor in (1e5, 1e6):
        run = sd.simulate(array(stiffness=factor, modes=2), until=length, samples=41, method="rodas5p")
        apart.append(float(np.abs(run["eccentricity"].sel(joint="A").values - rigid).max()))
    assert apart[0] < 0.01 * 4e-4
    assert 7.0 < apart[0] / apart[1] < 13.0


def test_thick_oil_is_integrated_by_the_stiff_method() -> None:
    """Contract: by the damping of the film where it is thin; thin oil and dry joints of bars that bend are not stiff."""
    runs = [sd.simulate(array(oil, modes=4), until=1e-6, samples=2) for oil in (0.1, 0.001)]
    assert [json.loads(run.attrs["statistics"])["method"] for run in runs] == ["rodas5p", "dop853"]
