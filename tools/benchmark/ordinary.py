"""The walk as one would write it without this suite: a Gymnasium `MujocoEnv` over the robot's XML file."""

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.mujoco import MujocoEnv

from arc_suite import models
from arc_suite.robots import ROBOTS
from arc_suite.tasks.walk import Walk


def full_model(robot: str):
    """Return the robot's model as a file would hold it: decorated, and with MuJoCo's islands on, its default."""
    root = models.assemble(ROBOTS[robot], decorated=True)
    root.option.flag.island = "enable"
    return root


def register(robot: str, xml_file: str) -> str:
    """Register the robot's ordinary environment.

    Args:
        robot: queen, bastion, tick or leaper.
        xml_file: holds `full_model`.

    Returns:
        Its id.
    """
    env_id = f"ordinary/{robot}-walk-v0"
    gymnasium.register(
        env_id,
        entry_point="benchmark.ordinary:OrdinaryEnv",
        max_episode_steps=1000,
        kwargs={"robot": robot, "xml_file": xml_file},
    )
    return env_id


class OrdinaryEnv(MujocoEnv):
    """The paper's reward and observation in the manner of Gymnasium's own MuJoCo environments."""

    metadata = {"render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"], "render_fps": 20}

    def __init__(self, robot: str, xml_file: str, terminate_when_unhealthy: bool = True, **kwargs):
        """Load the model.

        Args:
            robot: name of the robot.
            xml_file: the model.
            terminate_when_unhealthy: whether a fall ends the episode.
            **kwargs: keyword arguments of `MujocoEnv`.
        """
        super().__init__(xml_file, frame_skip=25, observation_space=None, **kwargs)
        settings = Walk.settings_for(ROBOTS[robot], {})
        self._settings = settings
        self._weights = settings.weights
        self._gait = settings.parameters  # numbers of the gait and the standing pose
        self._base_noise = settings.noise.position_noise
        self._joint_noise = settings.noise.joint_angle_noise
        self._torso = self.model.body("torso").id
        self._feet = [self.model.body(name).id for name in ROBOTS[robot].foot_names]
        self._terminate_when_unhealthy = terminate_when_unhealthy
        self._begin()
        size = self._get_obs().size
        self.observation_space = spaces.Box(low=-np.inf, high=np.inf, shape=(size,), dtype=np.float64)

    def _begin(self):
        self._phase = 0.0
        self._previous_action = np.zeros(self.model.nu)

    @property
    def contact_forces(self):
        return np.clip(self.data.cfrc_ext, -1.0, 1.0)

    @property
    def is_healthy(self):
        low, high = self._settings.healthy_range
        return low <= self.data.qpos[2] <= high

    def step(self, action):
        action = np.clip(action, -1.0, 1.0)
        x_before = self.data.xpos[self._torso, 0]
        self.do_simulation(action, self.frame_skip)
        x_velocity = (self.data.xpos[self._torso, 0] - x_before) / self.dt
        self._phase = (self._phase + 2 * np.pi * self._gait.gait_frequency * self.dt) % (2 * np.pi)

        observation = self._get_obs()
        reward, terms = self._get_rew(x_velocity, action)
        terminated = self._terminate_when_unhealthy and not self.is_healthy
        self._previous_action = action
        if self.render_mode == "human":
            self.render()
        return observation, reward, terminated, False, {"reward_terms": terms}

    def _get_rew(self, x_velocity, action):
        gait = self._gait
        is_stance = self.data.xpos[self._feet, 2] < gait.stance_threshold
        leg_phases = (self._phase + gait.phase_offsets) % (2 * np.pi)
        is_prescribed_stance = leg_phases < 2 * np.pi * gait.duty_factor
        wrong_feet = np.sum(is_stance != is_prescribed_stance)
        angles = self.data.qpos[7:]
        terms = {
            "forward": max(0.0, 1.0 - abs(x_velocity - gait.target_velocity) / self._settings.velocity_band),
            "healthy": float(self.is_healthy),
            "gait_bonus": 1.0 - wrong_feet / len(self._feet),
            "gait_cost": float(wrong_feet),
            "control": np.sum(np.square(action)),
            "smoothness": np.sum(np.square(action - self._previous_action)),
            "contact": np.sum(np.square(self.contact_forces)),
            "angular_velocity": np.sum(np.square(self.data.qvel[3:5])),
            "vertical_velocity": np.square(self.data.qvel[2]),
            "posture": np.sum(np.square(angles - gait.default_angles)),
        }
        return sum(self._weights[name] * term for name, term in terms.items()), terms

    def _get_obs(self):
        position = self.data.qpos.flatten()[2:]
        velocity = self.data.qvel.flatten()
        contact_forces = self.contact_forces[1:].flatten()
        clock = np.array([np.sin(self._phase), np.cos(self._phase)])
        return np.concatenate((position, velocity, contact_forces, clock))

    def reset_model(self):
        scale = np.array([self._base_noise] * 6 + [self._joint_noise] * (self.model.nv - 6))
        position_scale = np.insert(scale, 0, self._base_noise)  # quaternions have four numbers
        qpos = self.init_qpos + self.np_random.uniform(-1.0, 1.0, self.model.nq) * position_scale
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        qvel = self.init_qvel + scale * self.np_random.standard_normal(self.model.nv)
        self.set_state(qpos, qvel)
        self._begin()
        return self._get_obs()
