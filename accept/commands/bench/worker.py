"""`accept worker`: processes that work for a cluster's scheduler."""

import os
import subprocess
import sys
from importlib.util import find_spec
from typing import Annotated
from urllib.parse import urlsplit

from typer import Argument, Option

from accept.base.child_processes import environment
from accept.base.exit_codes import Exit
from accept.base.runner import ClusterError
from accept.commands.answer import Answer, command
from specs.distribution import install

HERE = "127.0.0.1"
_LOCAL = (HERE, "localhost", "::1")


@command
def run(
    scheduler: Annotated[str, Argument(help="Address of the scheduler, tcp://HOST:8786.")],
    host: Annotated[str, Option(help="This machine's address in the network of the cluster.")] = HERE,
    workers: Annotated[int, Option(min=1, help="How many processes, one a core.")] = 1,
) -> Answer:
    """Start workers of a cluster on this machine. They listen on this machine alone unless --host names its address."""
    if find_spec("distributed") is None:
        raise ClusterError(f"Dask is not installed: {install('cluster')}")
    if host in _LOCAL and urlsplit(scheduler).hostname not in _LOCAL:
        raise ClusterError(
            f"the scheduler at {scheduler} is on another machine and could not reach workers at {host}; "
            "name this machine's address in its network: --host"
        )
    words = [scheduler, "--host", host, "--nworkers", str(workers), "--nthreads", "1", "--no-dashboard"]
    given = {"DASK_DISTRIBUTED__ADMIN__LOW_LEVEL_LOG_LENGTH": "10"} | os.environ
    program = [sys.executable, "-m", "distributed.cli.dask_worker", *words]
    ended = subprocess.run(program, env=environment(given)).returncode
    return Answer(exit=Exit.BAD_INPUT if ended else Exit.ACCEPTED)
