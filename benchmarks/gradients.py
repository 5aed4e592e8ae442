"""Gradients of runs: their cost beside the run itself and beside differences, and the picture of their limits.

``python -m benchmarks.gradients --write`` writes the page and draws docs/gradients.png; ``--quick`` takes one case.
"""

from __future__ import annotations

import math
import time as clocks
from pathlib import Path

import numpy as np

import scissordyn as sd
from benchmarks.measure import DECISIONS, command, paragraph, table
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

EXAMPLES = Path(__file__).parent.parent / "examples"

CASES = {
    ("slider_crank", "dop853"): (0.024, ("slider pin.clearance", "drive.speed", "slider pin.restitution", "body.rod.mass")),
    ("paper", "dop853"): (0.05, ("A.clearance", "drive.speed", "A.restitution", "body.slider.mass")),
    ("paper", "rodas5p"): (0.05, ("A.clearance", "drive.speed", "A.restitution", "body.slider.mass")),
    ("self_deploying", "rodas5p"): (0.02, ("unit 1/pivot.clearance", "gravity", "unit 1/pivot.restitution", "latch.angle")),
}
"""End of the run [s] by example and method, and four parameters, which are taken twice: the cost of eight is that of any."""

TOLERANCE = 1e-11

REPETITIONS = 7


def timed(name: str, method: str, until: float, paths: tuple[str, ...]) -> list[str]:
    """Return a row of the table: run, gradient and start of a case."""
    case = sd.read_case(EXAMPLES / f"{name}.toml")
    options = sd.Options(until, case.run.start, 2, TOLERANCE, TOLERANCE, method, events="located")
    tables, begin = plan(case.mechanism), Start(case.mechanism, case.run.start)
    seeds = [derivatives(begin, parameter_of(case.mechanism, path, 1.0)) for path in paths]

    def run() -> None:
        driver, _, _ = make_driver(tables, options)
        advance(driver, until)

    forward(tables, options, 2 * seeds)  # compiles
    ways = {
        "run": run,
        "eight": lambda: forward(tables, options, 2 * seeds),
        "starts": lambda: [derivatives(begin, parameter_of(case.mechanism, path, 1.0)) for path in 2 * paths],
    }
    least = dict.fromkeys(ways, math.inf)
    for _ in range(REPETITIONS):
        for name_of_way, way in ways.items():
            began = clocks.thread_time()
            way()
            least[name_of_way] = min(least[name_of_way], clocks.thread_time() - began)
    found = forward(tables, options, 2 * seeds)
    counts = found.driver.state.counts[0]
    return [
        name,
        method,
        str(int(counts["steps"])),
        str(int(counts["events"])),
        f"{1e3 * least['run']:.1f}",
        f"{least['eight'] / least['run']:.2f}",
        f"{least['starts'] / least['run']:.2f}",
        str(found.parts),
    ]


def journal(speed: float) -> sd.Mechanism:
    """Return a journal that is thrown up in its bearing."""
    ball = sd.Body("ball", mass=1.0, inertia=1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(0.0, speed))
    gap = sd.Clearance(0.01, journal_radius=0.02, friction=sd.NoFriction())
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=gap)
    return sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=9.81)


def draw() -> None:
    """Draw docs/gradients.png: a grazing contact with tangents, and the growth of derivatives in a run with many contacts."""
    from scissordyn.plot.file import figure_of
    from scissordyn.plot.style import BLUE, VERMILION, legend, panels

    left, right = drawn = panels(None, 1, 2, size=(9.0, 3.4), share=False)
    speeds = np.sort(np.append(np.linspace(0.40, 0.52, 61), 0.44295 + np.geomspace(1e-5, 2e-3, 8)))
    of, by = ["hole.first_contact"], ["body.ball.velocity.y"]
    results = [sd.gradient(journal(float(v)), of=of, by=by, until=0.15, start="as-placed") for v in speeds]
    instants = np.array([float(found["value"][0]) for found in results])
    slopes = np.array([float(found["derivative"][0, 0]) for found in results])
    apart = int(np.argmax(np.abs(np.diff(instants))))
    for part in (slice(None, apart + 1), slice(apart + 1, None)):
        left.plot(speeds[part], 1e3 * instants[part], color=BLUE)
    for k in (5, 15, apart + 4, apart + 10, apart + 25):
        reach = np.array([-0.006, 0.006])
        left.plot(speeds[k] + reach, 1e3 * (instants[k] + slopes[k] * reach), color=VERMILION, linewidth=1.0, label="tangents")
    left.set(xlabel="speed at the start [m/s]", ylabel="first contact [ms]", ylim=(20.0, 110.0))
    case = sd.read_case(EXAMPLES / "slider_crank.toml")
    options = sd.Options(0.024, case.run.start, 2, TOLERANCE, TOLERANCE, "dop853", events="located")
    seed = derivatives(Start(case.mechanism, case.run.start), parameter_of(case.mechanism, "slider pin.clearance", 1.0))
    found = forward(plan(case.mechanism), options, [seed])
    log = found.driver.log
    right.semilogy(1e3 * log["time"], 1e6 * np.abs(found.log[:, 0, 0]) * 1e-2, ".", color=BLUE)
    right.set(xlabel="instant of contact or separation [ms]", ylabel="its shift by 1 % of the clearance [µs]")
    legend([left])
    figure_of(drawn).savefig(DECISIONS.parent / "gradients.png", dpi=150, metadata={"Software": ""})


def measure(quick: bool) -> str:
    """Return the times of runs, of runs with eight derivatives, and of the derivatives of the start."""
    chosen = dict(list(CASES.items())[:1]) if quick else CASES
    rows = [timed(*case, *numbers) for case, numbers in chosen.items()]
    if not quick:
        draw()
    head = ("case", "method", "steps", "events", "run [ms]", "eight parameters", "their start", "rejected parts")
    return "\n".join(
        (
            paragraph(
                f"A run at rtol = atol = {TOLERANCE:g}, the same with its derivatives by eight parameters, and the",
                "derivatives of the start by them, in multiples of the run: least processor time of seven repetitions in turn.",
            ),
            "\n" + table(head, rows),
        )
    )


if __name__ == "__main__":
    command("gradients", measure)
