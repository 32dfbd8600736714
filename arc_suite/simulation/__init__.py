"""MuJoCo runs: one, a batch, and pictures of them."""
