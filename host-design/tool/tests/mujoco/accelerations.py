"""Accelerations of MuJoCo models at some states: python3 accelerations.py MODEL.xml... > accelerations.csv

A line has the model's name, the control, and the positions, speeds and accelerations of its joints. Needs the package
mujoco; recorded with 4.0.0.
"""

import math
import pathlib
import sys

import mujoco

for path in map(pathlib.Path, sys.argv[1:]):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for number in range(1, 9):
        wave = lambda joint, phase: math.sin(1.0 + 2.3 * number + 0.9 * joint + phase)
        for joint in range(model.nv):
            # The cart within its rail, the links anywhere, and no joint so slow that it might stick.
            largest = 0.8 * min(-model.jnt_range[0][0], model.jnt_range[0][1]) if joint == 0 else math.pi
            data.qpos[joint] = largest * wave(joint, 0.0)
            speed = 3.0 * wave(joint, 1.7)
            data.qvel[joint] = speed + math.copysign(0.5, speed)
        limits = model.actuator_ctrlrange[0] if model.actuator_ctrllimited[0] else [-1.0, 1.0]
        data.ctrl[0] = 0.9 * limits[1] * wave(0, 0.4)
        if model.na:
            data.act[0] = data.ctrl[0]
        mujoco.mj_forward(model, data)
        numbers = [data.ctrl[0], *data.qpos, *data.qvel, *data.qacc]
        print(path.stem, *(repr(float(number)) for number in numbers), sep=",")
