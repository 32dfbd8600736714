"""The faces of a task: dm_env, Gymnasium, many rows at once. They know no task in particular."""
