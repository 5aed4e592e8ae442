"""Runs of which only the motion is wanted."""

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import compute
from scissordyn.run.options import Options


def arrays() -> dict[str, sd.Mechanism]:
    """The paper's array with friction at one joint, falling under delayed feedback, and with clearance everywhere."""
    arm = sd.scissor(units=2)
    friction = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.1))
    driven = arm.driven(speed=sd.rpm(150))
    falling = arm.replace("gravity", 9.81).with_clearance("A", sd.Clearance(1e-4))
    fed_back = falling.controlled(sd.Pyragas(50.0, 0.002, onset=0.0))
    return {
        "friction": driven.with_clearance("A", friction),
        "delay": fed_back,
        "everywhere": driven.with_clearance("all", sd.Clearance(0.5e-3)),
    }


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p", "rodas4p"])
@pytest.mark.parametrize("name", ["friction", "delay", "everywhere"])
def test_the_motion_does_not_depend_on_it(name, method):
    """Identity: bit for bit the same samples, steps and instants of contact, with fewer evaluations and no energies."""
    options = Options(0.02, samples=101, method=method, rtol=1e-6, atol=1e-6)
    whole, motion = (compute(plan(arrays()[name]), options, monitor=on, record_steps=True) for on in (True, False))
    assert whole.status == "complete"
    assert whole.log.size > 1
    for part in ("time", "state", "mode", "memory", "reference"):
        np.testing.assert_array_equal(getattr(motion.samples, part), getattr(whole.samples, part), err_msg=part)
    for mine, other in zip(motion.steps, whole.steps, strict=True):
        np.testing.assert_array_equal(mine, other)
    for name in ("time", "guard", "mode", "rate", "angle"):
        np.testing.assert_array_equal(motion.log[name], whole.log[name])
    assert motion.statistics["steps"] == whole.statistics["steps"]
    assert motion.statistics["rates"] < whole.statistics["rates"]
    assert np.any(whole.samples.total)
    assert not np.any(motion.samples.total)
    assert not any(np.any(motion.peak[name]) for name in ("largest", "integral", "square", "friction_loss"))
