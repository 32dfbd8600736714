"""The help of a program: its docstring, and its flags in groups."""

import re
import textwrap
from collections.abc import Iterable

from absl import flags

# Headings in their order, each with its flags. Any other flag belongs to the run.
GROUPS = {
    "Body": (
        *("robot", "spec", "legs", "links", "length", "palette", "layout", "scale"),
        *("family", "families", "around", "amount"),
    ),
    "Policy": (
        *("policy", "preset", "vecnormalize", "algorithm", "hp", "prior", "checkpoint", "quality", "noise"),
        *("compare", "compare_preset", "policies"),
    ),
    "Task": ("task", "set", "train_set", "goal"),
    "Run": (),
    "Output": (
        *("output", "json", "page", "pages", "save", "picture", "render", "summary", "visuals", "no_arena", "report"),
        *("results", "runs", "name", "id", "author", "code_permalink", "overwrite", "tensorboard"),
        *("clips", "rig", "root_motion", "straight", "plant", "triangles", "uv", "reduce"),
        *("fps", "loop", "size", "transparent", "turntable", "directions"),
    ),
    "Help": ("help", "version"),
}

_GROUP_OF = {name: heading for heading, names in GROUPS.items() for name in names}
_VALUES = {"int": "N", "float": "X", "comma separated list of strings": "A,B"}  # by absl's name; others are TEXT
_NOISE = re.compile(r"^<[^>]*>: |;\n    repeat this option to specify a list of values$")  # which absl adds
_DEFAULT = re.compile(r"\s*\[default: (.*)\]$", re.DOTALL)
_INDENT = 23  # columns before a text; a longer flag has a line of its own


def help_text(docstring: str, shown: Iterable[flags.Flag]) -> str:
    """Return a program's docstring and its flags, as text of several lines."""
    listed = {heading: [] for heading in GROUPS}
    for flag in sorted(shown, key=lambda flag: _order(flag.name)):
        listed[_GROUP_OF.get(flag.name, "Run")].append(_entry(flag))
    parts = ["\n".join([f"{heading}:", *entries]) for heading, entries in listed.items() if entries]
    return "\n\n".join([docstring.strip(), *parts])


def _order(name: str) -> tuple[int, str]:
    """Return the place of a flag in its group: that of the table, else by the alphabet."""
    names = GROUPS[_GROUP_OF.get(name, "Run")]
    return (names.index(name) if name in names else 0), name


def _entry(flag: flags.Flag) -> str:
    """Return the lines of a flag."""
    first, indent = f"  {_usage(flag)} ", " " * _INDENT
    lines = textwrap.wrap(_text(flag), flags.get_help_width() - _INDENT, break_on_hyphens=False)
    if len(first) <= _INDENT:
        first = first.ljust(_INDENT) + lines.pop(0)
    return "\n".join([first.rstrip(), *(indent + line for line in lines)])


def _usage(flag: flags.Flag) -> str:
    """Return a flag and its value, such as "-o, --output=TEXT"."""
    short = f"-{flag.short_name}, " if flag.short_name else ""
    if flag.boolean:
        return f"{short}--{'[no]' if flag.default else ''}{flag.name}"
    return f"{short}--{flag.name}={_VALUES.get(flag.flag_type(), 'TEXT')}"


def _text(flag: flags.Flag) -> str:
    """Return the help of a flag; notes in brackets say which values it takes, and the default."""
    text = _NOISE.sub("", flag.help)
    said = _DEFAULT.search(text)
    default = said[1] if said else _default(flag.default)
    repeatable = "repeatable" if isinstance(flag, flags.MultiFlag) else ""
    notes = [_values(flag.parser), repeatable, default and f"default: {default}"]
    text = _DEFAULT.sub("", text)
    return f"{text} [{'; '.join(filter(None, notes))}]" if any(notes) else text


def _values(parser: flags.ArgumentParser) -> str:
    """Return the names that a flag takes, or the numbers, such as "4 to 12"; "" for any."""
    if isinstance(parser, flags.EnumParser):
        return " or ".join(parser.enum_values)
    low, high = (getattr(parser, name, None) for name in ("lower_bound", "upper_bound"))
    if low is None:
        return ""
    return f"{low:.10g} or more" if high is None else f"{low:.10g} to {high:.10g}"


def _default(value) -> str:
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
