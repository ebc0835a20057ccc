"""Largest tilts of arms that the firmware's law balances in MuJoCo, for the test `arm`.

`python arm_in_mujoco.py TABLE RIG` with a gain table of `upright design RIG --out TABLE`: for each link alone, the
largest angle (rad) from which the loop recovers.
"""

import re
import sys
import tomllib

import mujoco
import numpy as np

table = open(sys.argv[1]).read()
rig = tomllib.load(open(sys.argv[2], "rb"))
arm, links, motor, tick = rig["arm"], rig["link"], rig["actuator"], rig["tick"]["period_s"]
N = len(links)


def matrix(name, count):
    found = re.findall(name + r": columns\(\[(.*?)\]\),\n", table, re.S)[count]
    return np.array([[float(x) for x in row.split(",")] for row in re.findall(r"\[([^\[\]]+)\]", f"[{found}]")]).T


K, AD, BD, L = matrix("k", 0)[:, 0], matrix("ad", 0), matrix("bd", 0)[:, 0], matrix(r"\bl", 0)
PER_VOLT = motor["torque_constant_n_m_per_a"] * motor.get("gear_ratio", 1) / motor["resistance_ohm"]
BACK_EMF = motor["torque_constant_n_m_per_a"] * motor.get("gear_ratio", 1)
LIMIT = min(motor.get("torque_limit_n_m", np.inf), PER_VOLT * motor["supply_v"])
STEPS = 2 * np.pi / np.array([part["encoder_counts_per_rev"] for part in [arm, *links]])


def model():
    text, ends, beyond, up = "", "", 0.0, 0.0
    for link in links:
        m, l = link["mass_kg"], link["length_m"]
        c, i, r = link.get("centre_of_mass_m", l / 2), link.get("inertia_kg_m2", m * l * l / 12), arm["radius_m"]
        text += f"""<body pos="{r - beyond} 0 {up}"><joint type="hinge" axis="1 0 0"
            damping="{link.get("friction_n_m_s_per_rad", 0)}"/>
            <inertial pos="0 0 {c}" mass="{m}" diaginertia="{i} {i} 1e-12"/>"""
        ends, beyond, up = ends + "</body>", r, l
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 -9.81" timestep="{tick / 20}" integrator="RK4"/>
        <compiler balanceinertia="false" boundmass="0" boundinertia="0"/><worldbody><body>
        <joint type="hinge" axis="0 0 1" damping="{arm["friction_n_m_s_per_rad"]}"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 {arm["inertia_kg_m2"]}"/>{text}{ends}</body></worldbody></mujoco>"""
    )


def recovers(machine, link, tilt):
    data, estimate = mujoco.MjData(machine), None
    data.qpos[link] = tilt
    if link < N:
        data.qpos[link + 1] = -tilt  # the next link stays vertical
    for _ in range(int(6 / tick)):
        measured = np.round(data.qpos / STEPS) * STEPS
        if estimate is None:
            estimate = np.zeros(2 * N + 2)
            estimate[::2] = measured
        x = estimate + L @ (measured - estimate[::2])
        force = np.clip(-(K @ x), -LIMIT, LIMIT)
        estimate = AD @ x + BD * force
        volts = np.clip(force / PER_VOLT + BACK_EMF * x[1], -motor["supply_v"], motor["supply_v"])
        for _ in range(20):
            data.qfrc_applied[0] = PER_VOLT * (volts - BACK_EMF * data.qvel[0])
            mujoco.mj_step(machine, data)
        low, high = arm["travel_rad"]
        if max(abs(np.cumsum(data.qpos[1:]))) > np.pi / 2 or not low < data.qpos[0] < high:
            return False
    return max(abs(data.qpos[1:])) < 0.05


machine = model()
for link in range(1, N + 1):
    low, high = 0.0, 1.0
    while high - low > 5e-4:
        middle = (low + high) / 2
        low, high = (middle, high) if recovers(machine, link, middle) else (low, middle)
    print(f"link {link}: {low:.4f}")
