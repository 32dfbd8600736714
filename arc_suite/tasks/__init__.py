"""What creatures do: task name -> factory of an environment for a body."""

from arc_suite.tasks.walk import walk

TASKS = {"walk": walk}
