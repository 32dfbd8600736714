"""Studies: tables of runs, which are trained, published and compared.

A study is a `tables.Study`; each of its runs is a configuration, which goes as a JSON file to `arc-suite train`.
`runner` makes the runs on this machine and `cluster` on many, `publication` copies their results into tables that can
be committed, `results` reads these, and `report` writes the report from them.
"""

from arc_suite import versions

with versions.require_extra("studies need JAX, Minari and matplotlib", "learn"):
    import matplotlib  # noqa: F401
    import minari  # noqa: F401
