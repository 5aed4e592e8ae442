"""Measures of bars that bend, in batches and studies."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.errors import InputError
from scissordyn.run.options import Options

NAMES = {"peak_bar_stress": "stress", "peak_utilisation": "utilisation", "peak_deflection": "deflection"}
OVER = {"A.clearance": [0.1e-3, 0.4e-3]}


def rigid() -> sd.Mechanism:
    """A scissor with a clearance joint."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(60))


def bent(**more: Any) -> sd.Mechanism:
    """The same of steel tubes."""
    return rigid().with_bending(**({"section": "tube 60x60x1.56 mm", "material": "steel", "modes": 1} | more))


def test_they_are_those_of_a_run() -> None:
    """Cross-check: run, summary and a second road to the stress, from axial force and moment along the bars."""
    batch = sd.simulate_many(bent(), OVER, until=0.01, measures=tuple(NAMES))
    run = sd.simulate(bent().replace("A.clearance", 0.4e-3), until=0.01)
    last = batch.isel(case=1)
    for name, quantity in NAMES.items():
        np.testing.assert_array_equal(last[name].values, np.abs(run[f"bar_largest_{quantity}"].values))
    assert len(np.unique(batch["peak_bar_stress"].values)) == batch["peak_bar_stress"].size == 8
    answer = run.scissordyn.summary().bars
    assert answer.utilisation == float(last["peak_utilisation"].max())
    depth, area = 60e-3, (60e-3**2 - 56.88e-3**2)
    second_moment = (60e-3**4 - 56.88e-3**4) / 12.0
    inner = sd.internal_forces(run, places=9)
    stress = np.abs(inner["axial_force"]) / area + np.abs(inner["bending_moment"]) * 0.5 * depth / second_moment
    assert stress.max(dim=("time", "place")).values == pytest.approx(last["peak_bar_stress"].values, rel=1e-6)


@pytest.mark.parametrize(
    ("mechanism", "measure", "said"),
    [
        (rigid(), "peak_deflection", "without bars that bend"),
        (bent(section=None, material=None, bending_stiffness=4e4, axial_stiffness=7e7), "peak_bar_stress", "youngs_modulus"),
    ],
)
def test_what_has_none_is_refused(mechanism: sd.Mechanism, measure: str, said: str) -> None:
    """Errors: no bars that bend; no material."""
    with pytest.raises(InputError, match=said):
        sd.simulate_many(mechanism, OVER, until=0.01, measures=(measure,))
    with pytest.raises(InputError, match="members"):
        sd.simulate_many(bent(), OVER, until=1e-3, measures=("peak_deflection",), members=[0, 1])


def test_a_study_asks_for_utilisation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Cross-check: a requirement between the utilisations of two clearances is met by one of them, as runs say."""
    case, store = tmp_path / "bent.toml", tmp_path / "bent.zarr"
    sd.write_case(bent(), case, run=Options(until=0.01))
    used = sd.simulate_many(bent(), OVER, until=0.01, measures=("peak_utilisation",))["peak_utilisation"].max("bar").values
    between = float(np.mean(used))
    text = f'case = "bent.toml"\nmeasures = ["peak_bar_stress"]\nrequire = ["peak_utilisation < {between:.6f}"]\n'
    asked = tmp_path / "study.toml"
    asked.write_text(text + '[vary]\n"A.clearance" = "0.1, 0.4 mm"\n', encoding="utf-8")
    assert status_of(["study", str(asked), "-o", str(store), "--threads", "1"]) == 0, capsys.readouterr().err
    found = sd.open_study(store).dataset
    np.testing.assert_array_equal(found["peak_utilisation"].max("bar").values, used)
    assert "peak_utilisation" in capsys.readouterr().out
