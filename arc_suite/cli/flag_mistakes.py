"""Answers to flags that a program does not have, and to arguments that belong into a flag."""

import dataclasses
import itertools
import os
import pkgutil
import re
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from absl import flags

from arc_suite import checks, policies, registry
from arc_suite.cli.flag_cures import (
    CURES,
    CURES_OF_MISSING_VALUES,
    CURES_OF_OUTPUTS,
    CURES_OF_PROGRAMS,
    CURES_OF_VALUES,
)
from arc_suite.cli.programs import NAMES_OF_FLAGS
from arc_suite.tasks import TASKS

DASHES = "-\u2013\u2014"  # also those that word processors write in place of two

_FLAG = re.compile(r"--?([a-z_]+)(?:=.*)?", re.DOTALL)
_BARE_KEY = re.compile(r"([{,]\s*)([a-z_]\w*)(\s*:)")  # a name in braces, without its quotes
_MISSING_VALUE = re.compile(r"Missing value for flag (\S+)")  # words of absl
_DATASET_ID = re.compile(r"[\w.-]+(?:/[\w.-]+)+-v\d+")
_BRACKETS = {"{": "}", "[": "]"}

_POLICY_EXTENSIONS = (".npz", ".zip")
_SEVERAL = re.compile(r"\bcommas\b|\ball\b|\bseveral\b")  # in the help of a flag whose text may be a list

# What shows files that no program of the suite shows, by extension.
_VIEWERS = {
    ".glb": "Blender, Godot and other programs show a .glb: see docs/engines.md",
    ".html": "a browser shows a page",
}

# Names of flags that may mean several of ours: the value says which.
_VAGUE_NAMES = ("agent", "controller", "file", "filename", "input", "load", "method", "model", "name", "path", "type")
# What letters mean in many programs of others; no suggestion destroys files.
_NAMES_OF_LETTERS = {"n": "episodes", "o": "output"}
_DESTRUCTIVE_FLAGS = ("overwrite",)
# Flags of which users expect all values, where the last one holds, and the programs that show one creature.
_FLAGS_OF_ONE = ("robot", "spec")
_PROGRAMS_OF_ONE = ("animate", "play", "render", "studio", "view")


def refuse_unknown(
    error: flags.UnrecognizedFlagError,
    program: str,
    names: Sequence[str],
    arguments: Sequence[str],
    parameters: Sequence[str],
) -> None:
    """Raise ValueError for a flag that the program does not have, with what to write in place of it.

    Args:
        error: that of absl.
        program: name of the program, without arc-suite.
        names: names of the flags of the program.
        arguments: those of the command line.
        parameters: names of the arguments of the program that are no flags.
    """
    name = error.flagname
    _, _, value = error.flagvalue.partition("=")
    cure = CURES_OF_PROGRAMS.get(program, {}).get(name)
    if cure is not None:
        raise ValueError(f"unknown flag {checks.preview(name)}; {cure}") from None
    value = value or _value_of(arguments, name)
    _refuse_value_as_name(name)
    _refuse_step_of_checkpoint(name, value, arguments, names)
    _refuse_name_of_value(name, value, names)
    if len(name) == 1:
        _refuse_letter(name, names)
    _refuse_name_of_argument(name, value, parameters)
    flag_of_value = _flag_that_takes(value) if name in _VAGUE_NAMES else ""
    if flag_of_value:
        cure = f"did you mean --{flag_of_value}={checks.quote(value)}?"
        raise ValueError(f"unknown flag {checks.preview(name)}; {cure}") from None
    cures = CURES | (CURES_OF_OUTPUTS if "output" in names else {})
    if name in cures:
        raise ValueError(f"unknown flag {checks.preview(name)}; {cures[name]}") from None
    checks.name(name, names, "flag")  # raises a ValueError that suggests a name


def refuse_value(error: flags.IllegalFlagValueError) -> None:
    """Raise ValueError for a value that its flag does not take, with what the flag takes."""
    flag_and_value = str(error).removesuffix(f": {error.__context__}")  # flag --NAME=VALUE
    name, _, value = flag_and_value.removeprefix("flag --").partition("=")
    parser = flags.FLAGS[name].parser
    choices = getattr(parser, "enum_values", ("true", "false"))
    expected = parser.syntactic_help or checks.join_choices(choices)
    hint = ""
    host, colon, port = value.rpartition(":")
    if name == "port" and colon and port.isdecimal():
        hint = f"; did you mean --host={checks.quote(host.strip('[]'))} --port={port}?"
    elif isinstance(parser, flags.IntegerParser):
        hint = checks.hint_integer(value, parser.lower_bound, parser.upper_bound, before=f"--{name}=")
    if (name, value) in CURES_OF_VALUES:
        hint = f"; {CURES_OF_VALUES[name, value]}"
    raise ValueError(f"{checks.quote(flag_and_value)}: expected {expected}{hint}") from None


def refuse_missing_value(error: flags.Error) -> None:
    """Raise ValueError for a flag without its value; `error` is that of absl."""
    match = _MISSING_VALUE.match(str(error))
    if match is not None:
        cure = CURES_OF_MISSING_VALUES.get(match[1].lstrip("-"))
        raise ValueError(f"{match[1]}: expected a value, got none{f'; {cure}' if cure else ''}") from None


def refuse_flag_as_value(flag: flags.Flag) -> None:
    """Raise ValueError for a flag without its value that has taken the next flag as its value."""
    for text in flag.value if isinstance(flag.value, list) else [flag.value]:
        match = _FLAG.fullmatch(text) if isinstance(text, str) else None
        if match and match[1] in flags.FLAGS:
            cure = CURES_OF_MISSING_VALUES.get(flag.name)
            hint = f"; {cure}" if cure else ""
            raise ValueError(f"--{flag.name}: expected a value, got the flag {checks.quote(text)}{hint}")


def warn_of_repeated_flags(program: str, arguments: Sequence[str]) -> None:
    """Warn of a flag such as --spec that stands twice with different values, of which the last one holds.

    Only programs that show one creature do so: others are started with flags behind those of another program.

    Args:
        program: name of the program, without arc-suite.
        arguments: those of the command line.
    """
    for name in _FLAGS_OF_ONE if program in _PROGRAMS_OF_ONE else ():
        values = []
        for argument, next_argument in itertools.pairwise([*arguments, ""]):
            flag, equals, value = argument.partition("=")
            if flag == f"--{name}":
                values.append(value if equals else next_argument)
        if len(set(values)) > 1:
            warnings.warn(
                f"--{name}: {len(values)} values; the last one holds, {checks.quote(values[-1])}", stacklevel=2
            )


def refuse_argument(arguments: Sequence[str], positional_arguments: Sequence[str], parameter_count: int) -> NoReturn:
    """Raise ValueError for an argument without a flag that is too many, with the flag that it may belong to.

    Args:
        arguments: those of the command line.
        positional_arguments: those of them that are no flags and no values of flags, by absl.
        parameter_count: number of arguments without a flag that the program takes.
    """
    argument = positional_arguments[parameter_count]
    suggestion = _suggest_list(arguments, positional_arguments, parameter_count) or _suggest_flag(argument)
    if parameter_count and not suggestion:
        suggestion = "it takes one at a time; "
    raise ValueError(f"unexpected argument {checks.preview(argument)}; {suggestion}see --help")


def _refuse_value_as_name(name: str) -> None:
    """Raise ValueError for a flag that is the name of a policy, a task or the like, such as --ppo."""
    flag = _flag_that_lists(name)
    if flag:
        raise ValueError(f"unknown flag {checks.preview(name)}; did you mean --{flag}={name}?")


def _refuse_step_of_checkpoint(name: str, value: str, arguments: Sequence[str], flag_names: Sequence[str]) -> None:
    """Raise ValueError for the step of a checkpoint in a program that takes the checkpoint's folder as a policy."""
    if name in ("checkpoint", "ckpt", "step") and value.isdecimal() and "policy" in flag_names:
        run = _value_of(arguments, "policy") or "RUN"
        raise ValueError(
            f"unknown flag {checks.preview(name)}; did you mean --policy={checks.quote(run)}/checkpoints/{value}?"
        )


def _refuse_letter(letter: str, flag_names: Sequence[str]) -> None:
    """Raise ValueError for a letter that is no short name, with the flag that it means, or those that it begins."""
    meanings = [name for name in checks.meanings(_NAMES_OF_LETTERS.get(letter, letter)) if name in flag_names]
    harmless_names = [name for name in flag_names if name not in _DESTRUCTIVE_FLAGS]
    suggestions = meanings[:1] or [name for name in harmless_names if name[0] == letter]
    if suggestions:
        long_names = " or ".join(f"--{name}" for name in suggestions)
        raise ValueError(f"unknown flag '-{letter}'; did you mean {long_names}?")


def _refuse_name_of_value(name: str, value: str, flag_names: Sequence[str]) -> None:
    """Raise ValueError for a flag that is the name of a setting or of a hyperparameter, with the flag that takes it."""
    words_of_flags = {
        "set": registry.setting_names() - {"random"},  # programs seed episodes by flags of their own
        "hp": hyperparameter_words(),
    }
    meanings = checks.meanings(name)
    if any(meaning in flag_names for meaning in meanings):
        return
    suggestions = [
        f"--{flag} {meaning}={checks.quote(value) or 'VALUE'}"
        for flag, words in words_of_flags.items()
        for meaning in meanings
        if flag in flag_names and meaning in words
    ]
    if suggestions:
        raise ValueError(f"unknown flag {checks.preview(name)}; did you mean {' or '.join(suggestions)}?")


def hyperparameter_words() -> set[str]:
    """Return the names of the hyperparameters of all algorithms; none in a program without --hp."""
    if "hp" not in flags.FLAGS:
        return set()
    return {
        field.name for algorithm in _algorithms().values() for field in dataclasses.fields(algorithm.hyperparameters)
    }


def algorithm_names() -> tuple[str, ...]:
    """Return the names of all algorithms."""
    return tuple(_algorithms())


def _algorithms() -> Mapping[str, Any]:
    """Return all algorithms by name; no program of the core imports them before a mistake."""
    return pkgutil.resolve_name(NAMES_OF_FLAGS["algorithm"])


def _refuse_name_of_argument(name: str, value: str, parameters: Sequence[str]) -> None:
    """Raise ValueError for a flag that is the name of an argument without a flag."""
    for meaning in checks.meanings(name):
        if meaning in parameters:
            argument = f": {checks.quote(value)}" if value else ""
            raise ValueError(
                f"unknown flag {checks.preview(name)}; the {meaning} is an argument without a flag{argument}"
            )


def _value_of(arguments: Sequence[str], name: str) -> str:
    """Return what may be the value of a flag: the text behind its =, or the next argument if it is no flag; else ""."""
    for flag, value in itertools.pairwise([*arguments, ""]):
        if flag.startswith(f"--{name}="):
            return flag.partition("=")[2]
        if flag in (f"--{name}", f"-{name}"):
            return "" if value[:1] in DASHES else value
    return ""


def _suggest_list(arguments: Sequence[str], positional_arguments: Sequence[str], parameter_count: int) -> str:
    """Return a question for a flag whose several values have spaces between them, such as --clips walk idle.

    Args:
        arguments: those of the command line.
        positional_arguments: those of them that are no flags and no values of flags, by absl.
        parameter_count: number of arguments without a flag that the program takes.

    Returns:
        "" where no flag with several values comes before the first argument that is too many.
    """
    end = start = arguments.index(positional_arguments[parameter_count])
    while start > 0 and arguments[start - 1][:1] not in DASHES:
        start -= 1
    while end < len(arguments) and arguments[end][:1] not in DASHES:
        end += 1
    name, equals, value = arguments[start - 1].lstrip("-").replace("-", "_").partition("=")
    if start == 0 or name not in flags.FLAGS or flags.FLAGS[name].boolean:
        return ""
    values = [value] * bool(equals) + list(arguments[start:end])
    arguments_elsewhere = len(positional_arguments) - (len(values) - 1)
    arguments_behind = max(0, parameter_count - arguments_elsewhere)
    return _join_values(flags.FLAGS[name], values[: len(values) - arguments_behind])


def _join_values(flag: flags.Flag, values: Sequence[str]) -> str:
    """Return a question for several values of a flag; "" if it takes one value."""
    if isinstance(flag, flags.MultiFlag):
        return _join_settings(flag.name, values)
    if isinstance(flag.parser, flags.IntegerParser | flags.FloatParser):
        return ""
    if not isinstance(flag.parser, flags.ListParser) and _SEVERAL.search(flag.help) is None:
        return ""
    if any(_is_name_of_another_flag(text, flag) for text in values):
        return ""
    list_text = ",".join(text.strip(",") for text in values if text.strip(","))
    return f"did you mean --{flag.name}={list_text}? a list has commas and no spaces; "


def _is_name_of_another_flag(text: str, flag: flags.Flag) -> bool:
    """Return whether a text is a task, a policy or an algorithm behind a flag of others, as in --robot tick walk."""
    is_name = text in (*TASKS, *policies.POLICIES) or _is_in_help("algorithm", text)
    return is_name and not _is_in_help(flag.name, text)


def _join_settings(flag_name: str, values: Sequence[str]) -> str:
    """Return a question for several settings, or for one whose value a shell has split at its spaces; else ""."""
    if all("=" in text for text in values):
        return f"did you mean {' '.join(f'--{flag_name} {text}' for text in values)}? "
    if len(values) == 2 and not any("=" in text for text in values):
        return f"did you mean --{flag_name} {'='.join(values)}? "
    setting = " ".join(values)
    name, equals, value = setting.partition("=")
    if equals and _BRACKETS.get(value[:1]) == value[-1:]:
        quoted_keys = _BARE_KEY.sub(r'\1"\2"\3', value)  # a shell drops these quotes, too
        return f"did you mean --{flag_name} '{name}={quoted_keys}'? a shell splits at spaces without quotes; "
    return ""


def _suggest_flag(argument: str) -> str:
    """Return a question for the flag that an argument may be the value of; "" if the program has no such flag."""
    name, equals, value = argument.lstrip(DASHES).partition("=")
    if name in flags.FLAGS and (equals or argument[0] in DASHES):
        return f"did you mean --{name}{equals}{value}? "
    extension = os.path.splitext(argument)[1].lower()
    if extension in _VIEWERS and os.path.exists(argument):
        return f"{_VIEWERS[extension]}; "
    flag = _flag_that_takes(argument)
    return f"did you mean --{flag}={argument}? " if flag else ""


def _flag_that_takes(value: str) -> str:
    """Return the name of the flag of the program whose value a text may be, a name or a path; "" for none."""
    extension = os.path.splitext(value)[1].lower()
    flag_takes_path = {
        "spec": extension in (".json", *registry.READERS),
        "policy": os.path.isdir(value) or extension in _POLICY_EXTENSIONS,
        "verify": _DATASET_ID.fullmatch(value) is not None,
        "output": extension != "" and not os.path.exists(value),
    }
    return _flag_that_lists(value) or _first_flag(flag_takes_path)


def _flag_that_lists(word: str) -> str:
    """Return the name of the flag of the program that has a word among its values; "" for none."""
    flag_has_word = {
        "robot": word in registry.robot_words(),
        "task": word in TASKS,
        "algorithm": _is_in_help("algorithm", word),
        "policy": word in policies.POLICIES,
        "preset": word in policies.preset_names(),
    }
    return _first_flag(flag_has_word)


def _first_flag(is_suitable: Mapping[str, bool]) -> str:
    """Return the first suitable flag that the program has; "" for none."""
    return next((flag for flag, suitable in is_suitable.items() if suitable and flag in flags.FLAGS), "")


def _is_in_help(flag_name: str, word: str) -> bool:
    """Return whether the help of a flag lists a word, as it lists names; False without the flag."""
    return flag_name in flags.FLAGS and word in re.findall(r"[\w-]+(?=[,.:;]| or )", flags.FLAGS[flag_name].help)
