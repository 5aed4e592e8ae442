"""Search 3000 runs for journals outside their bearings without contact; there may be none at any sample or step end."""

from __future__ import annotations

import dataclasses

import numpy as np

import scissordyn as sd
from benchmarks import horizon_cases
from benchmarks.horizon_cases import KINDS
from benchmarks.kept import Kept
from benchmarks.measure import command, table
from scissordyn.laws.damping.none import NoDamping
from scissordyn.mechanics import functions
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.trajectory import compute

__all__ = ["Judged", "judge", "measure"]

CASES = 250  # Number of cases of each kind

SAMPLES = 5001

SEEN = 1e-6  # Fraction of the clearance beyond which a journal counts as outside

RELEASED = "two joints, released from rest"


@dataclasses.dataclass(frozen=True)
class Judged:
    """Largest distance of a journal, or a corner of a guide with clearance, outside its bearing without contact.

    Parameters
    ----------
    kind : str
    number : int
    rtol : float
    events : str
    method : str
    end : float
        End of the run [s].
    contacts : int
        Number of contact onsets.
    sample, step : float
        Largest distance outside at a sample and at a step end, as fractions of the clearance.
    when : float
        Instant of the larger of them [s].
    """

    kind: str
    number: int
    rtol: float
    events: str
    method: str
    end: float
    contacts: int
    sample: float
    step: float
    when: float


def released(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    """Return a falling array of two units with two clearance joints."""
    array = sd.scissor(units=2, angle=float(np.radians(random.uniform(20.0, 70.0))))
    law = NoDamping() if random.random() < 0.7 else sd.Flores(restitution=0.99)
    for name in random.permutation([joint.name for joint in array.joints])[:2]:
        array = array.with_clearance(str(name), sd.Clearance(float(random.uniform(5e-5, 5e-4)), damping=law))
    return array, 0.1


def judge(kind: str, number: int) -> Judged:
    """Simulate a case at a tolerance between 1e-9 and 1e-5; even cases locate contacts, odd ones step across them."""
    makers = {**KINDS, RELEASED: released}
    random = np.random.default_rng([11, list(makers).index(kind), number])
    mechanism, until = makers[kind](random)
    rtol, events = float(10.0 ** random.uniform(-9.0, -5.0)), ("located", "crossed")[number % 2]
    options = Options(until, samples=SAMPLES, rtol=rtol, atol=rtol, events=events)  # type: ignore[arg-type]
    path = compute(plan(mechanism), options, record_steps=True)
    samples, steps = path.samples, path.steps
    sample, sampled = outside(path, samples.time, samples.state, samples.mode)
    step, stepped = outside(path, *ends(*steps))
    contacts = path.system.content.parameters.contact.size
    begun = int(np.sum((path.log["guard"] < contacts) & (path.log["mode"] == 1)))
    method, when = str(path.statistics["method"]), sampled if sample >= step else stepped
    return Judged(kind, number, rtol, events, method, path.end, begun, sample, step, when)


def ends(times: np.ndarray, states: np.ndarray, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends of steps with the modes of the next steps, since ends are recorded before their events."""
    return times, states, np.maximum(modes, np.concatenate([modes[1:], modes[-1:]]))


def outside(path: Trajectory, times: np.ndarray, states: np.ndarray, modes: np.ndarray) -> tuple[float, float]:
    """Return the largest penetration of a contact that counts as open, as a fraction of its clearance, and its time [s]."""
    content = path.system.content
    clearance = content.parameters.contact["clearance"]
    values, rates, worst = np.zeros(modes.shape[1]), np.zeros(modes.shape[1]), (0.0, 0.0)
    if not clearance.size:
        return worst
    for time, state, mode in zip(times, states, modes, strict=True):
        if not np.all(np.isfinite(state)):
            break
        functions.guards(time, state, path.system.address, values, rates)
        depth = float(np.max(np.where(mode[: clearance.size] == 0, values[: clearance.size] / clearance, 0.0)))
        worst = max(worst, (depth, float(time)))
    return worst


def measure(quick: bool = False) -> str:
    """Return the page of all kinds; an interrupted measurement continues."""
    kept, numbers = Kept("missed_contacts", Judged, __file__, horizon_cases.__file__), range(2 if quick else CASES)
    return _page(kept.complete(((kind, number) for number in numbers for kind in [*KINDS, RELEASED]), lambda key: judge(*key)))


def _page(judged: list[Judged]) -> str:
    rows = []
    for kind in [*KINDS, RELEASED, "all"]:
        ours = [each for each in judged if kind in (each.kind, "all")]
        missed = sum(max(each.sample, each.step) > SEEN for each in ours)
        deepest = max(max(each.sample, each.step) for each in ours)
        rows.append([kind, str(len(ours)), str(sum(each.contacts for each in ours)), str(missed), f"{deepest:.1e}"])
    worst = [each for each in judged if max(each.sample, each.step) > SEEN]
    lines = [
        f"- {each.kind}, number {each.number}, {each.events}, {each.rtol:.2g}, {each.method}: "
        f"{max(each.sample, each.step):.2g} at {each.when:.6g} s"
        for each in worst
    ]
    return "\n".join(
        [
            f"{len(judged)} runs (`benchmarks/missed_contacts.py`) at tolerances from 1e-9 to 1e-5, steps ending on contacts",
            f"and going across them in turn. Outside: at one of {SAMPLES} samples or at the end of a step a joint that counts",
            f"as open is closed by more than {SEEN:g} of its clearance.",
            "",
            table(["kind", "runs", "contacts", "runs with a joint outside", "farthest, of the clearance"], rows),
            *(["", *lines] if lines else []),
        ]
    )


if __name__ == "__main__":
    command("missed_contacts", measure)
