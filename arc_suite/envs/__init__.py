"""The faces of a task: dm_env, Gymnasium, many environments at once. They know no task in particular."""
