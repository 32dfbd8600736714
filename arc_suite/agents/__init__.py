"""Agents: what learns a task, one command from nothing to a policy that every program takes.

An algorithm is a row of `algorithms.ALGORITHMS`: a module that learns, and numbers. The numbers are a
frozen dataclass, whose fields `arc-suite train --row name=value` overrides. The module is imported
when it is wanted, as it needs JAX, and has one function:

    begin(row, stage) -> Learner

`stage` (a `learner.Stage`) says what is learned and makes environments. A `Learner` has

    step                    environment steps that are done with; a run ends when they are enough
    advance(limit)          learns a slice, seconds long, up to `limit` steps at most, and returns figures by
                            name, a line of training.csv, or None where no line is due
    policy()                the deterministic policy's layers, `policies.network.Layer`s
    arrays()                everything that it goes on from, NumPy arrays by name: a checkpoint
    restore(arrays)         goes on from there, to the same bits

`training.train` does the rest: it evaluates, writes the folder of the run, and resumes. All that is
random is drawn from generators seeded by the run's seed, a purpose and a count (`learner.generator`), so
that nothing of it needs to be kept. Environments go on from `VectorEnv.snapshot()`.
"""
