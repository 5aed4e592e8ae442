"""Studies with derivatives beside studies without: errors of the surface of a response at further points.

``python -m benchmarks.gradient_studies --write`` writes the page and its picture, in a minute.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import scissordyn as sd
from benchmarks.measure import DECISIONS, command, paragraph, table
from scissordyn.studies.answer.surface import Surface
from scissordyn.studies.ask.design import Design, design_values
from scissordyn.studies.ask.distribution import Interval

EXAMPLES = Path(__file__).parent.parent / "examples"

RANGES: Mapping[str, tuple[float, float]] = {"A.clearance": (3e-4, 5e-4), "drive.speed": (sd.rpm(110), sd.rpm(150))}
UNTIL = 6e-3  # End of the runs [s]: the second contact has passed, which has the largest force
RESPONSES = ("A.peak_force", "peak_drive_torque", "damping_loss")

COUNTS = (4, 6, 8, 12, 16, 24, 32, 48, 64)  # [points] studies, the first points of one Sobol sequence
FURTHER = 256  # [points] number at which the surfaces are compared with runs

Curve = tuple[list[float], list[float]]  # Errors by number of points, without and with derivatives


def errors(x: np.ndarray, y: np.ndarray, slopes: np.ndarray, new: np.ndarray, true: np.ndarray, counts: Any) -> Curve:
    """Return root mean square errors of surfaces at further points, relative to the mean response."""
    found: Curve = ([], [])
    for count in counts:
        for errors_of, known in zip(found, (None, slopes[:count]), strict=True):
            surface = Surface(x[:count], y[:count], np.zeros(x.shape[1], bool), known)
            errors_of.append(float(np.sqrt(np.mean((surface.predict(new)[0] - true) ** 2)) / np.mean(np.abs(true))))
    return found


def known_function(counts: Any) -> Curve:
    """Return the errors for sin(2 x) cos(3 y) + x, with exact derivatives."""

    def value(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(2.0 * x[:, 0]) * np.cos(3.0 * x[:, 1]) + x[:, 0])

    square = [Interval(0.0, 1.0)] * 2
    x, new = (
        design_values(Design("sobol", n, s), square, np.zeros(0), np.arange(n)) for n, s in ((max(counts), 1), (FURTHER, 9))
    )
    across = 2.0 * np.cos(2.0 * x[:, 0]) * np.cos(3.0 * x[:, 1]) + 1.0
    slopes = np.stack([across, -3.0 * np.sin(2.0 * x[:, 0]) * np.sin(3.0 * x[:, 1])], axis=1)
    return errors(x, value(x), slopes, new, value(new), counts)


def array(counts: Any) -> tuple[dict[str, Curve], float]:
    """Return the errors for the paper's array, and the time of a case with derivatives over that of one without."""
    mechanism, seconds = sd.read_case(EXAMPLES / "paper.toml").mechanism, []

    def run(points: int, seed: int, *, gradients: bool) -> Any:
        began = time.process_time()
        options = {"until": UNTIL, "measures": list(RESPONSES), "engine": 1, "block": points}
        found = sd.study(mechanism, dict(RANGES), points=points, seed=seed, gradients=gradients, **options)  # type: ignore[arg-type]
        seconds.append((time.process_time() - began) / points)
        return found.points

    run(2, 1, gradients=True)  # compiles the kernels
    further, first = run(FURTHER, 9, gradients=False), run(max(counts), 1, gradients=True)
    x, new = (np.stack([points[name].values for name in RANGES], axis=1) for points in (first, further))
    curves = {}
    for name in RESPONSES:
        slopes = first["derivative"].sel(derivative_of=name).values
        curves[name] = errors(x, first[name].values, slopes, new, further[name].values, counts)
    return curves, seconds[2] / seconds[1]


def points_needed(curve: Curve, counts: Any, place: int) -> str:
    """Return the number of points without derivatives whose error is as small as with them at one place."""
    enough = [count for count, error in zip(counts, curve[0], strict=True) if error <= curve[1][place]]
    return str(enough[0]) if enough else f"over {counts[-1]}"


def measure(quick: bool) -> str:
    """Surfaces with and without derivatives: a table of errors, and the number of points that derivatives replace."""
    counts = COUNTS[:5] if quick else COUNTS
    by_name: dict[str, Curve] = {"known function": known_function(counts)}
    of_array, ratio = array(counts)
    by_name |= of_array
    rows = [
        [name, str(count), f"{without:.1e}", f"{given:.1e}", points_needed(curve, counts, place)]
        for name, curve in by_name.items()
        for place, (count, without, given) in enumerate(zip(counts, *curve, strict=True))
    ]
    if not quick:
        draw(by_name, counts, DECISIONS / "measured" / "gradient_studies.png")
    text = paragraph(
        f"Root mean square error of the surface of a response at {FURTHER} further points, relative to its mean. The known",
        "function is sin(2 x) cos(3 y) + x in a unit square. The others are responses of the paper's array, with LuGre",
        "friction,",
        "over the clearance of joint A from 0.3 to 0.5 mm and the speed of the drive from 110 to 150 rpm, in",
        f"{1e3 * UNTIL:g} ms.",
        "The last column is the number of points without derivatives from which on the error is as small as with them.",
        f"A case with derivatives by two numbers took {ratio:.0f} times the processor time of a case without: in runs as short",
        "as these the start and its derivatives take most of it.",
    )
    head = ("response", "points", "values alone", "with derivatives", "points for the same error")
    return f"{text}\n\n{table(head, rows)}"


def draw(by_name: Mapping[str, Curve], counts: Any, path: Path) -> None:
    """Draw the errors over the number of points."""
    figure, axes = plt.subplots(1, len(by_name), figsize=(11.0, 3.2), sharey=True, layout="constrained")
    for ax, (name, curve) in zip(axes, by_name.items(), strict=True):
        for values, label, marker in zip(curve, ("values alone", "with derivatives"), "os", strict=True):
            ax.loglog(counts, values, marker=marker, label=label)
        ax.set(title=name, xlabel="points", xticks=counts[::2], xticklabels=map(str, counts[::2]))
        ax.minorticks_off()
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("error at further points")
    axes[0].legend()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    command("gradient_studies", measure)
