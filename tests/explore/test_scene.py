"""What the explorer's canvas gets of a run, beside the functions that compute it."""

import base64
import json

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.explore.answers import contact_table
from scissordyn.laws.elastic.linear import Linear
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.model.linkage import slider_crank
from scissordyn.numeral import numeral
from scissordyn.plot.animation_scene import GAP
from scissordyn.plot.canvas import packed_scene

CLEARANCE, WIDTH = 1e-4, 0.02


def test_canvas_gets_the_channel_of_a_clearance_guide() -> None:
    """Closed form: a block that falls from the middle is between surfaces at 1.35 half widths, and touches the lower one."""
    linkage = slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    linkage = linkage.with_clearance("guide", GuideClearance(CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))
    run = sd.simulate(linkage, until=0.05, samples=201)
    (channel,) = json.loads(packed_scene(run, linkage))["channels"]
    assert channel["name"] == "guide"
    assert channel["joint"].startswith("guide/corner ")
    assert dict(channel["surfaces"]) == {1.0: pytest.approx(1.0 + GAP), -1.0: pytest.approx(-1.0 - GAP)}
    block = np.frombuffer(base64.b64decode(channel["block"]), np.float32).reshape(201, channel["count"], 2)
    touching = np.frombuffer(base64.b64decode(channel["touching"]), np.uint8).reshape(201, channel["count"])
    assert np.abs(block[0, :, 1]).max() == pytest.approx(1.0, rel=1e-6)
    assert np.all(block[touching.any(axis=1)][:, :, 1].min(axis=1) < -1.0)
    assert touching.any()
    assert not touching[0].any()


def test_short_contacts_have_digits_beside_long_ones() -> None:
    """Limit: of contacts of 0.4 ms and 2 s, both durations can be read from the table: three digits or more of each."""
    number = xr.Variable("contact", [0.0004, 2.0])
    names = ("contact_start", "approach_speed", "peak_force", "contact_duration", "rebound_speed")
    run = xr.Dataset({**dict.fromkeys(names, number), "contact_joint": ("contact", ["A", "A"])})
    columns = contact_table(run)["columns"]
    titles = {column["title"]: column["values"].tolist() for column in columns}
    places = next(column["places"] for column in columns if column["title"] == "duration [ms]")
    assert [numeral(value, places) for value in titles["duration [ms]"]] == ["0.400", "2000"]
    assert titles["duration [ms]"] == [0.4, 2000.0]
    assert "peak force [N]" in titles
