#!/usr/bin/env bash
# MuJoCo 3.3.7 (PyPI), 2026-11-29: a loop closed by <equality><connect> with default solref opens, and smaller steps do not close it.
#
# A planar four-bar of three bars of 1 kg (0.3, 0.51 and 0.4 m long) stands on two hinges and falls. The loop is closed by one `connect`.
# Seen: the two ends of the closure separate by 12.9, 14.0 and 14.3 mm with steps of 2, 0.5 and 0.1 ms. The default solref is a spring
# and damper with a time constant of 20 ms, whatever the step is. A solref of 1 ms with a step of 0.1 ms leaves 0.094 mm.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mujoco==3.3.7 numpy==2.3.5
cat > "$folder/fourbar.py" <<'PY'
import mujoco
import numpy as np

MODEL = """<mujoco><option timestep="{step}" integrator="implicitfast" gravity="0 0 -9.81"><flag contact="disable"/></option>
<worldbody>
  <body name="crank" pos="0 0 0"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="1"/>
    <body name="coupler" pos="0 0 0.3"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.5 0 0.1" size="0.01" mass="1"/>
      <site name="left" pos="0.5 0 0.1"/></body></body>
  <body name="rocker" pos="0.5 0 0"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.01" mass="1"/>
    <site name="right" pos="0 0 0.4"/></body>
</worldbody>
<equality><connect site1="left" site2="right"{solref}/></equality></mujoco>"""


def gap(step, solref=""):
    model = mujoco.MjModel.from_xml_string(MODEL.format(step=step, solref=solref))
    data, widest = mujoco.MjData(model), 0.0
    data.qvel[0] = 0.5
    for _ in range(round(1.0 / step)):
        mujoco.mj_step(model, data)
        widest = max(widest, float(np.linalg.norm(data.site("left").xpos - data.site("right").xpos)))
    return 1e3 * widest


default = [gap(step) for step in (2e-3, 5e-4, 1e-4)]
stiff = gap(1e-4, ' solref="0.001 1"')
print("largest gap [mm], default solref, steps of 2, 0.5 and 0.1 ms:", *(f"{value:.3f}" for value in default))
print(f"largest gap [mm], solref 1 ms, step of 0.1 ms: {stiff:.5f}")
assert min(default) > 0.1, "the loop closes now"
assert max(default) < 2.0 * min(default), "smaller steps close the loop now"
assert stiff < 0.02 * min(default), "a stiffer solref does not close the loop"
PY
"$folder/venv/bin/python" "$folder/fourbar.py"
