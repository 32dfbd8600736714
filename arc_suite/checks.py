"""Checks of names, seeds and numbers. Each returns the checked value, or raises an error in the same wording."""

import contextlib
import difflib
import json
import math
import operator
import os
import pkgutil
import re
import sys
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

# NumPy's defaults: the hashes in committed tables are of texts that they give.
_DEFAULT_PRINT_OPTIONS: Mapping[str, Any] = {
    "edgeitems": 3,
    "floatmode": "maxprec",
    "formatter": None,
    "infstr": "inf",
    "legacy": False,
    "linewidth": 75,
    "nanstr": "nan",
    "precision": 8,
    "sign": "-",
    "suppress": False,
}

MAX_SEED = 2**32 - 1  # the largest seed of a NumPy `RandomState`

# Names of other libraries, and the names that this suite has for the same; errors suggest the first that is valid.
SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "a2c": ("ppo",),
    "actor_lr": ("policy_rate", "learning_rate"),
    "agent": ("algorithm", "policy"),
    "alg": ("algorithm",),
    "algo": ("algorithm",),
    "alpha": ("initial_temperature",),
    "angle": ("camera",),
    "anim": ("clips",),
    "animation": ("clips",),
    "animations": ("clips",),
    "ant": ("leaper",),
    "armature": ("skin",),
    "back": ("tracking",),
    "batch_size": ("minibatch", "batch"),
    "behavior_cloning": ("bc",),
    "body": ("robot", "spec"),
    "bones": ("skin",),
    "cfg": ("config",),
    "character": ("robot",),
    "chase": ("tracking",),
    "checkpoint": ("policy", "run"),
    "cheetah": ("leaper",),
    "ckpt": ("policy", "run"),
    "climb": ("stairs",),
    "clip_coef": ("clip",),
    "clip_param": ("clip",),
    "clip_range": ("clip",),
    "color": ("palette",),
    "colors": ("palette",),
    "conf": ("config",),
    "contact_cost_weight": ("weights",),
    "controller": ("policy",),
    "cores": ("threads", "jobs"),
    "creature": ("robot",),
    "critic_lr": ("value_rate", "learning_rate"),
    "crossq": ("xqc",),
    "ctrl_cost_weight": ("weights",),
    "ddpg": ("sac",),
    "desired_kl": ("final_desired_kl",),
    "dir": ("output",),
    "dog": ("hound",),
    "dqn": ("sac",),
    "duration": ("time_limit", "steps"),
    "ent_coef": ("target_entropy", "initial_std"),
    "entropy": ("target_entropy", "initial_std"),
    "env": ("robot",),
    "env_id": ("robot",),
    "env_kwargs": ("set",),
    "eval_episodes": ("episodes",),
    "eval_every": ("evaluate_every",),
    "eval_freq": ("evaluate_every",),
    "eval_interval": ("evaluate_every",),
    "exclude_current_positions_from_observation": ("exclude_blocks",),
    "exp_name": ("output",),
    "experiment_name": ("output",),
    "false": ("in_place",),
    "fetch": ("navigate",),
    "file": ("spec", "robot"),
    "filename": ("output", "spec"),
    "film": ("output",),
    "first_person": ("eye",),
    "floor": ("arena",),
    "folder": ("output", "runs"),
    "follow": ("tracking",),
    "forward_reward_weight": ("weights",),
    "fpv": ("eye",),
    "frame_rate": ("fps",),
    "framerate": ("fps",),
    "frames": ("steps",),
    "front": ("portrait",),
    "gamma": ("discount",),
    "get_up": ("recover",),
    "getup": ("recover",),
    "goal": ("navigate",),
    "gradient_steps": ("utd_ratio",),
    "ground": ("arena",),
    "half_cheetah": ("leaper",),
    "halfcheetah": ("leaper",),
    "healthy_reward": ("weights",),
    "heightmap": ("arena",),
    "hidden_dim": ("hidden",),
    "hidden_size": ("hidden",),
    "hidden_sizes": ("hidden",),
    "hopper": ("leaper",),
    "hparams": ("hp",),
    "humanoid": ("leaper",),
    "hyperparameters": ("hp",),
    "hyperparams": ("hp",),
    "imitation": ("mimic", "dagger"),
    "input": ("spec", "robot", "file"),
    "iterations": ("steps",),
    "joystick": ("steer",),
    "jump": ("leap",),
    "lam": ("gae_lambda",),
    "learner": ("algorithm",),
    "learning_rate": ("policy_rate",),
    "learning_starts": ("start_steps",),
    "load": ("policy", "run"),
    "log_dir": ("output", "json", "results"),
    "log_folder": ("output", "json", "results"),
    "logdir": ("output", "json", "results"),
    "logger": ("tensorboard",),
    "lr": ("learning_rate", "policy_rate"),
    "map": ("arena",),
    "max_episode_steps": ("time_limit",),
    "max_grad_norm": ("gradient_norm",),
    "max_iterations": ("steps",),
    "max_steps": ("steps", "time_limit"),
    "max_time": ("minutes",),
    "method": ("algorithm",),
    "mjcf": ("spec", "robot"),
    "model": ("policy", "run", "spec", "robot"),
    "model_path": ("policy", "run"),
    "n_cpu": ("threads", "jobs"),
    "n_envs": ("num_envs",),
    "n_episodes": ("episodes",),
    "n_epochs": ("epochs",),
    "n_eval_episodes": ("episodes",),
    "n_jobs": ("jobs", "threads"),
    "n_steps": ("horizon", "n_step", "steps"),
    "n_threads": ("threads", "jobs"),
    "n_timesteps": ("steps",),
    "net_arch": ("hidden",),
    "nod": ("pitch",),
    "noise": ("observation_noise",),
    "none": ("in_place",),
    "num_cpus": ("threads", "jobs"),
    "num_env_steps": ("steps",),
    "num_episodes": ("episodes",),
    "num_epochs": ("epochs",),
    "num_frames": ("steps",),
    "num_iterations": ("steps",),
    "num_legs": ("legs",),
    "num_mini_batches": ("minibatch",),
    "num_minibatches": ("minibatch",),
    "num_steps": ("steps", "horizon"),
    "num_threads": ("threads", "jobs"),
    "num_timesteps": ("steps",),
    "num_workers": ("threads", "jobs"),
    "obs_noise": ("observation_noise",),
    "off": ("in_place",),
    "on": ("moving",),
    "open": ("spec",),
    "optimizer_lr": ("policy_rate", "learning_rate"),
    "out": ("output", "json", "results"),
    "outdir": ("output", "results"),
    "output": ("json", "results", "id"),
    "output_dir": ("output", "results"),
    "path": ("spec", "robot", "file"),
    "policy": ("run", "policies", "algorithm"),
    "ppo2": ("ppo",),
    "push": ("kicks",),
    "pushes": ("kicks",),
    "quadruped": ("leaper",),
    "redq": ("droq",),
    "reinforce": ("ppo",),
    "reset_noise_scale": ("base_noise",),
    "resolution": ("width",),
    "reward": ("weights",),
    "reward_scaling": ("reward_scale",),
    "reward_weights": ("weights",),
    "rewards": ("weights",),
    "rl_algorithm": ("algorithm",),
    "robot": ("spec",),
    "rough_terrain": ("rough",),
    "run": ("walk", "policy"),
    "run_name": ("output",),
    "save": ("output", "json"),
    "save_dir": ("output", "results"),
    "save_path": ("output",),
    "scene": ("arena",),
    "screenshot": ("output",),
    "seconds": ("steps", "time_limit"),
    "seed": ("random",),
    "share": ("host",),
    "side": ("profile",),
    "size": ("width", "scale"),
    "skeleton": ("skin",),
    "skinned": ("skin",),
    "spec": ("robot",),
    "speed": ("target_velocity",),
    "stand": ("walk",),
    "stand_up": ("recover",),
    "standing": ("walk",),
    "standup": ("recover",),
    "target_kl": ("final_desired_kl",),
    "target_speed": ("target_velocity",),
    "td3": ("sac",),
    "tensorboard_log": ("tensorboard",),
    "terminate_when_unhealthy": ("healthy_range",),
    "terrain": ("arena",),
    "timeout": ("minutes", "time_limit"),
    "timesteps": ("steps",),
    "total_steps": ("steps",),
    "total_timesteps": ("steps",),
    "tqc": ("sac",),
    "track": ("wandb",),
    "trainer": ("algorithm",),
    "trpo": ("ppo",),
    "true": ("moving",),
    "update_epochs": ("epochs",),
    "urdf": ("spec", "robot"),
    "velocity": ("target_velocity", "steer"),
    "video": ("output",),
    "view": ("camera",),
    "walker": ("leaper",),
    "walker2d": ("leaper",),
    "wandb_log": ("wandb",),
    "wind": ("force",),
    "workers": ("threads", "jobs"),
    "world": ("arena",),
    "xml": ("spec", "robot"),
}
_GAP_BETWEEN_NAMES = re.compile(r"[\s;+|]+")  # in place of commas
_VERSION = re.compile(r"-v\d{1,3}$")  # of Gymnasium's names

# Lower bounds between 0 and this number only exclude 0, so errors say "above 0" in place of the bound.
_MIN_NAMED_BOUND = 1e-6
_MAX_DIGITS = 20  # of an integer in a text
_MAX_QUOTE = 300  # characters
_MAX_NAMES = 4  # of a list of which an error has the first ones
_SAME_WORD = 0.9  # similarity, up to 1, of two spellings of one word
_SIMILAR_WORD = 0.66  # the same of a word with mistakes
_MAX_PATH = 80  # characters of a path `module:name` in an error
_COUNT = re.compile(r"(\d{1,20}(?:\.\d{0,20})?(?:e\d\d?)?)([km]?)", re.IGNORECASE)  # such as 1e5, 100k
_GROUPS_OF_DIGITS = re.compile(r"\d{1,3}(?:[,_' ]\d{3}){1,6}")  # such as 100,000
_FACTORS = {"": 1, "k": 1_000, "m": 1_000_000}  # of the letters after a count
_NUMBER = r"-?\d{1,20}(?:\.\d{0,20})?(?:e-?\d\d?)?"
_TWO_NUMBERS = re.compile(rf"\D{{0,3}}?({_NUMBER})(?:, *| +|-|:|\.\.)({_NUMBER})\D?", re.IGNORECASE)


def name(
    value, valid: Iterable[str], kind: str, suggestions: Iterable[str] = (), descriptions: Iterable[str] = ()
) -> str:
    """Return the value if it is a valid name.

    Args:
        value: the name.
        valid: all names that pass this check.
        kind: what the names stand for, such as "robot"; errors contain it.
        suggestions: names that the caller has already handled; errors list them as valid, too.
        descriptions: what else is valid, in words; errors list them last.

    Raises:
        ValueError: the name is not valid. The message suggests a similar valid name and lists all of them.
    """
    valid_names = list(valid)
    if isinstance(value, Hashable) and value in valid_names:  # arrays, which are not hashable, compare by element
        return value
    listed_names = [*valid_names, *suggestions]
    choices = list_choices([*listed_names, *descriptions])
    raise ValueError(f"unknown {kind} {preview(value)}{hint(value, listed_names)} {choices}")


def list_choices(names: Collection[str]) -> str:
    """Return the part of an error that lists valid names."""
    return f"(there are: {', '.join(names)})" if names else "(there are none)"


def names(what: str, value, valid: Iterable[str], kind: str) -> tuple[str, ...]:
    """Return the value as a tuple of valid names; a single name becomes a tuple of one.

    Args:
        what: the value's own name; errors begin with it.
        value: a name, or a list or tuple of names.
        valid: all valid names.
        kind: what the names stand for, such as "robot"; errors contain it.

    Raises:
        ValueError: the value is no name and no list of names, or one of the names is not valid; see `name`.
    """
    items = (value,) if isinstance(value, str) else value
    if not isinstance(items, tuple | list):
        raise ValueError(f"{what}: expected names of {kind}s, got {preview(value)}")
    if isinstance(value, str) and "," in value:
        raise ValueError(
            f"{what}: expected names of {kind}s, got {preview(value)}{_suggest(json.dumps(value.split(',')))}"
        )
    return tuple(name(item, valid, f"{kind} of {what}") for item in items)


def meanings(name: str) -> tuple[str, ...]:
    """Return a name, and the names that this suite has for it, if it is one of other libraries, or spelled like one."""
    return name, *_synonyms(name)


def _synonyms(word: str) -> tuple[str, ...]:
    if word not in SYNONYMS:
        word = next(iter(difflib.get_close_matches(word, SYNONYMS, n=1, cutoff=_SAME_WORD)), "")
    return SYNONYMS.get(word, ())


def hint(value, valid: Iterable[str]) -> str:
    """Return the part of an error that suggests a valid name; empty if there is none.

    It is the same name in other letter case, one that is almost the same, a synonym of the value, or a similar one.
    """
    valid_names = list(valid)
    text = preview(value).strip("'")
    words = _GAP_BETWEEN_NAMES.split(text)
    if len(words) > 1 and set(words) <= set(valid_names):
        return _suggest(repr(",".join(words)))
    lower_text = _VERSION.sub("", text).lower()
    synonyms = [synonym for synonym in _synonyms(lower_text) if synonym in valid_names]
    same_letters = [name for name in valid_names if str(name).lower() == lower_text]
    same_word = difflib.get_close_matches(lower_text, valid_names, n=1, cutoff=_SAME_WORD)
    similar_names = difflib.get_close_matches(text, valid_names, n=1, cutoff=_SIMILAR_WORD)
    if not similar_names:
        similar_names = difflib.get_close_matches(lower_text, valid_names, n=1, cutoff=_SIMILAR_WORD)
    is_known_synonym = lower_text in SYNONYMS
    suggestions = same_letters or same_word or (synonyms if is_known_synonym else []) or similar_names or synonyms
    return f"; did you mean {suggestions[0]!r}?" if suggestions else ""


def hint_integer(value: Any, low: int | None = None, high: int | None = None, before: str = "") -> str:
    """Return the part of an error that suggests an integer for a value such as "1e5", "100,000" or 100.0; else "".

    Args:
        value: the value in place of an integer.
        low: the smallest valid value; None for no bound.
        high: the largest valid value; None for no bound.
        before: what the suggestion begins with, such as the name of a flag.
    """
    text = f"{value}" if isinstance(value, str | float) else ""
    if _GROUPS_OF_DIGITS.fullmatch(text):
        text = re.sub(r"\D", "", text)
    match = _COUNT.fullmatch(text)
    if match is None or (isinstance(value, str) and value.isdecimal()):
        return ""
    result = float(match[1]) * _FACTORS[match[2].lower()]
    is_valid = result.is_integer() and result >= (low or 0) and result <= (MAX_SEED if high is None else high)
    return _suggest(f"{before}{int(result)}") if is_valid else ""


def _hint_span(value: Any) -> str:
    """Return the part of an error that suggests two numbers for a text such as "0.5-1.2"; else ""."""
    match = _TWO_NUMBERS.fullmatch(value) if isinstance(value, str) else None
    return "" if match is None else _suggest(f"[{match[1]}, {match[2]}]")


def _suggest(text: str) -> str:
    return f"; did you mean {text}?"


def extension(path: str | os.PathLike[str], valid: Iterable[str]) -> str:
    """Return the extension of a file to write, in lower case.

    Args:
        path: path of the file.
        valid: the valid extensions, each with its dot.

    Raises:
        ValueError: the file has another extension, or none.
    """
    suffix = Path(path).suffix.lower()
    if not suffix:
        raise ValueError(f"{path}: expected a name that ends in {', '.join(valid)}")
    return name(suffix, valid, "extension")


def seed(value) -> int:
    """Return the seed as a Python integer.

    Raises:
        ValueError: the value is not an integer from 0 to 2**32 - 1.
    """
    return integer("seed", value, 0, MAX_SEED)


def integer(what: str, value: Any, low: int, high: int | None = None) -> int:
    """Return the value as a Python integer.

    Args:
        what: the value's own name; errors begin with it.
        value: a Python or NumPy integer.
        low: the smallest valid value.
        high: the largest valid value; None for no bound.

    Raises:
        ValueError: the value is no integer (a boolean is none), or out of range.
    """
    try:
        result = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        result = None
    if result is None or result < low or (high is not None and result > high):
        bounds = f"from {low}" if high is None else f"from {low} to {high}"
        raise ValueError(f"{what}: expected an integer {bounds}, got {preview(value)}{hint_integer(value, low, high)}")
    return result


def digits(text: str) -> int | None:
    """Return the integer that decimal digits of a text write; None for another text, and for more than 20 digits.

    Python itself refuses to convert texts of thousands of digits, in words that name no setting.
    """
    return int(text) if text.isdecimal() and len(text) <= _MAX_DIGITS else None


def number(what: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    """Return the value as a float.

    Args:
        what: the value's own name; errors begin with it.
        value: a Python or NumPy number.
        low: the smallest valid value.
        high: the largest valid value.

    Raises:
        ValueError: the value is no finite number (a boolean is none), or out of range.
    """
    is_real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        result = float(value) if is_real else math.nan
    except OverflowError:  # the value is an integer above the largest float
        result = math.inf
    if not math.isfinite(result) or not low <= result <= high:
        raise ValueError(f"{what}: expected a {_describe_range(low, high)}, got {preview(value)}")
    return result


def boolean(what: str, value: Any) -> bool:
    """Return the value as a Python boolean.

    Args:
        what: the value's own name; errors begin with it.
        value: True or False, of Python or NumPy.

    Raises:
        ValueError: the value is neither.
    """
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{what}: expected true or false, got {preview(value)}")
    return bool(value)


def span(what: str, value: Any, low: float, high: float) -> tuple[float, float]:
    """Return the lower and the upper end of a range; a single number becomes both ends.

    Args:
        what: the value's own name; errors begin with it.
        value: a number, or a list or tuple of two numbers, the lower first.
        low: the smallest valid value of either end.
        high: the largest valid value of either end.

    Raises:
        ValueError: the value is neither, or an end is out of range.
    """
    try:
        first, last = value if isinstance(value, tuple | list) else (value, value)
        lower_end = number(what, first, low, high)
        upper_end = number(what, last, lower_end, high)
    except ValueError:
        raise ValueError(
            f"{what}: expected a {_describe_range(low, high)}, or two of them, the lower first, "
            f"got {preview(value)}{_hint_span(value)}"
        ) from None
    return lower_end, upper_end


def array(what: str, value: Any, size: int, low: float = -math.inf, high: float = math.inf) -> np.ndarray:
    """Return the value as (size,) floats; a single number is repeated.

    Args:
        what: the value's own name; errors begin with it.
        value: a number, or a list or array of `size` numbers.
        size: length of the result.
        low: the smallest valid number.
        high: the largest valid number.

    Raises:
        ValueError: the value has another shape, or one of its numbers is not finite or out of range.
    """
    try:
        values = np.asarray(value)
    except (ValueError, RecursionError):  # its parts have unequal lengths, or it is nested too deeply
        values = np.asarray(None)
    has_real_type = values.dtype.kind in "if"  # integers or floats
    has_valid_shape = values.shape in ((), (size,))
    is_valid = (
        has_real_type and has_valid_shape and np.isfinite(values).all() and ((low <= values) & (values <= high)).all()
    )
    if not is_valid:
        raise ValueError(f"{what}: expected one {_describe_range(low, high)} or {size} of them, got {preview(value)}")
    return np.broadcast_to(values, size).astype(float)


def numeric_kind(value: Any) -> str:
    """Return NumPy's letter for the kind of a number or an array: "b" for booleans; "O" for other values."""
    if isinstance(value, bool | int | float):
        return "b" if isinstance(value, bool) else "f"
    return getattr(getattr(value, "dtype", None), "kind", "O")


def is_numeric(value: Any) -> bool:
    """Return whether a value is a number, a boolean, or an array of them."""
    return numeric_kind(value) in "fiub"


def _describe_range(low: float, high: float) -> str:
    """Return a phrase for the numbers from `low` to `high`, such as "number from 0 to 1"."""
    if low == -math.inf:
        return "finite number"
    excludes_only_zero = 0.0 < low < _MIN_NAMED_BOUND
    if high == math.inf:
        return "finite number above 0" if excludes_only_zero else f"finite number of at least {low:g}"
    return f"number above 0, at most {high:g}" if excludes_only_zero else f"number from {low:g} to {high:g}"


def mapping(what: str, value: Any) -> Mapping[str, Any]:
    """Return the value if it is a mapping, or an empty mapping for None.

    Raises:
        ValueError: the value is neither.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ValueError(f"{what}: expected a mapping of names to values, got {preview(value)}")
    return value


def json_text(what: str, value: Any) -> str:
    """Return the value as JSON text, with the keys of mappings sorted.

    Raises:
        ValueError: the value contains something that JSON cannot represent.
    """
    try:
        return json.dumps(value, sort_keys=True)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{what}: expected values that JSON can hold: {quote(error)}") from None


def quote(value: Any) -> str:
    """Return the beginning of a value's text, in one line; for texts of unknown length, such as foreign errors."""
    return " ".join(str(value).split())[:_MAX_QUOTE]


def differences(record: Mapping, other: Mapping, prefix: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the name of each field in which two JSON-able records differ, and its values; None where it is missing.

    Mappings, lists of as many mappings and texts of JSON objects are compared field by field: `robot.legs.0.mount`.

    Args:
        record: the first record.
        other: the second one, whose fields come first.
        prefix: beginning of all names.
    """
    for field in dict.fromkeys((*other, *record)):
        value = record.get(field)
        other_value = other.get(field)
        if value == other_value:
            continue
        fields = _fields_of(value)
        other_fields = _fields_of(other_value)
        if fields is None or other_fields is None or (isinstance(value, list) and len(fields) != len(other_fields)):
            yield f"{prefix}{field}", value, other_value
        else:
            yield from differences(fields, other_fields, f"{prefix}{field}.")


def _fields_of(value: Any) -> Mapping | None:
    """Return the fields of a mapping, of a list of mappings or of the text of a JSON object; None for other values."""
    if isinstance(value, str) and value.startswith("{"):
        with contextlib.suppress(ValueError, RecursionError):
            value = json.loads(value)
    if isinstance(value, list) and value and all(isinstance(element, Mapping) for element in value):
        return dict(enumerate(value))
    return value if isinstance(value, Mapping) else None


def join_first(names: Sequence[str]) -> str:
    """Return the first names, with commas between them, and dots if there are more."""
    more = ", ..." if len(names) > _MAX_NAMES else ""
    return ", ".join(names[:_MAX_NAMES]) + more


def join_choices(names: Sequence[str]) -> str:
    """Return names with commas between them, and "or" before the last one."""
    *first_names, last_name = names
    return f"{', '.join(first_names)} or {last_name}" if first_names else last_name


def full_repr(value: Any) -> str:
    """Return `repr` of a value with all numbers of its arrays, whatever NumPy's print options are: for hashes."""
    with np.printoptions(**_DEFAULT_PRINT_OPTIONS, threshold=sys.maxsize):
        return repr(value)


def preview(value: Any) -> str:
    """Return the beginning of a value's `repr`, in one line, as errors show it. The value may be of any type."""
    try:
        return quote(repr(value))
    except Exception:  # the value is nested too deeply, or its `repr` is broken
        return f"a {type(value).__name__} that cannot be shown"


def describe_import_error(error: ImportError | SyntaxError, module: str) -> str:
    """Return why a module that a user names cannot be imported, for errors."""
    if isinstance(error, SyntaxError):
        return quote(f"{error.filename}, line {error.lineno}: {error.msg}")
    if error.name != module:  # the module imports another one, which is missing
        return quote(error)
    similar_names = difflib.get_close_matches(module, _modules_of_folder(), n=1, cutoff=_SIMILAR_WORD)
    if similar_names:
        return f"{quote(error)}{_suggest(repr(similar_names[0]))}"
    return f"{quote(error)}; start in the folder of {module[:_MAX_PATH]}.py, or put it on Python's path"


def _modules_of_folder() -> list[str]:
    """Return the names of the modules in the working directory; none if it cannot be read."""
    try:
        return sorted(path.stem for path in Path().glob("*.py"))
    except OSError:
        return []


def import_object(path: str, subject: str, resolve: Callable[[str], Any] = pkgutil.resolve_name) -> Any:
    """Import the module in `module:name`, and return the object of that name in it.

    Args:
        path: the text `module:name`.
        subject: what errors have before the path, such as "policy".
        resolve: function from the path to the object.

    Raises:
        ValueError: the module cannot be imported, is no Python, or has no such name.
    """
    module = path.partition(":")[0]
    try:
        return resolve(path)
    except (ImportError, SyntaxError) as error:
        reason = describe_import_error(error, module)
    except (ValueError, AttributeError) as error:
        suggestion = describe_other_module(module)
        if not suggestion and isinstance(error, AttributeError):
            suggestion = hint(error.name, dir(error.obj))
        reason = f"{quote(error)}{suggestion}"
    raise ValueError(f"{subject} {path[:_MAX_PATH]!r}: {reason}")


def describe_other_module(module: str) -> str:
    """Return the part of an error that says which file was imported in place of one of the current folder; else "".

    Args:
        module: name of the module, such as "wave", which Python itself has.
    """
    path = Path(f"{module[:_MAX_PATH]}.py")
    if module not in sys.modules or not path.is_file():
        return ""
    file = getattr(sys.modules[module], "__file__", None)
    if file is not None and path.resolve() == Path(file).resolve():
        return ""
    origin = "Python's own" if file is None else file
    return f"; {origin} was read, as the name of ./{path} is taken: give that file another name"
