"""MuJoCo runs: the model they step, one of them, a batch, pictures."""
