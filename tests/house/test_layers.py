"""What import-linter's contracts in pyproject.toml do not say of imports."""

import graphlib

import grimp
import interpreters


def test_no_import_goes_round():
    """The contracts look at siblings; here a package and its own modules count, too."""
    graph = grimp.build_graph("arc_suite", cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    graphlib.TopologicalSorter(imports).prepare()


def test_import_is_light():
    """Neither the wings nor what only extras or windows need."""
    heavy = ("torch", "jax", "stable_baselines3", "shimmy", "matplotlib", "imageio", "viser")
    heavy += ("arc_suite.learning", "arc_suite.animation")
    code = f"import sys, arc_suite; print(sorted(sys.modules.keys() & {set(heavy)}))"
    assert interpreters.printed(code) == ["[]"]
