"""The architecture: imports point downwards only."""

import ast
import pathlib
import subprocess
import sys

import arc_suite

PACKAGE = pathlib.Path(arc_suite.__file__).parent

# From the bottom up; a module may import from its own layer's row only what stands before it.
LAYERS = (
    ("checks", "files", "versions"),
    ("robots",),
    ("arenas",),
    ("models",),
    ("simulation",),
    ("tasks",),
    ("registry",),
    ("cpg",),
    ("registration",),
    ("envs",),
    ("policies",),
    ("evaluation",),
    ("data",),
    ("style",),
    ("tuning",),
    ("cli",),
    ("doctor", "__main__"),
)
ORDER = [name for layer in LAYERS for name in layer]

# Modules that may import nothing but these beside the standard library and arc_suite itself.
THIRD_PARTY = {
    "checks": set(),
    "robots.spec": set(),
    "robots.queen": set(),
    "robots.bastion": set(),
    "robots.tick": set(),
    "robots.leaper": set(),
    "tasks.readings": {"numpy"},
    "tasks.terms": {"numpy"},
    "cpg.law": {"numpy"},
    "cpg.presets": set(),
    "style.metrics": {"numpy"},
}


def modules():
    for path in sorted(PACKAGE.rglob("*.py")):
        name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix("__init__").rstrip(".")
        if name:
            yield name, ast.parse(path.read_text())


def imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            if node.module == "arc_suite":
                yield from (f"arc_suite.{alias.name}" for alias in node.names)
            else:
                yield node.module


def test_imports_point_downwards():
    for name, tree in modules():
        for target in imports(tree):
            parts = target.split(".")
            if parts[0] == "arc_suite" and len(parts) > 1 and parts[1] != name.split(".")[0]:
                importer, imported = ORDER.index(name.split(".")[0]), ORDER.index(parts[1])
                assert imported < importer, f"{name} imports {target}"


def test_every_module_has_a_layer():
    assert {name.split(".")[0] for name, _ in modules()} <= set(ORDER)


def test_low_layers_import_little():
    trees = dict(modules())
    for name, allowed in THIRD_PARTY.items():
        for target in imports(trees[name]):
            top = target.split(".")[0]
            assert top in allowed | {"arc_suite"} or top in sys.stdlib_module_names, f"{name} imports {target}"


def test_terms_and_readings_know_no_robots():
    trees = dict(modules())
    for name in ("tasks.readings", "tasks.terms"):
        inside = {target for target in imports(trees[name]) if target.startswith("arc_suite")}
        assert inside <= {"arc_suite.tasks.readings"}, f"{name} imports {inside}"


def test_import_is_light():
    code = "import sys, arc_suite; print([m for m in ('torch', 'shimmy', 'matplotlib', 'imageio') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
    assert result.stderr == ""
