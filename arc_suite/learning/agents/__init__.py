"""Agents: training of policies, one command from nothing to a policy that every program takes.

An algorithm is an entry of `algorithms.ALGORITHMS`: a learner, and hyperparameters. Hyperparameters are a frozen
dataclass, whose fields `arc-suite train --hp name=value` overrides. Those of this package are imported when they are
used, as they need JAX. A learner is a function, a training script that reads from top to bottom:

    learn(hp, context) -> Iterator[Slice]

`context` (a `learner.RunContext`) says what is learned and makes environments, which count the steps of the run
(`arc_suite.usage`). Each `learner.Slice` has metrics for training.csv, the policy, and the arrays of a checkpoint. A
slice ends at the latest where the next evaluation is due. `context.checkpoint` has the arrays of an earlier slice:
learning resumes from them bit-exactly.

`training.train` does the rest: it evaluates, writes the folder of the run, and resumes. All random numbers come from
generators seeded by the run's seed, a purpose and a count (`learner.generator`), so checkpoints need no random state.
Environments resume from `VectorEnv.snapshot()`.

Runs with equal `algorithms.program_of` can learn side by side on a GPU: `training.train_in_one_program`. Then learners
yield the slices of all runs.
"""
