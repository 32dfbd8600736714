"""The faces of a task: dm_env, Gymnasium, many rows at once."""
