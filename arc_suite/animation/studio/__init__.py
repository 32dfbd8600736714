"""A page on which a creature is designed while it walks.

`sketch` holds the values of the widgets for body and task. `states` holds the values of all widgets, and their history.
`creature` opens a sketch, `session` steps the creature in real time, and `saving` makes files of it. Only `page`,
`gate`, `layout`, `view`, `figure` and `charts` need viser.
"""
