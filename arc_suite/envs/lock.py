"""One thread at a time in an environment: MuJoCo crashes where two step one simulation."""

import functools
import threading


class Lock(type(threading.RLock())):
    """The lock of one environment; its pickles and copies are new locks, which nobody holds."""

    def __reduce__(self):
        return Lock, ()


def one_thread_at_a_time(method):
    """Make a method of an environment, whose `_lock` is a `Lock`, refuse calls while another thread is in one.

    Raises:
        RuntimeError: another thread's call is at work; one line, and nothing has changed.
    """

    @functools.wraps(method)
    def alone(self, *args, **kwargs):
        lock = self._lock
        if not lock.acquire(False):
            raise RuntimeError(
                f"cannot {method.__name__}: another thread is using this environment; make one for each thread"
            )
        try:
            return method(self, *args, **kwargs)
        finally:
            lock.release()

    return alone
