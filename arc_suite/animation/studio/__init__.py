"""A page in which a creature is designed while it walks: a sketch, the creature it makes, its episodes, widgets.

`sketch` is what the widgets say of a creature, `states` all that they say and its history, `creature` opens a sketch,
`session` steps it in real time, `saving` makes files of it. Only `page`, `layout`, `view`, `figure` and `charts` need
viser.
"""
