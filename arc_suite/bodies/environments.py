"""Environments of different bodies as one Gymnasium vector environment."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from arc_suite import checks, registry, rotations
from arc_suite.bodies import padding, tokens
from arc_suite.bodies.descriptions import Description, body_description
from arc_suite.bodies.groups import Group, Member, Place, group_by_batch, scatter
from arc_suite.bodies.tokens import Tokens
from arc_suite.envs.base_vector import MAX_ENVS, BaseVectorEnv, checked_task_kwargs
from arc_suite.envs.calls import KnownAttributes, Lock, checked_action, checked_command, one_thread_at_a_time
from arc_suite.envs.prepare import prepare_task, refuse_arguments
from arc_suite.envs.setup import pair_with_tasks
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import select_environments
from arc_suite.tasks.contract import LEVEL, Task
from arc_suite.tasks.readings import torso_qpos


class BodiesTask(NamedTuple):
    """The task of environments of different bodies with flat observations, for learners.

    Attributes:
        name: name of the task, of several with commas.
        step_limit: control steps after which every episode is over, may be infinite.
        sizes: sizes of the blocks of an observation by name, in order.
    """

    name: str
    step_limit: float
    sizes: Mapping[str, int] = tokens.FLAT_SIZES

    @property
    def definition(self) -> "BodiesTask":
        """This task itself: learners read `definition` of any task."""
        return self

    @property
    def symmetry(self):
        """No mirror maps.

        Raises:
            ValueError: always; bodies need not be symmetric.
        """
        raise ValueError(f"task {self.name}: different bodies have no common mirror image")

    def split(self, observation: np.ndarray) -> dict[str, np.ndarray]:
        """Return an observation (..., 759) as named blocks, views of it."""
        return tokens.split_flat(observation)


class BodiesEnv(KnownAttributes, BaseVectorEnv):
    """Environments of different bodies, `gymnasium.make_vec("arc_suite/bodies-<task>-v0", num_envs=n, bodies=...)`.

    Observations are legs (num_envs, 12, 19), torso (num_envs, 12) and command (num_envs, 17), float32 without
    dimension and 0 where a body has no leg or joint; see `bodies.tokens.Tokens.make_tokens`. Actions are
    (num_envs, 12, 4) in [-1, 1], positions of joints as with `actions="position"`; entries without a joint are
    ignored. `description` holds what does not change. With `flat=True`, for plain learners, observations are vectors
    (num_envs, 759) that include legs and torso of the description, and actions are (num_envs, 48).

    An environment of seed s is bit-equal to an environment of its body and seed in a `VectorEnv` with
    `actions="position"`: states, rewards, infos, and the tokens of the observation. Bodies whose models have one
    layout share a batch in level tasks; others have a batch of their own, to the same effect. The ground is as
    each body's own task makes it.

    Environments may have different tasks: `BodiesEnv("walk,steer", ...)`. Each has the rewards, the time limit and the
    metrics of its own; metrics of others are 0 there, and their masks False.

    Autoreset modes, infos, `rest`, `command`, `snapshot`, pickles, copies and threads are as in `VectorEnv`.

    Attributes:
        bodies: bodies of each environment.
        tasks: tasks of each environment, for demonstrators.
        task: task of all, for learners.
        step_limit: control steps after which every episode is over, may be infinite.
        description: description of each environment, (num_envs, ...) float32; see `bodies.descriptions.Description`.
        autoreset_mode: what happens to an environment whose episode has ended.
    """

    def __init__(
        self,
        task_name: str,
        num_envs: int = 1,
        bodies: Any = "random:0",
        num_threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        task_kwargs: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
        width: int | None = None,
        height: int | None = None,
        camera_id: int | str | None = None,
        flat: bool = False,
        privileged: bool = False,
        **others: Any,
    ):
        """Prepare the task of every body and allocate the environments.

        Args:
            task_name: as in `arc_suite.load`, or several names with commas between.
            num_envs: number of environments; environment i has body i, and so on from the first after the last. Several
                tasks take turns, see `envs.setup.pair_with_tasks`.
            bodies: one or several, see `registry.bodies_of`, or a list of them.
            num_threads: as in `VectorEnv`, of each batch.
            autoreset_mode: as in `VectorEnv`.
            max_episode_steps: as in `VectorEnv`.
            task_kwargs: as in `VectorEnv`, the same for all bodies and tasks; without `actions`.
            render_mode: as in `VectorEnv`.
            width: width of a picture, pixels; only with a render mode, as the next two.
            height: height of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.
            flat: whether observations and actions are vectors.
            privileged: as in `VectorEnv`; blocks of legs and joints are padded to 12 legs of 4 joints.
            **others: none; they are refused with what takes their place.

        Raises:
            ValueError: an unknown name, a body with more than 12 legs or 4 joints a leg, or a value that does not fit.
        """
        self._lock = Lock()
        self._places: list[Place] = []
        self._begun = False
        refuse_arguments(others, type(self).__init__)
        has_flat_spaces = checks.boolean("flat", flat)
        different_bodies = _find_bodies(bodies)
        num_envs = checks.integer("num_envs", num_envs, 1, MAX_ENVS)
        if not different_bodies:
            raise ValueError(f"bodies: expected at least one, got {checks.preview(bodies)}")
        task_names = registry.split_task_names(task_name)
        for count, noun in ((len(different_bodies), "bodies"), (len(task_names), "tasks")):
            if count > num_envs:
                raise ValueError(f"num_envs: expected at least one for each of {count} {noun}, got {num_envs}")
        for body in different_bodies:
            padding.joint_slots(body)  # refuses too many legs or joints
        settings = {"actions": "position", **checked_task_kwargs(task_kwargs)}
        checks.name(settings["actions"], ["position"], "actions of different bodies")
        seed = settings.pop("random", None)
        options = {
            "num_threads": num_threads,
            "autoreset_mode": autoreset_mode,
            "max_episode_steps": max_episode_steps,
            "task_kwargs": settings,
            "render_mode": render_mode,
            "width": width,
            "height": height,
            "camera_id": camera_id,
            "privileged": privileged,
        }
        all_pairs = pair_with_tasks(different_bodies, task_names)
        pairs = [all_pairs[index % len(all_pairs)] for index in range(num_envs)]
        member_of_pair = {}
        for body, name in dict.fromkeys(pairs):
            task, model = prepare_task(body, name, _task_settings(settings))
            member_of_pair[body, name] = Member(task, model)

        members = [member_of_pair[pair] for pair in pairs]
        self.num_envs = num_envs
        self.bodies = tuple(body for body, _ in pairs)
        self.tasks = tuple(member.task for member in members)
        if privileged:
            _check_same_privileged_blocks(self.tasks)
        names_of_tasks = dict.fromkeys(task.name for task in self.tasks)  # each once
        self.task = BodiesTask(",".join(names_of_tasks), max(task.step_limit for task in self.tasks))
        self._flat = has_flat_spaces
        tokens_of_envs = Tokens.of(self.tasks)
        for indices in group_by_batch(members):
            _, name = pairs[indices[0]]
            group = Group([members[index] for index in indices], name, **options)
            self._places.append(Place(group, np.array(indices), tokens_of_envs.select(indices)))
        self.step_limit = float(max(np.max(place.group.step_limit) for place in self._places))
        first_group = self._places[0].group
        self.autoreset_mode = first_group.autoreset_mode
        self.metadata = first_group.metadata
        self.render_mode = render_mode
        description_of_pair = {pair: body_description(member.task) for pair, member in member_of_pair.items()}
        columns = zip(*(description_of_pair[pair] for pair in pairs), strict=True)
        self.description = Description(*map(np.stack, columns))
        self._set_observations(tokens_of_envs)
        if seed is not None:
            seeds = self._checked_seeds(seed)
            for group, indices, _ in self._places:
                group._begin_streams([seeds[index] for index in indices], np.ones(len(indices), bool))
        self._sealed_by = __name__

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        # Pickles of earlier versions have the observations of those.
        tokens_of_envs = Tokens.of(self.tasks)
        self._places = [Place(group, indices, tokens_of_envs.select(indices)) for group, indices, _ in self._places]
        self._set_observations(tokens_of_envs)

    def _set_observations(self, tokens_of_envs: Tokens) -> None:
        """Set tokens and spaces."""
        self._tokens = tokens_of_envs
        self.single_observation_space, self.single_action_space = _spaces(self._flat)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @one_thread_at_a_time
    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None):
        """Start an episode in every environment, or in some; see `VectorEnv.reset`."""
        self._check_open("reset")
        mask = self._checked_reset_mask(options)
        if not (self._begun or mask.all()):
            raise ResetNeeded("cannot reset some environments: reset all of them first")
        seeds = [None] * self.num_envs if seed is None else self._checked_seeds(seed)
        info = {}
        for group, indices, _ in self._places:
            if mask[indices].any():
                group_seeds = [seeds[index] for index in indices]
                _, group_info = group.reset(seed=group_seeds, options={"reset_mask": mask[indices]})
                scatter(info, group_info, indices, self.num_envs)
        self._begun = True
        return self._observation(), info

    @one_thread_at_a_time
    def step(self, actions):
        """Advance every environment by one control step, except those that start an episode; see `VectorEnv.step`.

        Args:
            actions: (num_envs, 12, 4), or (num_envs, 48) of flat environments, clipped to [-1, 1].

        Raises:
            ValueError: actions of another shape, or NaN in one; no environment has advanced then.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if not self._begun:
            raise ResetNeeded("cannot step: no episode has begun; call reset first")
        checked_actions = checked_action(actions, self.action_space.shape)
        reward = np.zeros(self.num_envs)
        terminated = np.zeros(self.num_envs, bool)
        truncated = np.zeros(self.num_envs, bool)
        info = {}
        for place in self._places:
            indices = place.indices
            body_actions = place.tokens.body_actions(checked_actions[indices])
            _, group_reward, group_terminated, group_truncated, group_info = place.group.step(body_actions)
            reward[indices] = group_reward
            terminated[indices] = group_terminated
            truncated[indices] = group_truncated
            if "final_obs" in group_info:
                group_info["final_obs"] = self._final_observations(place, group_info["final_obs"])
            scatter(info, group_info, indices, self.num_envs)
        return self._observation(), reward, terminated, truncated, info

    def own_observations(self) -> tuple[np.ndarray, ...]:
        """Return the latest observation (size,) float32 of each environment as its own task has it.

        `tasks[i].split` gives its blocks by name.
        """
        return self._of_each(lambda group: group._observation.copy())

    def places(self) -> np.ndarray:
        """Return x and y, m, and yaw, rad, of the torsos in the world (num_envs, 3)."""
        poses = np.array(self._of_each(_torso_poses))
        return np.column_stack([poses[:, :2], rotations.yaw(poses[:, 3:7])])

    def quaternions(self) -> np.ndarray:
        """Return the orientations (num_envs, 4) of the torsos in the world."""
        return np.array(self._of_each(lambda group: group.batch.data.qpos[:, 3:7]))

    def resampled(self) -> np.ndarray:
        """Return in which environments (num_envs,) the latest step began another command; see `VectorEnv.resampled`."""
        return np.array(self._of_each(lambda group: group.resampled()))

    def command(self, name: str, value, mask=None) -> None:
        """Set a command of the task in some environments; see `VectorEnv.command`."""
        self._check_open("command")
        mask = self._checked_mask(mask, "mask")
        # A name such as that of a gait stands for other numbers, or for more of them, on another body.
        values_by_task: dict[int, np.ndarray] = {}
        for task in {id(self.tasks[index]): self.tasks[index] for index in np.flatnonzero(mask)}.values():
            values_by_task[id(task)] = checked_command(task, name, value, (self.num_envs,))
        if not self._begun:
            raise ResetNeeded(f"cannot set command {name!r}: no episode has begun; call reset first")
        for group, indices, _ in self._places:
            if mask[indices].any():
                values = np.full((len(indices), self.tasks[indices[0]].commands[name]), np.nan)
                for row in np.flatnonzero(mask[indices]):
                    index = indices[row]
                    values[row] = values_by_task[id(self.tasks[index])][index]
                group.command(name, values, mask[indices])

    @one_thread_at_a_time
    def change_model(self, fields: Mapping[str, Any], mask=None) -> None:
        """Set fields of the models of some environments; see `VectorEnv.change_model`.

        Values broadcast to the fields of each body, or to these with a leading axis of num_envs.
        """
        self._check_open("change the model")
        mask = self._checked_mask(mask, "mask")
        checked_changes = []  # all of them, before the first model changes
        for group, indices, _ in self._places:
            if mask[indices].any():
                group_fields = select_environments(group.batch.models[0], fields, self.num_envs, indices)
                checked_changes.append((group, group._checked_fields(group_fields), mask[indices]))
        for group, values, group_mask in checked_changes:
            group.batch.change_model(values, group_mask)

    @one_thread_at_a_time
    def change_settings(self, settings: Mapping[str, Any], mask=None) -> None:
        """Set settings of some environments from their next reset on; see `VectorEnv.change_settings`."""
        self._check_open("change settings")
        mask = self._checked_mask(mask, "mask")
        checked_changes = []  # all of them, before the first setting changes
        for group, indices, _ in self._places:
            if mask[indices].any():
                checked_changes.append((group, group._checked_changes(settings), mask[indices]))
        for group, changes, group_mask in checked_changes:
            group._put_changes(group_mask, changes, restart=LEVEL in settings)

    @one_thread_at_a_time
    def rest(self, mask) -> None:
        """Let environments, and no others, stand still until they are reset; see `VectorEnv.rest`."""
        self._check_open("rest")
        mask = self._checked_mask(mask, "mask")
        for group, indices, _ in self._places:
            group._resting = mask[indices]

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state of all environments as arrays by name, from which `restore` goes on.

        They include flat `observation` (num_envs, 759), and `steps` (num_envs,), control steps of the episodes.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        arrays = {}
        for number, place in enumerate(self._places):
            for name, array in place.group.snapshot().items():
                arrays[f"{number}/{name}"] = array
        arrays["observation"] = self._flatten(self._make_tokens())
        arrays["steps"] = np.array(self._of_each(lambda group: group._steps))
        return arrays

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, bit-exact, from the snapshot of environments of the same bodies and task.

        Its `steps` may have been changed.

        Raises:
            ValueError: an array is missing or does not fit; none has been used.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        steps = np.asarray(arrays.get("steps", ()))
        has_steps = steps.shape == (self.num_envs,)
        checked_snapshots = []  # all of them, before the first group is restored
        for number, place in enumerate(self._places):
            prefix = f"{number}/"
            group_arrays = {}
            for name, array in arrays.items():
                if name.startswith(prefix):
                    group_arrays[name.removeprefix(prefix)] = array
            # Steps of another shape go to the group, too: it refuses them.
            group_arrays["steps"] = steps[place.indices] if has_steps else steps
            checked_snapshots.append(place.group._checked_snapshot(group_arrays))
        for place, snapshot in zip(self._places, checked_snapshots, strict=True):
            place.group._restore_state(*snapshot)
        self._begun = True

    def _check_process(self) -> None:
        self._places[0].group._check_process()

    @one_thread_at_a_time
    def render(self, indices: Iterable[int] | None = None) -> tuple[np.ndarray, ...] | None:
        """Return pictures of the present states; see `VectorEnv.render`."""
        self._check_open("render")
        if self.render_mode is None:
            return None
        group_and_index = self._of_each(lambda group: [(group, index) for index in range(group.num_envs)])
        pictures = []
        for env_index in self._checked_indices(indices):
            group, index_in_group = group_and_index[env_index]
            (picture,) = group.render([index_in_group])
            pictures.append(picture)
        return tuple(pictures)

    @one_thread_at_a_time
    def close(self, **kwargs: Any) -> None:
        """Free the simulations; a second call does nothing."""
        super().close(**kwargs)

    def close_extras(self, **kwargs: Any) -> None:
        """Free the simulations; `close` calls it."""
        for place in self._places:
            place.group.close()

    @property  # type: ignore[misc]  # of Gymnasium, which can be set and is of one environment
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """Draw, for each environment, from the stream that its resets draw from."""
        return self._of_each(lambda group: group.np_random)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each environment's stream of random numbers; -1 where none was given."""
        return self._of_each(lambda group: group.np_random_seed)

    def _of_each(self, values_of_group: Callable[[Group], Iterable]) -> tuple:
        """Return a value for each environment, given a function that returns those of a group."""
        values: list[Any] = [None] * self.num_envs
        for group, indices, _ in self._places:
            for index, value in zip(indices.tolist(), values_of_group(group), strict=True):
                values[index] = value
        return tuple(values)

    def _observation(self) -> dict[str, np.ndarray] | np.ndarray:
        """Return the latest observation of all environments."""
        token_blocks = self._make_tokens()
        return self._flatten(token_blocks) if self._flat else token_blocks

    def _make_tokens(self) -> dict[str, np.ndarray]:
        """Return the tokens of all environments."""
        inputs = np.empty(self._tokens.input_indices.shape, np.float32)
        for group, indices, group_tokens in self._places:
            inputs[indices] = group_tokens.gather_inputs(group._observation)
        return self._tokens.make_tokens(inputs)

    def _flatten(self, token_blocks: Mapping[str, np.ndarray], indices=slice(None)) -> np.ndarray:
        """Return flat observations of the tokens of some environments."""
        legs = self.description.legs[indices]
        torso = self.description.torso[indices]
        return tokens.flatten_tokens(token_blocks, legs, torso)

    def _final_observations(self, place: Place, vectors: np.ndarray) -> np.ndarray:
        """Return the final observations of a group's episodes.

        Args:
            place: the group, its indices and tokens.
            vectors: (environments of the group,) objects: observations of the bodies' own tasks, None for episodes
                that go on.

        Returns:
            (environments of the group,) objects, None for episodes that go on.
        """
        observations = np.full(len(vectors), None, object)
        for index, vector in enumerate(vectors):
            if vector is None:
                continue
            env_tokens = place.tokens.select([index])
            token_blocks = env_tokens.make_tokens(env_tokens.gather_inputs(vector[None]))
            if self._flat:
                observations[index] = self._flatten(token_blocks, place.indices[[index]])[0]
            else:
                observations[index] = {name: array[0] for name, array in token_blocks.items()}
        return observations


def _find_bodies(bodies: Any) -> list[Body]:
    """Return the bodies of one or several names, specs or ranges; see `registry.bodies_of`."""
    names = bodies if isinstance(bodies, list | tuple) else [bodies]
    return [body for name in names for body in registry.bodies_of(name)]


def refuse_one_environment(task_name: str, **others: Any) -> None:
    """Refuse `gymnasium.make` of an id of environments of different bodies.

    Raises:
        ValueError: always; it says what makes them, and what makes one environment.
    """
    bodies_id = registry.env_id("bodies", registry.task_of(task_name))
    other_makers = (
        f"gymnasium.make takes a robot in place of bodies, or arc_suite.envs.gym.Env a body and {task_name!r}"
    )
    raise ValueError(f"{bodies_id}: gymnasium.make_vec makes these environments, with num_envs; {other_makers}")


def _check_same_privileged_blocks(tasks: Sequence[Task]) -> None:
    """Raise ValueError for tasks whose privileged observations differ."""
    first_task = tasks[0]
    for task in tasks:
        if padding.privileged_sizes(task) != padding.privileged_sizes(first_task):
            names = f"{first_task.name} and {task.name}"
            raise ValueError(f"privileged: expected tasks with the same blocks, got {names}; False leaves them out")


def _spaces(flat: bool) -> tuple[gymnasium.Space, gymnasium.Space]:
    """Return the spaces of observations and of actions of one environment."""
    if flat:
        size = sum(tokens.FLAT_SIZES.values())
        observations = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        actions = gymnasium.spaces.Box(-1.0, 1.0, (padding.MAX_LEGS * padding.MAX_JOINTS,), np.float32)
        return observations, actions
    shapes = {
        "legs": (padding.MAX_LEGS, tokens.LEG_SIZE),
        "torso": (tokens.TORSO_SIZE,),
        "command": (tokens.COMMAND_SIZE,),
    }
    boxes: dict[str, gymnasium.Space] = {
        name: gymnasium.spaces.Box(-np.inf, np.inf, shape, np.float32) for name, shape in shapes.items()
    }
    actions = gymnasium.spaces.Box(-1.0, 1.0, (padding.MAX_LEGS, padding.MAX_JOINTS), np.float32)
    return gymnasium.spaces.Dict(boxes), actions


def _task_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a task, without that of the vector environment."""
    return {name: value for name, value in settings.items() if name != "on_divergence"}


def _torso_poses(group: Group) -> np.ndarray:
    """Return the positions and quaternions (environments of the group, 7) of the torsos in the world."""
    return torso_qpos(group.batch.data.qpos, group._task.scene.layout)[:, :7]
