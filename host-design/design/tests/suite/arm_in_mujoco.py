"""Accelerations of arms with 1 to 4 links in MuJoCo, for the test `plant_arm`: `python arm_in_mujoco.py > arm_in_mujoco.json`.

Link i is a body at its own distance from the axis, with a mass anywhere along it and an inertia about its own length.
"""

import json
import random

import mujoco
import numpy as np

GRAVITY = 9.81


def links(n, draw):
    return [
        {
            "mass_kg": draw.uniform(0.05, 0.4),
            "length_m": draw.uniform(0.1, 0.5),
            "centre_of_mass_m": draw.uniform(0.05, 0.3),
            "inertia_kg_m2": draw.uniform(1e-4, 4e-3),
            "axial_inertia_kg_m2": draw.uniform(1e-5, 9e-5),
            "friction_n_m_s_per_rad": draw.uniform(1e-4, 3e-3),
            "radius_m": draw.uniform(0.1, 0.4),
        }
        for _ in range(n)
    ]


def model(arm, links):
    text, ends, beyond, up = "", "", 0.0, 0.0
    for link in links:
        i, axial = link["inertia_kg_m2"], link["axial_inertia_kg_m2"]
        text += f"""<body pos="{link["radius_m"] - beyond!r} 0 {up!r}">
          <joint type="hinge" axis="1 0 0" damping="{link["friction_n_m_s_per_rad"]!r}"/>
          <inertial pos="0 0 {link["centre_of_mass_m"]!r}" mass="{link["mass_kg"]!r}" diaginertia="{i!r} {i!r} {axial!r}"/>"""
        ends += "</body>"
        beyond, up = link["radius_m"], link["length_m"]
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 {-GRAVITY}"/><compiler balanceinertia="false" boundmass="0" boundinertia="0"/>
        <worldbody><body><joint type="hinge" axis="0 0 1" damping="{arm["friction"]!r}"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 {arm["inertia"]!r}"/>{text}{ends}</body></worldbody></mujoco>"""
    )


def case(n, seed):
    draw = random.Random(seed)
    arm = {"inertia": draw.uniform(1e-3, 2e-2), "friction": draw.uniform(1e-4, 1e-2)}
    chain = links(n, draw)
    machine = model(arm, chain)
    data = mujoco.MjData(machine)
    data.qpos[:] = [draw.uniform(-3.0, 3.0) for _ in range(n + 1)]
    data.qvel[:] = [draw.uniform(-6.0, 6.0) for _ in range(n + 1)]
    data.qfrc_applied[:] = [draw.uniform(-0.3, 0.3) for _ in range(n + 1)]
    mujoco.mj_forward(machine, data)
    mass = np.zeros((n + 1, n + 1))
    mujoco.mj_fullM(machine, data, mass)
    forces = data.qfrc_applied + data.qfrc_passive - data.qfrc_bias
    imposed = draw.uniform(-9.0, 9.0)
    following = np.linalg.solve(mass[1:, 1:], forces[1:] - mass[1:, 0] * imposed)
    return {
        "arm": arm,
        "links": chain,
        "angles_rad": list(data.qpos),
        "rates_rad_per_s": list(data.qvel),
        "torques_n_m": list(data.qfrc_applied),
        "accelerations": list(data.qacc),
        "imposed": imposed,
        "following": list(following),
    }


cases = [json.dumps(case(n, 10 * n + seed)) for n in range(1, 5) for seed in range(3)]
print("[" + ",\n".join(cases) + "]")
