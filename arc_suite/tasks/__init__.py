"""What creatures do: task name -> factory of an environment for a body."""

from arc_suite.tasks import walk

TASKS = {"walk": walk.walk}
