"""The help of a program: its docstring, and its flags in groups."""

import re
import textwrap
from collections.abc import Iterable

from absl import flags

from arc_suite import checks

_BODY_FLAGS = ("robot", "spec", "legs", "links", "length", "palette", "layout", "scale", "torso", "head", "tail")
_BODY_FAMILY_FLAGS = ("family", "families", "around", "amount")
_POLICY_FLAGS = ("policy", "preset", "vecnormalize", "algorithm", "hp", "prior", "checkpoint", "quality", "noise")
_COMPARISON_FLAGS = ("compare", "compare_preset", "policies")
_FILE_FLAGS = ("output", "json", "page", "pages", "save", "picture", "render", "summary", "visuals", "no_arena")
_REPORT_FLAGS = ("report", "results", "runs", "name", "id", "author", "code_permalink", "overwrite", "tensorboard")
_CLIP_FLAGS = ("clips", "rig", "root_motion", "straight", "plant", "triangles", "uv", "reduce")
_FILM_FLAGS = ("fps", "loop", "size", "transparent", "turntable", "directions")

# Flags by the heading of their group, in the order of the help. Other flags belong to the group "Run".
FLAGS_BY_GROUP = {
    "Body": _BODY_FLAGS + _BODY_FAMILY_FLAGS,
    "Policy": _POLICY_FLAGS + _COMPARISON_FLAGS,
    "Task": ("task", "set", "arena", "train_set", "goal"),
    "Run": (),
    "Output": _FILE_FLAGS + _REPORT_FLAGS + _CLIP_FLAGS + _FILM_FLAGS,
    "Help": ("help", "version"),
}

_GROUP_OF_FLAG = {name: heading for heading, names in FLAGS_BY_GROUP.items() for name in names}
_VALUE_OF_TYPE = {"int": "N", "float": "X", "comma separated list of strings": "A,B"}  # other types have a TEXT
_ABSL_ADDITIONS = re.compile(r"^<[^>]*>: |;\n    repeat this option to specify a list of values$")  # to the help
_DEFAULT_NOTE = re.compile(r"\s*\[default: (.*)\]$", re.DOTALL)
_INDENT = 23  # columns before the help of a flag; a longer flag has a line of its own


def help_text(docstring: str, program_flags: Iterable[flags.Flag]) -> str:
    """Return a program's docstring and its flags, as text of several lines."""
    entries_by_group: dict[str, list[str]] = {heading: [] for heading in FLAGS_BY_GROUP}
    for flag in sorted(program_flags, key=_sort_key):
        entries_by_group[_group_of(flag)].append(_entry(flag))
    groups = ["\n".join([f"{heading}:", *entries]) for heading, entries in entries_by_group.items() if entries]
    return "\n\n".join([docstring.strip(), *groups])


def _group_of(flag: flags.Flag) -> str:
    return _GROUP_OF_FLAG.get(flag.name, "Run")


def _sort_key(flag: flags.Flag) -> tuple[int, str]:
    """Return the place of a flag in its group: by the table of groups, or else by the alphabet."""
    names = FLAGS_BY_GROUP[_group_of(flag)]
    index = names.index(flag.name) if flag.name in names else 0
    return index, flag.name


def _entry(flag: flags.Flag) -> str:
    """Return the lines of a flag: its usage, and its help after an indent."""
    usage = f"  {_usage(flag)} "
    lines = textwrap.wrap(_help_with_notes(flag), flags.get_help_width() - _INDENT, break_on_hyphens=False)
    if len(usage) <= _INDENT:
        usage = usage.ljust(_INDENT) + lines.pop(0)
    return "\n".join([usage.rstrip(), *(" " * _INDENT + line for line in lines)])


def _usage(flag: flags.Flag) -> str:
    """Return a flag and its value, such as "-o, --output=TEXT"."""
    short_name = f"-{flag.short_name}, " if flag.short_name else ""
    if flag.boolean:
        negation = "[no]" if flag.default else ""
        return f"{short_name}--{negation}{flag.name}"
    value = _VALUE_OF_TYPE.get(flag.flag_type(), "TEXT")
    return f"{short_name}--{flag.name}={value}"


def _help_with_notes(flag: flags.Flag) -> str:
    """Return the help of a flag; notes in brackets say which values it takes, and the default."""
    text = _ABSL_ADDITIONS.sub("", flag.help)
    default_note = _DEFAULT_NOTE.search(text)
    default = default_note[1] if default_note else _default_text(flag.default)
    text = _DEFAULT_NOTE.sub("", text)
    notes = []
    values = _values_text(flag.parser)
    if values:
        notes.append(values)
    if isinstance(flag, flags.MultiFlag):
        notes.append("repeatable")
    if default:
        notes.append(f"default: {default}")
    return f"{text} [{'; '.join(notes)}]" if notes else text


def _values_text(parser: flags.ArgumentParser) -> str:
    """Return the names that a flag takes, or the numbers, such as "4 to 12"; "" for any."""
    if isinstance(parser, flags.EnumParser):
        return checks.join_choices(parser.enum_values)
    low = getattr(parser, "lower_bound", None)
    high = getattr(parser, "upper_bound", None)
    if low is None:
        return ""
    if high is None:
        return f"{low:.10g} or more"
    return f"{low:.10g} to {high:.10g}"


def _default_text(value) -> str:
    """Return a default as one types it; "" for none."""
    match value:
        case None | False | []:
            return ""
        case True:
            return "on"
        case list():
            return ",".join(value)
        case float():
            return f"{value:g}"
    return str(value)
