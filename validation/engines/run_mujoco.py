"""MuJoCo: a tree of hinges whose loops are closed by connections; the hole is a ring of boxes."""

import math
import re

import mujoco
import numpy as np
from shared import read, run

problem, setting = read()
careful = setting == "careful"
text = problem["mjcf"]
if not careful:  # the defaults of MuJoCo
    text = re.sub(r' (solref|solimp|timestep|integrator)="[^"]*"', "", text)
if "hole" in problem:
    hole, count = problem["hole"], 90
    size, thick = math.tan(math.pi / count) * (hole["radius"] + 2e-3), 2e-3
    boxes = ""
    for k in range(count):
        turn = 2.0 * math.pi * k / count
        place = f"{(hole['radius'] + thick) * math.cos(turn)} {(hole['radius'] + thick) * math.sin(turn)} 0"
        boxes += f'<geom type="box" size="{thick} {size} 0.005" pos="{place}" euler="0 0 {turn}"/>'
    zeta = -math.log(hole["restitution"]) / math.hypot(math.pi, math.log(hole["restitution"]))
    contact = f' solref="0.003 {zeta}" solimp="0.99 0.99 0.001"' if careful else ""
    option = ' timestep="1e-5"' if careful else ""
    text = f"""<mujoco><compiler angle="radian"/><option gravity="0 -9.81 0"{option}/>
      <default><geom condim="1" friction="0 0 0"{contact}/></default><worldbody>
      <geom type="cylinder" size="{hole["pin"]} 0.01"/>
      <body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>
      <inertial pos="0.5 0 0" mass="1" diaginertia="0.05 0.05 {1 / 12}"/>{boxes}</body></worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(text)
data = mujoco.MjData(model)
if model.nkey:
    mujoco.mj_resetDataKeyframe(model, data, 0)
order = [model.body(name).id for name in problem["names"]] or [1]


def advance(count, step):
    model.opt.timestep = step
    for _ in range(count):
        mujoco.mj_step(model, data)


def states():
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    rows = []
    for k in order:
        turn, speed = data.xmat[k].reshape(3, 3), np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, k, speed, 0)
        rows.append([*data.xipos[k][:2], np.arctan2(turn[1, 0], turn[0, 0]), *speed[3:5], speed[2]])
    return [[float(value) for value in row] for row in rows]


run(problem, model.opt.timestep, advance, states)
