"""Plays an exported policy in plain MuJoCo, on the file of the robot, as a check before it moves the robot.

Examples:
  arc-suite export runs/go2 --runner robot
  python examples/robot_in_mujoco.py go2.xml robot
  python examples/robot_in_mujoco.py go2.urdf robot 0.2 0 0.3

It needs MuJoCo, NumPy, onnxruntime and the folder of the export. The numbers are the command: forward and left, m/s,
and turning, rad/s. It prints the way of the robot and that of the command. For a simulator other than MuJoCo, write
another `Robot`.
"""

import math
import sys

import mujoco
import numpy as np

SECONDS = 10.0
SUBSTEP = 0.0002  # s; torques are computed outside of the integrator, which needs short steps
DROP = 0.02  # m, from which the robot comes down


def read_spec(path: str) -> mujoco.MjSpec:
    """Return the robot of a file, free on a level floor; its parts do not touch one another, as in training."""
    spec = mujoco.MjSpec.from_file(path)
    base = spec.worldbody.first_body()
    if not base.joints:
        base.add_freejoint()
    for geom in [*spec.geoms]:
        geom.conaffinity = 0
    floor = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))
    floor.contype = 0
    floor.conaffinity = 1
    return spec


class Robot:
    """A robot whose sensors and motors have the order of policy.json."""

    def __init__(self, spec: mujoco.MjSpec, facts: dict, substep: float = SUBSTEP):
        """Compile the robot with the motors of policy.json for actuators, and time steps of a substep, s, at most."""
        self.facts = facts
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        for motor in facts["motors"]:
            self.add_motor(spec, motor)
        self.substeps = math.ceil(facts["control_timestep"] / substep - 1e-6)
        spec.option.timestep = facts["control_timestep"] / self.substeps
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(motor["motor"]) for motor in facts["motors"]]
        self.angles = [joint.qposadr[0] for joint in joints]
        self.speeds = [joint.dofadr[0] for joint in joints]

    def add_motor(self, spec: mujoco.MjSpec, motor: dict):
        """Add a motor whose control is its torque, N m, and return it."""
        actuator = spec.add_actuator(name=motor["motor"], target=motor["motor"], trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
        return actuator

    def stand(self) -> None:
        """Take the standing pose, with the lowest geom a little above the floor."""
        for motor, address in zip(self.facts["motors"], self.angles, strict=True):
            self.data.qpos[address] = motor["home"]
        mujoco.mj_forward(self.model, self.data)
        lowest = math.inf
        for geom in range(self.model.ngeom):
            if self.model.geom_bodyid[geom] and self.model.geom_contype[geom]:
                center, half_sizes = np.split(self.model.geom_aabb[geom], 2)
                rotation = self.data.geom_xmat[geom].reshape(3, 3)
                height = self.data.geom_xpos[geom, 2] + rotation[2] @ center - abs(rotation[2]) @ half_sizes
                lowest = min(lowest, height)
        self.data.qpos[2] += DROP - lowest
        mujoco.mj_forward(self.model, self.data)

    def read(self, program):
        """Return what the sensors show."""
        qpos = self.data.qpos
        qvel = self.data.qvel
        return program.Sensors(qpos[self.angles], qvel[self.speeds], qpos[3:7].copy(), qvel[3:6].copy())

    def write(self, output) -> None:
        """Move on by a control step: motors do what the output says."""
        for _ in range(self.substeps):
            errors = output.targets - self.data.qpos[self.angles]
            torques = output.stiffness * errors - output.damping * self.data.qvel[self.speeds] + output.torques
            self.data.ctrl[:] = np.clip(torques, -output.limits, output.limits)
            mujoco.mj_step(self.model, self.data)


def main(path: str, folder: str, *numbers: str) -> None:
    """Play for some seconds, and print the way."""
    sys.path.insert(0, folder)
    import run

    policy = run.Policy.load(folder)
    command = np.array(numbers or ("0.3", "0", "0"), dtype=float)
    robot = Robot(read_spec(path), policy.facts)
    robot.stand()
    period = policy.facts["control_timestep"]
    for step in range(round(SECONDS / period)):
        sensors = robot.read(run)
        fault = policy.find_fault(sensors)
        if fault:
            print(f"stopped after {step * period:.2f} s: {fault}")
            break
        robot.write(policy.act(sensors, command))
    seconds = robot.data.time
    way = np.hypot(*robot.data.qpos[:2])
    print(f"way {way:.2f} m in {seconds:.2f} s; that of the command is {seconds * np.hypot(*command[:2]):.2f} m")


if __name__ == "__main__":
    main(*sys.argv[1:])
