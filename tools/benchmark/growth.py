"""How the cost of a control step grows with legs and links."""

import time

import mujoco
import numpy as np

from arc_suite.robots import queen
from arc_suite.robots.spec import Body, Leg, Link
from arc_suite.simulation import timers
from arc_suite.simulation.model import compile_model

LEGS = (2, 4, 6, 8, 10, 12)
LINKS = (1, 2, 3, 4)
STEPS = 10  # control steps of a turn; bodies do not fall within so few
_SUBSTEPS = 25  # of a control step
SIZES = tuple((legs, links) for links in LINKS for legs in LEGS)


def body(legs: int, links: int) -> Body:
    """Return Queen's torso on an even number of legs, with any number of links, each of which has a joint."""
    end = (0.0, 0.57 / links, -0.75 / links)  # from the mount to the foot as Queen's middle legs reach
    knee = queen.KNEE.replace(axis=(-1.0, 0.0, 0.0), range_deg=(-80.0, 80.0))
    joints = [queen.HIP, *(knee.replace(name=f"knee{index}") for index in range(1, links))]
    chain = tuple(Link(name=f"link{index}", end=end, radius=0.06, joint=joint) for index, joint in enumerate(joints))
    mounts = np.linspace(0.3, -0.3, legs // 2) if legs > 2 else [0.0]  # m, along the torso
    left_legs = [
        Leg(name=f"l{index}", mount=(float(x), 0.4, 0.0), links=chain, foot=queen.LEFT_LEGS[0].foot)
        for index, x in enumerate(mounts)
    ]
    right_legs = [leg.mirrored(leg.name.replace("l", "r")) for leg in left_legs]
    return queen.BODY.replace(name="grown", legs=(*left_legs, *right_legs))


class Bodies:
    """Bodies of all sizes, and the times of their turns."""

    def __init__(self):
        """Compile all bodies."""
        self._models = [compile_model(body(*size)) for size in SIZES]
        self._times = [[] for _ in SIZES]

    def play(self) -> None:
        """Time control steps of each body, which stands without torques."""
        for model, times in zip(self._models, self._times, strict=True):
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 10 * _SUBSTEPS)  # the body lands
            start = time.perf_counter()
            with timers.off:
                mujoco.mj_step(model, data, STEPS * _SUBSTEPS)
            times.append(1e6 * (time.perf_counter() - start) / STEPS)

    def results(self) -> list[dict]:
        """Return, for each size, legs, links of a leg, and times of a control step, us."""
        return [
            {"legs": legs, "links": links, "microseconds": times}
            for (legs, links), times in zip(SIZES, self._times, strict=True)
        ]
