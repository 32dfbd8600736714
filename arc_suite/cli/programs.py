"""The programs of `arc-suite`, and its help; the standard library alone is imported here."""

import ast
import functools
from importlib import metadata
from pathlib import Path
from types import ModuleType

# Group of entry points, by which installed packages name a program and the module whose import registers it.
ENTRY_POINT_GROUP = "arc_suite.programs"

# The package of each program. Nothing else of the core names packages of animation and learning.
PROGRAMS = {
    "build_model": "arc_suite.cli",
    "import": "arc_suite.cli",
    "check": "arc_suite.cli",
    "render": "arc_suite.animation.cli",
    "animate": "arc_suite.animation.cli",
    "motion": "arc_suite.cli",
    "play": "arc_suite.animation.cli",
    "view": "arc_suite.animation.cli",
    "studio": "arc_suite.animation.cli",
    "settings": "arc_suite.cli",
    "evaluate": "arc_suite.cli",
    "style": "arc_suite.animation.cli",
    "collect": "arc_suite.cli",
    "train": "arc_suite.learning.cli",
    "study": "arc_suite.learning.cli",
    "benchmark": "arc_suite.learning.cli",
    "export": "arc_suite.learning.cli",
    "card": "arc_suite.learning.cli",
    "transfer": "arc_suite.learning.cli",
    "design": "arc_suite.animation.cli",
    "doctor": "arc_suite.cli",
    "completion": "arc_suite.cli",
}

# Where the names are that a flag takes, and that a program takes as its argument; completion alone imports them.
NAMES_OF_FLAGS = {
    "algorithm": "arc_suite.learning.agents.algorithms:ALGORITHMS",
    "clips": "arc_suite.animation.clips:CLIPS",
    "rig": "arc_suite.animation.clips:RIGS",
    "root_motion": "arc_suite.animation.clips:ROOT_MOTIONS",
}
NAMES_OF_ARGUMENTS = {"benchmark": "arc_suite.learning.studies.divisions:DIVISIONS"}

# Further first arguments, and what they do.
WORDS = {"help": "Show the programs, or the flags of a program.", "version": "Print the version and the folder."}

# Former programs, and what to run in place of each.
FORMER_PROGRAMS = {
    "survey": "a clone has python tools/survey.py",
    "tune_cpg": "a clone has python tools/tune_cpg.py",
    "enter": "the leaderboard is made of committed studies, by python tools/study.py NAME --report in a clone",
}

# What to run where a word is no program.
CURES_OF_WORDS = {
    "build": "did you mean build_model?",
    "convert": "did you mean export, of a policy, or import, of a robot?",
    "dataset": "did you mean collect?",
    "datasets": "did you mean collect?",
    "demo": "did you mean play or studio?",
    "gui": "did you mean play or studio?",
    "leaderboard": "did you mean benchmark?",
    "learn": "did you mean train?",
    **dict.fromkeys(("list", "robots", "tasks"), "arc-suite evaluate --help lists robots and tasks"),
    "run": "did you mean train?",
    "simulate": "did you mean view or render?",
    "test": "did you mean doctor or check?",
    "video": "did you mean render?",
}

_USAGE = """\
arc-suite PROGRAM [flags]

{programs}

arc-suite help PROGRAM shows the flags of a program, arc-suite version the version and the folder.
arc-suite MODULE:NAME runs a program that another package registers."""


def usage() -> str:
    """Return the help of `arc-suite`; no program is imported for it."""
    summaries = {name: program_summary(name) for name in PROGRAMS}
    for name, entry_point in installed_programs().items():
        summaries[name] = f"of the package {entry_point.dist.name}"
    width = max(len(name) for name in summaries)
    lines = [f"  {name:<{width}}  {text}" for name, text in summaries.items()]
    return "\n".join([_USAGE.format(programs="\n".join(lines)), *_describe_hidden_programs()])


def installed_programs() -> dict[str, metadata.EntryPoint]:
    """Return the entry points of programs of installed packages by name; of one name the first package in the alphabet.

    Those of the suite's names are left out.
    """
    programs: dict[str, metadata.EntryPoint] = {}
    for entry_point in _entry_points():
        if entry_point.name not in PROGRAMS:
            programs.setdefault(entry_point.name, entry_point)
    return programs


@functools.cache
def _entry_points() -> list[metadata.EntryPoint]:
    """Return the entry points of programs of all packages, packages in the order of the alphabet."""
    return sorted(metadata.entry_points(group=ENTRY_POINT_GROUP), key=lambda entry_point: entry_point.dist.name)


def _describe_hidden_programs() -> list[str]:
    """Return a line for each installed program whose name runs another one."""
    package_of_program = {name: entry_point.dist.name for name, entry_point in installed_programs().items()}
    lines = []
    for entry_point in _entry_points():
        name = entry_point.name
        if entry_point.dist.name != package_of_program.get(name):
            line = f"{name} of the package {entry_point.dist.name} has the name of another program; run it as"
            lines.append(f"{line} arc-suite {entry_point.module}:{name}.")
    return lines


def program_summary(name: str) -> str:
    """Return the first line of a program's docstring, read from its source without importing it."""
    return _read_docstring(source_path(name)).splitlines()[0]


def source_path(name: str) -> Path:
    """Return the path of a program's module."""
    top_folder = Path(__file__).parents[2]  # that of the package arc_suite
    return top_folder.joinpath(*PROGRAMS[name].split("."), f"{name}.py")


def docstring_of(module: ModuleType) -> str:
    """Return the docstring of a program's module, "" for none; from its file where Python dropped it."""
    if module.__doc__ is None and getattr(module, "__file__", None):
        return _read_docstring(Path(module.__file__))
    return module.__doc__ or ""


def _read_docstring(path: Path) -> str:
    """Return the docstring of a module's source; "" for none."""
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
