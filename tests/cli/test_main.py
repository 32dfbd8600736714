"""The command `arc-suite`, and `python -m arc_suite`, which is the same."""

import configparser
import functools
import os
import pathlib
import re
import subprocess
import sys

import interpreters
import programs
import pytest

import arc_suite
from arc_suite.cli import main
from arc_suite.cli.flag_names import flag_names
from arc_suite.cli.help_text import FLAGS_BY_GROUP
from arc_suite.cli.programs import FORMER_PROGRAMS, WORDS, program_summary
from arc_suite.policies import POLICIES

ROOT = pathlib.Path(__file__).parents[2]
FIRST_WORDS = [*main.PROGRAMS, *WORDS]
COMMIT = subprocess.run(
    ["git", "-C", ROOT, "rev-parse", "HEAD"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
).stdout
WITHOUT_TASK = {"import", "motion", "play", "study", "benchmark", "card", "doctor", "completion"}
WRITING = (
    "build_model",
    "import",
    "render",
    "animate",
    "motion",
    "play",
    "style",
    "train",
    "export",
    "transfer",
    "design",
)


def run(*arguments):
    return programs.run("-m", "arc_suite", *arguments)


@pytest.mark.parametrize("arguments", [(), ("--help",), ("-h",), ("help",)])
def test_help_lists_the_programs(arguments):
    lines = programs.passed(run(*arguments)).splitlines()
    assert lines[0] == "arc-suite PROGRAM [flags]"
    assert [line.split()[0] for line in lines if line.startswith("  ")] == list(main.PROGRAMS)
    assert "  study        Make the runs of a study, or write its report." in lines
    assert max(map(len, lines)) <= 100


def test_every_program_is_listed():
    folder = ROOT / "arc_suite"
    programs = {
        path.stem: ".".join(path.relative_to(ROOT).parent.parts)
        for path in folder.rglob("cli/*.py")
        if "\ndef main(" in path.read_text()
    }
    assert programs == {"main": "arc_suite.cli"} | main.PROGRAMS


# Python drops docstrings; each program is a fork, as programs define the same flags.
_HELP_WITHOUT_DOCSTRINGS = """
import os, sys
import arc_suite.cli.flags
from arc_suite.cli import main
for name in sys.argv[1:]:
    child = os.fork()
    if not child:
        main.main(name, "--help")
    _, status = os.waitpid(child, 0)
    assert status == 0, name
main.main("--help")
"""


@pytest.mark.release
def test_help_needs_no_docstrings():
    programs_that_import = [name for name in main.PROGRAMS if name not in ("studio", "view")]
    code = _HELP_WITHOUT_DOCSTRINGS.replace("sys.argv[1:]", repr(programs_that_import))
    code = f"import sys; sys.argv = sys.argv[:1]\n{code}"
    lines = interpreters.printed(code, options=["-OO"], PYTHONDONTWRITEBYTECODE="1")
    assert lines.count("Help:") == len(programs_that_import)
    for name in programs_that_import:
        assert program_summary(name) in lines


@pytest.mark.parametrize("arguments", [("--version",), ("version",), ("-V",), ("train", "-V")])
def test_version_folder_and_commit(arguments):
    text, _, commit = programs.passed(run(*arguments)).partition(", commit ")
    assert text.strip() == f"arc_suite {arc_suite.__version__}, {ROOT}"
    assert bool(commit) == bool(COMMIT) and COMMIT.startswith(commit.strip().removesuffix("-dirty"))


@pytest.mark.parametrize("word", ["help", "--help", "-h"])
def test_help_of_a_program_by_a_word(word):
    assert programs.passed(run(word, "evaluate")) == help_of("evaluate")


def test_help_of_an_unknown_program_is_one_line():
    programs.refused(run("help", "evalute"), "arc-suite: unknown program 'evalute'; did you mean 'evaluate'? (there")


@pytest.mark.parametrize(("argument", "near"), [("rendr", "render"), ("studys", "study"), ("stile", "style")])
def test_an_unknown_program_is_one_line_with_the_nearest(argument, near):
    line = f"arc-suite: unknown program {argument!r}; did you mean {near!r}? (there are: {', '.join(FIRST_WORDS)})\n"
    programs.refused(run(argument, "--robot=queen"), line)


@pytest.mark.parametrize("name", FORMER_PROGRAMS)
def test_a_former_program_says_what_to_run_instead(name):
    programs.refused(run(name, "--help"), f"arc-suite: {name} is no program any more; {FORMER_PROGRAMS[name]}\n")
    (tool,) = re.findall(r"python (tools/\w+\.py)", FORMER_PROGRAMS[name])
    assert name not in main.PROGRAMS and (ROOT / tool).is_file()


def test_only_the_program_that_runs_is_imported():
    code = (
        "import sys; from arc_suite.cli import main; sys.argv[1:] = ['doctor', '--version']\n"
        "try: main.main()\n"
        "finally: print(sorted(name for name in sys.modules if name.startswith('arc_suite.cli.')))"
    )
    names = [
        f"arc_suite.cli.{name}"
        for name in (
            "doctor",
            "flag_cures",
            "flag_mistakes",
            "help_text",
            "interrupts",
            "main",
            "places",
            "program",
            "programs",
            "version",
        )
    ]
    assert interpreters.printed(code)[1:] == [f"{names}"]


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"]])
def test_the_console_script_shows_help_without_heavy_imports(arguments):
    code = (
        f"import sys; sys.argv[1:] = {arguments}; import arc_suite_command; arc_suite_command.main()\n"
        "sys.exit(str([name for name in ('numpy', 'mujoco', 'arc_suite') if name in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == (run("--help").stdout, "[]\n")


def test_the_console_script_runs_programs():
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg")
    assert config["options.entry_points"]["console_scripts"].strip() == "arc-suite = arc_suite_command:main"
    code = "import sys; sys.argv[1:] = ['rendr']; import arc_suite_command; arc_suite_command.main()"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    programs.refused(done, run("rendr").stderr)


def test_modules_of_the_current_folder_come_last(tmp_path):
    """A policy there is found by its name; files there hide neither registered names nor installed modules."""
    for hidden in ("queen", "walk", "minari", "arc_suite"):
        (tmp_path / f"{hidden}.py").write_text("raise SystemExit('imported from the current folder')\n")
    (tmp_path / "pol.py").write_text("def make(robot):\n    return lambda timestep: [0.0] * 18\n")
    evaluate = ("evaluate", "--robot=queen", "--task=walk", "--episodes=1", "--set=time_limit=0.5")
    programs.passed(programs.arc_suite(*evaluate, "--policy=pol:make", cwd=tmp_path))
    assert programs.arc_suite("collect", "--verify=a/b-v0", cwd=tmp_path).stderr.startswith("arc-suite collect: ")
    done = programs.arc_suite(*evaluate, "--policy=lop:make", cwd=tmp_path)
    programs.refused(
        done, "arc-suite evaluate: policy 'lop:make': No module named 'lop'; start in the folder of lop.py, or "
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "extra", "command", "needed"),
    [
        ("minari", "learn", "study --help", "studies need JAX, Minari and matplotlib"),
        ("minari", "data", "collect --episodes=1", "datasets need Minari"),
        ("minari", "data", "style --policy=arc_suite/tick/noisy-v0", "datasets need Minari"),
        ("matplotlib", "animate", "style --output=pictures", "pictures need matplotlib"),
        ("imageio_ffmpeg", "video", "render --steps=1 --output=a.mp4", "MP4 needs imageio-ffmpeg"),
        ("viser", "animate", "studio --robot=tick", "the studio needs viser"),
        ("submitit", "learn", "study top-ppo --submit=2", "--submit needs submitit"),
        ("jax", "learn", "train", "training needs JAX"),
    ],
)
def test_without_an_extra_a_line_says_what_to_install(tmp_path, monkeypatch, module, extra, command, needed):
    monkeypatch.chdir(tmp_path)
    sbatch = tmp_path / "sbatch"  # SLURM's, which is asked for before the extra
    sbatch.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    program, *flags = command.split()
    line = f"arc-suite {program}: {needed}: {programs.install(extra)} (No module named '{module}')\n"
    programs.refused(programs.without(module, tmp_path, program, *flags), line)


@functools.cache
def help_of(program):
    return programs.passed(run(program, "--help"))


@pytest.mark.parametrize("program", main.PROGRAMS)
def test_help_of_a_program(program):
    text = help_of(program)
    assert text.startswith(f"{program_summary(program)}\n\n")
    assert f"\n  arc-suite {program}" in text
    names = re.findall(r"^  (?:-., )?(--\w+)", text, re.MULTILINE)
    headings = re.findall(r"^(\w+):$", text, re.MULTILINE)
    assert headings == [each for each in FLAGS_BY_GROUP if each in headings] and "--version" in names
    assert ("\n  -o, --output=TEXT" in text) == (program in WRITING)
    assert "\n  --output" not in text
    assert not re.search(r"repeat this option|\(default|integer", text)
    assert {"--task", "--set"} & set(names) == (set() if program in WITHOUT_TASK else {"--task", "--set"})


@pytest.mark.parametrize("program", main.PROGRAMS)
def test_flags_are_read_from_the_source_of_a_program(program):
    usages = re.findall(r"^  (?:-(.), )?--(?:\[no\])?(\w+)(=?)", help_of(program), re.MULTILINE)
    flags = {(name, short_name, bool(equals)) for short_name, name, equals in usages}
    assert set(flag_names(program)) - {("seeds", "", True)} == flags - {
        ("seeds", "", True)
    }  # an alias, which has no help


def test_help_says_what_each_policy_is():
    text = " ".join(help_of("evaluate").split("--policy=TEXT")[1].split())
    assert [name for name in POLICIES if not re.search(rf"\b{name}, \w+ ", text)] == []


@pytest.mark.parametrize("program", main.PROGRAMS)
def test_errors_of_a_program_name_it(program):
    taking = ("check", "import", "motion", "export", "card", "study", "benchmark", "completion")  # an argument
    done = run(program, *(["--", "a.json"] if program in taking else []), "stray")
    cure = "it takes one at a time; " if program in taking else ""
    programs.refused(done, f"arc-suite {program}: unexpected argument 'stray'; {cure}see --help\n")


@pytest.mark.parametrize(
    ("argument", "flag"), [("tick", "--robot=tick"), ("steer", "--task=steer"), (".", "--policy=.")]
)
def test_an_argument_without_its_flag_is_one_line_with_the_flag(argument, flag):
    done = run("evaluate", argument)
    line = f"unexpected argument {argument!r}; did you mean {flag}? see --help"
    programs.refused(done, f"arc-suite evaluate: {line}\n")


def test_the_tool_is_the_program():
    assert programs.passed(programs.run(ROOT / "tools" / "build_model.py", "--help")) == help_of("build_model")
