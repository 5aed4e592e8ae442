"""Ctrl-C inside a part of a larger computation ends the whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.run.advance.driver import next_slice
from scissordyn_paper import controlled, periodic, runs
from scissordyn_paper.cases import PaperCase

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"


def interrupted(*_: object, **__: object) -> xr.Dataset:
    """What a run returns that was stopped."""
    values = {"status": "interrupted", "cause": "stopped at t = 0 s of 1 s: interrupted"}
    return xr.Dataset({"value": ("value", np.zeros(1)), "status": ("value", ["pending"])}, attrs=values)


PARTS: dict[str, tuple[str, str, Callable[[Path], object]]] = {
    "the torque of the ideal mechanism": (
        "scissordyn.run.inverse_dynamics",
        "simulate",
        lambda _: sd.feed_forward(sd.scissor(units=1), sd.ConstantSpeed(1.0), until=0.1),
    ),
    "a run of the paper": ("scissordyn_paper.runs", "simulate", lambda _: runs.compute(PaperCase())),
    "a controlled run": (
        "scissordyn_paper.controlled",
        "simulate",
        lambda _: controlled.compute(controlled.CONTROLLED_RUNS[0]),
    ),
    "a periodic motion": ("scissordyn_paper.periodic", "cycle", lambda _: periodic.examine(periodic.EVERY[0])),
    "a diagram": ("scissordyn_paper.periodic", "bifurcation", lambda folder: periodic.fetch_diagram(folder / "diagram.nc")),
}


@pytest.mark.parametrize("part", PARTS)
def test_a_part_that_is_interrupted(part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: it is no failure of the part, after which the rest would go on."""
    module, name, whole = PARTS[part]
    monkeypatch.setattr(import_module(module), name, interrupted)
    with pytest.raises(KeyboardInterrupt):
        whole(tmp_path)


def test_the_paper_on_one_process_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Contract: the command says what is kept, and no other run is begun."""
    began = []

    def stopped(*given: object, **options: object) -> xr.Dataset:
        began.append(given)
        return interrupted()

    monkeypatch.setattr(runs, "simulate", stopped)
    assert status_of(["paper", "-o", str(tmp_path / "out"), "--threads", "1"]) == 130
    assert len(began) == 1
    assert "what is done is in" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("steps", "seconds", "most", "expected"),
    [(20, 0.01, 2000, 40), (20, 60.0, 2000, 1), (1000, 0.2, 2000, 500), (2000, 1e-6, 2000, 2000), (0, 0.0, 2000, 1)],
)
def test_slices_last_a_tenth_of_a_second(steps: int, seconds: float, most: int, expected: int) -> None:
    """Closed form: as many steps as fit into it, at most twice those of before, and at least one."""
    assert next_slice(steps, seconds, most) == expected


def test_slices_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: a run in slices of one step is bit for bit the run in large ones, with events, friction and cycles."""
    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.LuGre(0.1)))
    driven, swung = arm.driven(speed=sd.rpm(150)), arm.driven(sd.Harmonic(0.8, 0.2, 60.0))
    whole = [sd.simulate(driven, until=0.01, samples=51), sd.cycle(swung, cycles=2)]
    monkeypatch.setattr("scissordyn.run.advance.driver.next_slice", lambda *_: 1)
    monkeypatch.setattr("scissordyn.run.advance.driver.FIRST", 1)
    cut = [sd.simulate(driven, until=0.01, samples=51), sd.cycle(swung, cycles=2)]
    for one, other in zip(whole, cut, strict=True):
        assert one.equals(other)


def test_ctrl_c_while_the_ideal_mechanism_is_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: the run for which it is simulated has not begun, and does not begin after that."""
    from scissordyn.run.start import ideal_path

    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=1.0).track("tip", "slider", "centre")
    compute = ideal_path.compute
    monkeypatch.setattr(ideal_path, "compute", lambda *given, **named: replace(compute(*given, **named), status="interrupted"))
    with pytest.raises(KeyboardInterrupt):
        sd.simulate(arm, until=1e-3, samples=3)
