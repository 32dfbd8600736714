"""Policies of modules that act in a process of their own; environments and returns stay in the process of the judge.

The process is `python -m arc_suite.policies.separate`, in the folder of the module. Messages go through its standard
input and output, and have sizes that both sides know:

    start   a line of JSON: module, robot, num_envs, and the size of each block
    reset   `r`, how many environments, and index and seed of each
    act     `a`, rewards (num_envs,), and all blocks side by side (num_envs, sizes)
    answer  `k` and actions (num_envs, joints) of an act; or `e`, and an error's text of a fixed length

What a module prints is lost, so that it is no message.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

import numpy as np

from arc_suite import checks, registry, usage

MAX_START = 300.0  # s until a module is imported and has made its first function
MAX_STEP = 60.0  # s until the answer to a reset or an act

_DONE = b"k"
_ERROR = b"e"
_RESET = b"r"
_ACT = b"a"
_ERROR_LENGTH = 400  # bytes
_INTEGER = np.dtype("<i8")
_NUMBER = np.dtype("<f8")


class Separate:
    """A policy that a function of a module makes, in a process of its own."""

    def __init__(
        self,
        module: Path,
        attribute: str,
        robot: str,
        num_envs: int,
        sizes: Mapping[str, int],
        name: str,
        max_step: float = MAX_STEP,
    ):
        """Start the process, and wait until the function has made a policy.

        Args:
            module: path of the module; the process runs in its folder.
            attribute: name of the function, which takes a robot's name and returns a function of a `TimeStep`.
            robot: name of the robot.
            num_envs: number of environments.
            sizes: size of each block of the observation by name.
            name: name of the policy, with which errors begin.
            max_step: time until the answer to a reset or an act, s; a later one is an error.

        Raises:
            ValueError: the module does not fit, dies or hangs; or a run learns that declares no policy as its source.
        """
        usage.add_source(usage.POLICY)
        self._name = name
        self._num_envs = num_envs
        self._sizes = dict(sizes)
        self._joints = len(registry.body_of(robot).joint_names)
        self._max_step = max_step
        self._source = f"{module}:{attribute}"
        self._is_late = False
        package_parent = os.fspath(Path(__file__).resolve().parents[2])  # the process runs in another folder
        paths = [package_parent, *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__],
            cwd=module.parent,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths)), "PYTHONDONTWRITEBYTECODE": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that its children end with it
        )
        start = {"policy": self._source, "robot": robot, "num_envs": num_envs, "sizes": self._sizes}
        with contextlib.ExitStack() as stack:
            stack.callback(self.close)
            self._exchange(f"{json.dumps(start)}\n".encode(), 0, MAX_START)
            stack.pop_all()  # the process stays

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes in some environments."""
        pairs = np.array([indices, seeds], _INTEGER).T
        self._exchange(_RESET + np.array(len(pairs), _INTEGER).tobytes() + pairs.tobytes(), 0, self._max_step)

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Raises:
            ValueError: an action that is not finite or of another shape, an error of the module, or its end; or a run
                learns that declares no policy as its source.
        """
        usage.add_source(usage.POLICY)
        sizes = {name: block.shape[-1] for name, block in observation.items()}
        if sizes != self._sizes:
            raise ValueError(f"{self._name}: expected blocks {self._sizes}, got {sizes}")
        blocks = [np.reshape(block, (self._num_envs, -1)) for block in observation.values()]
        numbers = np.concatenate([np.ravel(rewards), *map(np.ravel, blocks)], dtype=_NUMBER)
        answer = self._exchange(_ACT + numbers.tobytes(), self._num_envs * self._joints, self._max_step)
        actions = answer.reshape(self._num_envs, self._joints)
        if not np.isfinite(actions).all():
            raise ValueError(f"{self._name}: expected finite actions")
        return actions

    def close(self) -> None:
        """End the process and all that it has started."""
        self._end()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):  # what was not written is lost
                pipe.close()

    def _end(self) -> None:
        """End the process and its children at once."""
        with contextlib.suppress(ProcessLookupError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, signal.SIGKILL)
            else:
                self._process.kill()

    def _end_late(self) -> None:
        self._is_late = True
        self._end()

    def _exchange(self, message: bytes, numbers: int, limit: float) -> np.ndarray:
        """Send a message, and return the numbers of the answer.

        Args:
            message: message.
            numbers: how many numbers the answer has.
            limit: s until the answer.

        Raises:
            ValueError: an error of the module, or its end.
        """
        timer = threading.Timer(limit, self._end_late)
        timer.daemon = True
        timer.start()
        try:
            self._process.stdin.write(message)
            self._process.stdin.flush()
            kind = self._read(1)
            if kind == _DONE:
                return np.frombuffer(self._read(numbers * _NUMBER.itemsize), _NUMBER)
            text = self._read(_ERROR_LENGTH) if kind == _ERROR else b""
        except (OSError, EOFError):
            text = b""
        finally:
            timer.cancel()
        raise ValueError(f"{self._name}: {self._describe_end(limit, text)}")

    def _describe_end(self, limit: float, text: bytes) -> str:
        """Return why there are no numbers, in one line."""
        if self._is_late:
            return f"no answer after {limit:g} s"
        if text:
            return checks.quote(text.decode("utf-8", "replace")).removeprefix(
                f"policy {checks.preview(self._source)}: "
            )
        self._end()
        return f"its process ended with status {self._process.wait()}"

    def _read(self, size: int) -> bytes:
        """Return so many bytes of the answer; raise EOFError if there are fewer."""
        content = self._process.stdout.read(size)
        if len(content) < size:
            raise EOFError
        return content


def main() -> None:
    """Act for the judge until it closes the pipe."""
    judge_input = os.fdopen(os.dup(0), "rb")
    judge_output = os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    try:
        _serve(judge_input, judge_output)
    except BaseException as error:  # a module may also leave by SystemExit
        text = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        lines = text.strip().splitlines() or [type(error).__name__]
        content = lines[0].encode()[:_ERROR_LENGTH]
        judge_output.write(_ERROR + content.ljust(_ERROR_LENGTH))
        judge_output.flush()


def _serve(judge_input: IO[bytes], judge_output: IO[bytes]) -> None:
    """Make the policy, and answer messages."""
    from arc_suite import policies  # needs this module's package

    start = json.loads(judge_input.readline())
    num_envs = start["num_envs"]
    sizes = start["sizes"]
    policy = policies.policy(start["policy"], start["robot"], num_envs=num_envs)
    ends = np.cumsum([num_envs, *(num_envs * size for size in sizes.values())])
    judge_output.write(_DONE)
    judge_output.flush()
    while kind := judge_input.read(1):
        answer = b""
        if kind == _RESET:
            count = int(np.frombuffer(judge_input.read(_INTEGER.itemsize), _INTEGER)[0])
            pairs = np.frombuffer(judge_input.read(2 * count * _INTEGER.itemsize), _INTEGER).reshape(count, 2)
            policy.reset(pairs[:, 0].tolist(), pairs[:, 1].tolist())
        else:
            numbers = np.frombuffer(judge_input.read(int(ends[-1]) * _NUMBER.itemsize), _NUMBER)
            rewards, *parts = np.split(numbers, ends[:-1])
            blocks = {name: part.reshape(num_envs, -1) for name, part in zip(sizes, parts, strict=True)}
            answer = np.asarray(policy.act(blocks, rewards), _NUMBER).tobytes()
        judge_output.write(_DONE + answer)
        judge_output.flush()


if __name__ == "__main__":
    main()
