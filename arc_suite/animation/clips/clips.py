"""Animation clips: named motions of one body, which loop, stay in step and connect."""

import warnings
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks, registry
from arc_suite.animation.clips import additive, bounds, catalog, planting, secondary, swaying
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.animation.clips.foot_contacts import FootContact
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.animation.clips.root_motion import ClipMotion
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.robots.spec import Body

FPS = 60  # frames a second
# Presets of clips, of which a body takes the first that it has. The integral in their control brings the speeds of
# clips to those of their commands.
_PRESETS = ("in_step", "steered")
_PACE_RATE = 30.0  # Hz: a clip lasts a whole number of frames at this rate, and so at 60 Hz


class Clip(NamedTuple):
    """A named motion, sampled at the frames of a clip.

    Attributes:
        name: see `catalog.clip_of`, without a module.
        motion: a sample for each frame, both ends included.
        loops: whether the last pose is the first one.
        cycles: cycles of the gait.
        foot_contacts: events, in the order of time.
        feet: names of all feet.
        slip: mean path of a foot in stance over the ground, m a meter of the root; None if the root stays.
        slide: largest diagonal of the way of a standing foot, m; None for a clip in which feet are not to stand still.
        additive_over: names of the clips that an additive clip can be added to; None for a clip that is not additive.
        weight: share of the weight that legs allow; None for a clip without weight. See `weight.add_weight`.
        swings: (frames, bones, 4) how bones of ornaments are turned in the torso's frame; None for bones at rest.
    """

    name: str
    motion: ClipMotion
    loops: bool
    cycles: int
    foot_contacts: tuple[FootContact, ...]
    feet: tuple[str, ...]
    slip: float | None = None
    slide: float | None = None
    additive_over: tuple[str, ...] | None = None
    weight: float | None = None
    swings: np.ndarray | None = None

    @property
    def times(self) -> np.ndarray:
        """Times (frames,) of the frames, s."""
        return self.motion.time_step * np.arange(len(self.motion.joints))

    @property
    def moves(self) -> bool:
        """Whether the root moves."""
        return bool(self.motion.root.any())


def clips(
    setup: Setup,
    names: Sequence[str],
    policy: str = "cpg",
    preset: str | None = None,
    fps: float = FPS,
    progress: Callable[[Iterable[str]], Iterable[str]] = iter,
    straight: bool = False,
    plant: bool = False,
    weight: float | str = 1.0,
    left_out: MutableMapping[str, str] | None = None,
) -> list[Clip]:
    """Make clips of a body, all of them by one policy, except the showcases of presets.

    The policy walks under the commands of clips where the task has a command; in another task there is the clip walk
    alone. A cycle of the gait is a whole number of control steps, unless the setup sets `gait_frequency`.

    Loops begin where the gait schedules the touchdown of the first foot. All hold the same number of cycles: the least
    with which most of them close within two degrees. Stops begin and starts end with the first pose of the walk;
    stops end and starts begin with the first pose of idle. A clip lasts a whole number of frames at 30 and at 60 a
    second. The median height of soles in stance is 0.

    A clip that cannot be made is left out with a warning: a loop that does not close, a slow or fast walk whose speed
    is within 10 % of the walk's, a preset that the body lacks, a motion that breaks one of the `bounds`.

    Args:
        setup: body and task.
        names: see `catalog.clip_of`.
        policy: see `policies.policy`.
        preset: preset of the policy; None for `in_step` or else `steered` on level ground with a command, elsewhere
            for the one that suits the task and the body.
        fps: frames a second.
        progress: wraps the recordings, such as `tqdm`.
        straight: whether loops that do not turn, starts and stops go exactly where their commands say; without it, they
            veer as the body does.
        plant: whether inverse kinematics keeps feet in stance where they are; without it, they slide as in the physics.
        weight: multiple of the usual weight, from 0 for none to 2; or one of `swaying.CHARACTERS`.
        left_out: takes the reasons why clips cannot be made, by name.

    Raises:
        ValueError: no name, an unknown one, a value out of range, a policy that does not fit, or no clip that can be
            made.
        OSError: a file cannot be read.
    """
    checks.number("fps", fps, 1.0, 1000.0)
    checks.boolean("straight", straight)
    checks.boolean("plant", plant)
    character = swaying.choose_character(weight)
    names = _check_names(names)
    recorder = Recorder(setup, policy, _choose_preset(setup, policy) if preset is None else preset)
    reasons: dict[str, str] = {}  # why clips cannot be made, by name
    drafts = make_drafts(recorder, names, progress, reasons, straight, plant, character)
    _report_left_out(setup.body, names, reasons)
    if left_out is not None:
        left_out.update((name, reasons[name]) for name in names if name in reasons)
    body = setup.body
    sampled_names = drafts.keys() & {*names, "walk"}  # starts and stops swing as the walk, even if it is not asked for
    samples = {name: sample_clip(name, body, drafts[name], fps) for name in sampled_names}
    walk = samples["walk"].motion if "walk" in samples else None
    named_clips = {name: samples[name] for name in names if name not in reasons}
    for name, clip in named_clips.items():
        swings = secondary.swing(body, catalog.clip_of(name), clip.motion, walk)
        named_clips[name] = clip._replace(swings=swings)
    motion_of_clip = {name: clip.motion for name, clip in named_clips.items()}
    clip_loops = {name: clip.loops for name, clip in named_clips.items()}
    for name, clip in named_clips.items():
        if catalog.is_additive(name):
            bases = additive.find_bases(body, name, motion_of_clip, clip_loops, drafts["idle"].start)
            named_clips[name] = clip._replace(additive_over=tuple(bases))
    return list(named_clips.values())


def _choose_preset(setup: Setup, policy: str) -> str | None:
    """Return the preset of a demonstrator for clips; None for the one that suits the task and the body."""
    has_command = "command" in setup.definition.blocks
    has_level_ground = not setup.kind.own_arena  # a task without an arena of its own
    if policy == "cpg" and has_command and has_level_ground:
        return next(name for name in _PRESETS if name in presets_of(setup.body))
    return None


def _check_names(names: Sequence[str]) -> list[str]:
    """Return names of clips without their modules.

    Raises:
        ValueError: no name, an unknown one, or one twice.
    """
    if not names:
        raise ValueError(f"clips: expected one or more of {', '.join(catalog.clip_names())}, got none")
    _refuse_unknown_clips(names)
    bare_names = [registry.bare_name(name) for name in names]
    if len(set(bare_names)) < len(bare_names):
        raise ValueError(f"clips: expected each once, got {', '.join(bare_names)}")
    return bare_names


def _refuse_unknown_clips(names: Sequence[str]) -> None:
    """Raise the ValueError of the first unknown name; its text names all others that are unknown, too."""
    errors = {}
    for name in names:
        try:
            catalog.clip_of(name)
        except ValueError as error:
            errors[name] = error
    if not errors:
        return
    first_error, *_ = errors.values()
    _, *other_names = map(checks.preview, errors)
    if not other_names:
        raise first_error
    raise ValueError(f"{first_error}; not known either: {', '.join(other_names)}")


def _report_left_out(body: Body, names: Sequence[str], left_out: Mapping[str, str]) -> None:
    """Warn of each named clip that is left out; a ValueError if all of them are."""
    missing = [name for name in names if name in left_out]
    if len(missing) == len(names):
        raise ValueError(f"{body.name}, clip {names[0]}: {left_out[names[0]]}")
    for name in missing:
        warnings.warn(f"{body.name}, clip {name} is left out: {left_out[name]}", stacklevel=3)


def sample_clip(name: str, body: Body, draft: Draft, fps: float) -> Clip:
    """Return a draft as frames; it lasts a whole number of frames at 30 and at 60 a second."""
    draft_seconds = draft.motion.seconds
    if draft.loops and draft.cycles:
        # A loop is a whole number of control steps, its gait cycles need not be. The gait cycles set the pace.
        draft_seconds = draft.cycles * draft.cycle
    seconds = max(1, round(draft_seconds * _PACE_RATE)) / _PACE_RATE
    draft = draft._replace(motion=draft.motion.stretch_to(seconds), cycle=draft.cycle * seconds / draft_seconds)
    frames = max(1, round(seconds * fps))
    motion = draft.motion.sample_at(np.linspace(0.0, seconds, frames + 1))
    _, contacts = draft.stance_height_and_contacts(body)
    slip = planting.slip(body, motion) if draft.loops else None
    slide = None
    if bounds.feet_stand(catalog.clip_of(name)):
        slide = bounds.measure(body, motion).slide * body.torso.standing_height
    return Clip(
        name, motion, draft.loops, draft.cycles, tuple(contacts), body.foot_names, slip, slide, weight=draft.weight
    )
