"""Motions of models by MuJoCo."""

import numpy as np
import pytest

import scissordyn as sd

mujoco = pytest.importorskip("mujoco")


def by_mujoco(text, until, samples, read, *, keyframe=True):
    """Return values that `read` takes from MuJoCo's data at equidistant times, from the first keyframe on if `keyframe`."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if keyframe:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    every, rows = round(until / model.opt.timestep / (samples - 1)), []
    for step in range(every * (samples - 1) + 1):
        if step % every == 0:
            mujoco.mj_kinematics(model, data)
            rows.append(np.copy(read(data)))
        mujoco.mj_step(model, data)
    return np.array(rows)


def centres(data):
    """Return the mass centres of the bodies in the plane of x and z."""
    return np.asarray(data.xipos[1:, [0, 2]])


def followed(text):
    """Return the mass centres of a model in the plane of x and z over 0.5 s, by this package and by MuJoCo."""
    run = sd.simulate(sd.read_mjcf(text).mechanism, until=0.5, samples=6, rtol=1e-10, atol=1e-12)
    return run["position"].values, by_mujoco(text, 0.5, 6, centres)
