"""Derivatives of one compliant contact beside those of diffrax, both against the closed form.

``python -m benchmarks.gradient_engines --write`` writes the page; diffrax and jax must be installed
(``pip install diffrax jax``), else only the package is measured.
"""

from __future__ import annotations

import time as clocks
from collections.abc import Callable
from typing import Any

import numpy as np

import scissordyn as sd
from benchmarks.measure import command, paragraph, table
from scissordyn.laws.damping.factors import HuntCrossley
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

SPEED, CLEARANCE, STIFFNESS, END = 0.5, 1e-3, 1e9, 3.5e-3  # [m/s], [m], [N/m^1.5], [s]
SLOPE = 0.459202543812  # Exact derivative of the restitution coefficient by the parameter of Hunt and Crossley's law at 0.5
REPETITIONS = 50

PATHS = ("hole.damping.restitution", "hole.stiffness.coefficient", "body.ball.mass", "hole.clearance")
"""Parameters: those of the damping and elastic laws, the mass and the clearance, by which the restitution does not change."""


def least_time(function: Callable[[], object]) -> float:
    """Return the least processor time of several calls [s]."""
    times = []
    for _ in range(REPETITIONS):
        began = clocks.process_time()
        function()
        times.append(clocks.process_time() - began)
    return min(times)


def row(name: str, tolerance: float, steps: int, slopes: np.ndarray, value: float, gradient: float) -> list[str]:
    """Return a row of the table; `slopes` are the derivatives of the restitution coefficient by parameter / scale."""
    others = float(np.max(np.abs(slopes[1:])))
    errors = f"{abs(slopes[0] / (0.5 * SLOPE) - 1.0):.0e}", f"{others:.0e}"
    return [name, f"{tolerance:g}", str(steps), *errors, f"{1e3 * value:.2f}", f"{1e3 * gradient:.2f}"]


def package(tolerance: float) -> list[str]:
    """Return the row of this package."""
    ball = sd.Body("ball", 1.0, 1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(SPEED, 0.0))
    law = {"stiffness": PowerLaw(STIFFNESS, 1.5), "damping": HuntCrossley(0.5), "friction": sd.NoFriction()}
    gap = sd.Clearance(CLEARANCE, journal_radius=0.01, reference="onset", **law)
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), gap)
    mechanism = sd.Mechanism((ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)
    options = sd.Options(END, "as-placed", 2, tolerance, tolerance, "dop853", events="located")
    tables, begin = plan(mechanism), Start(mechanism, "as-placed")
    seeds = [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in PATHS]

    def run() -> None:
        driver, _, _ = make_driver(tables, options)
        advance(driver, END)

    found = forward(tables, options, seeds)
    slopes = -found.log[-1, 3] / SPEED
    steps = int(found.driver.state.counts["steps"][0])
    return row("scissordyn", tolerance, steps, slopes, least_time(run), least_time(lambda: forward(tables, options, seeds)))


def diffrax_row(tolerance: float) -> list[str]:
    """Return the row of diffrax: its event at the onset, then a second solution that keeps the approach speed."""
    import diffrax as dx
    import jax
    import jax.numpy as jnp
    import optimistix

    jax.config.update("jax_enable_x64", True)

    def rates(_: Any, y: Any, numbers: Any) -> Any:
        restitution, stiffness, mass, clearance, approach = numbers
        depth = jnp.maximum(y[0] - clearance, 0.0)
        elastic = stiffness * jnp.where(depth > 0.0, depth, 1.0) ** 1.5 * (depth > 0.0)
        return jnp.array([y[1], -elastic * (1.0 + 1.5 * (1.0 - restitution) * y[1] / approach) / mass])

    control = dx.PIDController(rtol=tolerance, atol=tolerance * CLEARANCE)
    ways = {"stepsize_controller": control, "max_steps": 100_000, "adjoint": dx.ForwardMode()}
    onset = dx.Event(lambda t, y, args, **_: y[0] - args[3], optimistix.Newton(1e-13, 1e-13))

    def rebound(p: Any) -> Any:
        start = jnp.array([0.0, SPEED])
        first = dx.diffeqsolve(dx.ODETerm(rates), dx.Dopri8(), 0.0, END, 1e-5, start, args=(*p, SPEED), event=onset, **ways)
        touch = first.ys[0]
        last = dx.diffeqsolve(dx.ODETerm(rates), dx.Dopri8(), first.ts[0], END, 1e-7, touch, args=(*p, touch[1]), **ways)
        return -last.ys[0, 1] / SPEED, first.stats["num_steps"] + last.stats["num_steps"]

    p = jnp.array([0.5, STIFFNESS, 1.0, CLEARANCE])
    value, gradient = jax.jit(rebound), jax.jit(jax.jacfwd(lambda p: rebound(p)[0]))
    slopes, (_, steps) = np.array(gradient(p) * p), value(p)
    times = least_time(lambda: jax.block_until_ready(value(p))), least_time(lambda: jax.block_until_ready(gradient(p)))
    return row("diffrax", tolerance, int(steps), slopes, *times)


def measure(quick: bool) -> str:
    """Errors and times of derivatives of the restitution coefficient of one contact."""
    rows = [package(tolerance) for tolerance in (1e-8, 1e-11)]
    try:
        import diffrax

        note = f"diffrax {diffrax.__version__} after compilation by jax, Dopri8."
        rows += [diffrax_row(tolerance) for tolerance in (1e-8, 1e-11)]
    except ImportError:
        note = "diffrax is not installed."
    text = paragraph(
        "A journal (1 kg) flies at 0.5 m/s through a clearance of 1 mm: F = K d^1.5 (1 + 3 (1 - c)/2 d'/d0), K = 1e9, c = 0.5.",
        "Errors of derivatives of the restitution coefficient: by c, relative to the closed form; by K, mass and clearance,",
        "where the exact one is zero, per relative change. Times of a run, and of a run with derivatives by four parameters",
        "(eight are computed in one pass), in milliseconds of processor time: the least of fifty. The package also sets up the",
        "run each time.",
        note,
    )
    head = ("engine", "tolerance", "steps", "by c", "by K, m, clearance", "run [ms]", "with derivatives [ms]")
    return text + "\n\n" + table(head, rows)


if __name__ == "__main__":
    command("gradient_engines", measure)
