"""How many steps to take in one call of the loop, so that Ctrl-C is not kept waiting."""

from __future__ import annotations

FIRST = 200
"""Steps of the first call."""

LASTING = 0.1
"""How long a call should last [s]. Python looks at signals between two calls only."""


def next_slice(steps: int, seconds: float, most: int) -> int:
    """Steps of the next call; what is computed does not depend on them."""
    fitting = steps * LASTING / max(seconds, 1e-9)
    return max(1, min(int(fitting), 2 * steps, most))
