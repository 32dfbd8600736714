"""A page in which a creature is designed while it walks: a sketch, the creature it makes, its episodes, widgets.

`sketch` is what the widgets say, `creature` opens it, `session` steps it in real time, `saving` makes files of it. Only
`page`, `view` and `charts` need viser.
"""
