"""Identifiers, flags, columns and keys use the field's words, not those that the suite had for itself."""

import ast
import csv
import json
import pathlib
import re

import programs
import pytest

from arc_suite.cli import main

ROOT = pathlib.Path(__file__).parents[2]

# Words that no identifier has as one of its parts, and the field's word in their place.
_FORBIDDEN = """
row: environment, hyperparameters or run; rows: num_envs, mask, indices or runs; numbers: parameters or
hyperparameters; averaging: tau; trace: gae_lambda; random_steps: start_steps; updates_per_step: utd_ratio; capacity:
buffer_size; first_divergence: initial_desired_kl; last_divergence: final_desired_kl; first_std: initial_std;
last_std: final_std; mirrored: symmetry_augmentation; normalizing: normalize_until; warm_up: value_warm_up; imitation:
dagger; cloning: bc; fenced: protected; beside: symmetric_sampling; stage: run context; felt: proprioception;
following: feedback; manner, tread, balance, plan, build: parameters; look, looks: visuals; mark: debug marker; marks:
debug markers; footfalls, events: foot contact events; shot, take: recording; lift: spawn clearance;
carry: stream state; limp: actuator_failure; without: exclude_blocks; wanted: desired; wrong_feet: contact
schedule errors; way: displacement or path; tent: triangular; census: survey; obedience: command tracking; judge:
evaluator; grade, graded: quality; figures: metrics; fitted: settings_for; scene: prepare
"""
FORBIDDEN = {
    word: better
    for words, better in (line.split(": ") for line in " ".join(_FORBIDDEN.split()).split("; "))
    for word in words.split(", ")
}

# Where a word has its ordinary meaning: a pattern of the whole place, such as `arc_suite.models.builder build`.
ALLOWED = {
    "rows": r"cli\.style\.print_table\(\) rows$",  # of a printed table
    "row": r"\.append\(\) row$|cli\.evaluate row$|cli\.evaluate\.row\(\)",  # of a printed or written table
    "numbers": r"\.chain\(\) numbers$",  # drawn uniformly
    "mirrored": r"robots\.spec|models\.",  # a part of a body, placed on both sides
    "following": r"agents\.",  # the next observations of a transition
    "build": r"models\.builder build$|build_model",  # a model from a spec
    "plan": r"\(\) plan$",  # a path around obstacles
    "balance": r"\.(Balanced|Stepping) balance$",  # steps that keep a body from falling
    "trace": r"\.leg_networks trace_shared_layers$",  # records the operations of a function
    "events": r"cli\.train events$",  # files of TensorBoard
    "lift": r"cpg\.|models\.stride|LIFT_OFF$",  # height of a foot in swing; the end of a stance
    "limp": r" Limp$|^README|^studies",  # the task
    "fitted": r"arenas\.|models\.stride|tasks\.fitting",  # sizes and parameters that are fitted to a body
    "warm_up": r"value_warm_up$",  # the field's word
    "cloning": r" BehaviorCloning$",  # what bc abbreviates
    # Arena and body of a task; lights and floor of a picture; arguments that wrappers of others hand on.
    "scene": r"tasks scene$|tasks\.|models\.|task_view\.|mjx\.Env\.render",
}


def assert_plain(names):
    """Assert that none of `names`, as (place, identifier), has a forbidden word."""
    found = []
    for place, name in names:
        parts = "_".join(re.findall(r"[A-Z]?[a-z\d]+|[A-Z]+(?![a-z])", name)).lower()
        for word, better in FORBIDDEN.items():
            here = re.search(rf"(?<![a-z\d]){word}(?![a-z\d])", parts)
            if here and not re.search(ALLOWED.get(word, r"(?!)"), f"{place} {name}"):
                found.append(f"{place} {name}: {word}, use {better}")
    assert not found, "\n".join(["", *found])


# Phrases that no text has, and plainer ones.
PHRASES = {
    "whoever": "name who",
    "likewise": "say it again",
    "but for": "except, without",
    "to the bit": "bit-exactly",
    "what is asked": "the command, the task",
    "are told": "are given",
    "beside": "next to, in addition to, against",
    "; one line": "nothing: docs/contributing.md says it for all errors",
}


def test_plain_sentences():
    """In prose of the package, its tools and documents: docstrings, comments, paragraphs."""
    pattern = re.compile(rf"(?<!\w)({'|'.join(map(re.escape, PHRASES))})(?!\w)", re.IGNORECASE)
    paths = [*ROOT.glob("arc_suite/**/*.py"), *ROOT.glob("tools/**/*.py"), *ROOT.glob("docs/*.md")]
    paths += [ROOT / name for name in ("README.md", "CHANGELOG.md", "Makefile", "setup.cfg")]
    found = [
        f"{path.relative_to(ROOT)}:{number} has {phrase!r}; use: {PHRASES[phrase.lower()]}"
        for path in paths
        for number, line in enumerate(path.read_text().splitlines(), 1)
        for phrase in pattern.findall(line)
    ]
    assert not found, "\n".join(["", *found])


# Stems of British spellings; MuJoCo and Gymnasium write "randomize", "color", "center", "meter".
BRITISH = re.compile(
    r"(?:col|neighb|behavi|arm)our|(?:normal|random|general|initial|visual|stabil|optim|penal)is[eai]"
    r"|(?<![a-z])(?:centi|milli|micro)?metre|centre|centred|licence|grey|(?:travel|label|model)led|catalogue|artefact",
    re.IGNORECASE,
)


def test_american_spelling():
    """In names, prose and error texts, except this file's."""
    rooms = ("arc_suite", "tools", "tests", "examples", "docs", "studies")
    paths = [path for room in rooms for kind in ("py", "md", "ipynb") for path in (ROOT / room).rglob(f"*.{kind}")]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {word}"
        for path in [
            *paths,
            *ROOT.glob("web/*.js"),
            ROOT / "README.md",
            ROOT / "CHANGELOG.md",
            ROOT / "Makefile",
            ROOT / "setup.cfg",
        ]
        if path != pathlib.Path(__file__)
        for number, line in enumerate(path.read_text().splitlines(), 1)
        for word in BRITISH.findall(re.sub(r"[\w+/]{80,}", "", line))  # without base64
    ]
    assert not found, "\n".join(["", *found])


def public(path):
    """Yield the public names of a module: itself, definitions, parameters, fields."""
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    yield module.rpartition(".")[0], module.rpartition(".")[2]
    yield from _defined(ast.parse(path.read_text()), module)


def _defined(parent, place):
    for node in parent.body:
        name = getattr(node, "name", "")
        if name.startswith("_"):
            continue
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield place, name
        if isinstance(node, ast.ClassDef):
            yield from _defined(node, f"{place}.{name}")
        elif isinstance(node, ast.FunctionDef):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            yield from ((f"{place}.{name}()", argument.arg) for argument in arguments)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            stored = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
            yield from ((place, name) for name in stored if not name.startswith("_"))


def modules():
    """Yield the package's modules, but private ones."""
    for path in sorted((ROOT / "arc_suite").rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if not any(part.startswith("_") and part != "__init__" for part in parts):
            yield path


def test_readme():
    code = re.findall(r"```.*?```|`[^`\n]+`", (ROOT / "README.md").read_text(), re.DOTALL)
    assert_plain(("README", name) for text in code for name in re.findall(r"\w+", text))


@pytest.mark.parametrize("program", main.PROGRAMS)
def test_help(program):
    """Flags, and the values that they list."""
    text = programs.run("-m", "arc_suite", program, "--help", cwd=ROOT).stdout
    flags = re.findall(r"^\s*(?:-\w, )?--(?:\[no\])?(\w+)", text, re.MULTILINE)
    values = [value for listed in re.findall(r"<([\w|]+)>:", text) for value in listed.split("|")]
    assert "version" in flags
    assert_plain((program, name) for name in [program, *flags, *values])


def test_public_names():
    assert_plain(name for path in modules() for name in public(path))


def test_columns_and_keys():
    """Headers of tables and keys of configurations that are committed."""
    names = set()
    for path in (ROOT / "studies").rglob("*.csv"):
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        texts = {row[name] for row in rows for name in ("task_kwargs", "hyperparameters", "versions") if name in row}
        keys = {key for text in texts for key in json.loads(text)}
        names |= {(f"studies {path.name}", name) for name in (*rows[0], *keys)}
    assert_plain(sorted(names))
