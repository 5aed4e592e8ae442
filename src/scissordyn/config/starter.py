"""Values of the printed case files where the defaults of the declarations do not give a complete mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

STARTERS: Mapping[str, Mapping[str, Any]] = {
    "scissor": {"structure": {"angle": "60 deg"}, "drive": {"speed": "-150 rpm"}},
    "polar": {"drive": {"speed": "30 rpm"}},
    "ring": {"drive": {"speed": "-20 rpm"}, "clearance": {"joint": "unit 1/*", "clearance": "0.1 mm"}},
    "mast": {"drive": {"speed": "20 rpm"}, "clearance": {"joint": "unit 1/*", "clearance": "0.1 mm"}},
    "slider-crank": {"drive": {"speed": "5000 rpm"}, "clearance": {"joint": "slider pin"}, "run": {"until": "12 ms"}},
    "four-bar": {"drive": {"speed": "300 rpm"}, "clearance": {"joint": "rocker pin", "clearance": "0.2 mm"}},
    "n-four-bar": {"clearance": {"joint": "B1 1", "clearance": "0.1 mm"}},
    "mechanism": {
        "structure": {"input_body": "crank", "output_body": "slider"},
        "ground": [{"name": "O", "position": "0, 0 m"}],
        "body": [
            {"name": "crank", "mass": "0.3 kg", "length": "50 mm", "position": "0, 0 m", "angle": "90 deg"},
            {"name": "rod", "mass": "0.2 kg", "length": "130 mm", "position": "0, 50 mm", "angle": "-22.619864948 deg"},
            {"name": "slider", "mass": "0.15 kg", "points": {"centre": "0, 0 m"}, "position": "120, 0 mm"},
        ],
        "joint": [
            {"name": "crank bearing", "journal": "crank.start", "bearing": "ground.O"},
            {"name": "crank pin", "journal": "crank.end", "bearing": "rod.start"},
            {"name": "slider pin", "journal": "rod.end", "bearing": "slider.centre"},
        ],
        "guide": [{"name": "guide", "follower": "slider.centre", "direction": "0 deg"}],
        "drive": {"speed": "300 rpm"},
        "clearance": {"joint": "slider pin", "clearance": "0.1 mm"},
    },
}
"""By structure: values of the keys of each section, a list of tables for the parts."""

TURNS: Mapping[str, float] = {
    kind: math.radians(degrees)
    for kind, degrees in {
        "scissor": -45.0,
        "polar": 8.0,
        "ring": -15.0,
        "mast": 30.0,
        "slider-crank": 90.0,
        "four-bar": 90.0,
        "n-four-bar": -45.0,
        "mechanism": -60.0,
    }.items()
}
"""By structure: how far its driven body turns in a move from rest to rest [rad]; arrays extend by it."""

AT_REST: Mapping[str, Mapping[str, Any]] = {"n-four-bar": {"speed": "0 m/s"}}
"""By structure: values of [structure] with which it starts at rest, if it does not by itself."""
