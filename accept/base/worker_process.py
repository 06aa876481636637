"""The start of a worker process: it leaves Ctrl-C to the program that asked, ends with it, and has so much memory.

The end of the program is watched for by a thread, on every system alike. Linux could send a signal instead
(PR_SET_PDEATHSIG), but when the *thread* ends that started the worker, and that may be long before the program does."""

import math
import multiprocessing
import os
import signal
import sys
import threading
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path

VARIABLE = "ACCEPT_WORKER_GB"
MEMORY_GB = 4.0  # twenty times the need of a strut with its gap analysis
_LOST = 1  # exit code of a worker whose program is gone


def begin(gigabytes: float | None = None) -> None:
    """Initialise a worker process. gigabytes: the limit of its memory, `memory_GB` if not given."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all that runs in a terminal; the program answers it
    threading.Thread(target=_end_with_parent, daemon=True).start()
    limit_memory(memory_GB() if gigabytes is None else gigabytes)


def memory_GB() -> float:
    """Return the memory limit of a worker [GB]: the declared one, or that of ACCEPT_WORKER_GB."""
    try:
        return max(0.5, float(os.environ.get(VARIABLE, MEMORY_GB)))
    except ValueError:
        return MEMORY_GB


def too_large() -> str:
    """Return the words for an item whose work ended in MemoryError."""
    return f"it takes more than the {memory_GB():g} GB of memory that a worker may take ({VARIABLE})"


def limit_memory(gigabytes: float) -> None:
    """Make a demand for more memory fail with MemoryError, on Linux. A present limit is never raised.

    Windows has no such limit and macOS refuses it; there only the bounds on file sizes apply."""
    if sys.platform != "linux":
        return
    try:
        import resource
    except ImportError:  # a Python that was built without it
        return
    import numpy  # noqa: F401 - the buffers of its threads exist from now on, and do not count

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    set_already = [limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY]
    with suppress(ValueError, OSError):  # a container may forbid it: a worker without a limit judges all the same
        resource.setrlimit(resource.RLIMIT_AS, (min([_mapped() + int(gigabytes * 1e9), *set_already]), hard))


def limit_time(seconds: float) -> None:
    """Let the system end this process after so many seconds of computing, wherever it counts them."""
    try:
        import resource
    except ImportError:  # Windows, or a Python that was built without it
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds)))  # equal: without a core file


def _mapped() -> int:
    """Return the address space in use [bytes]; only Linux reports it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(_LOST)
