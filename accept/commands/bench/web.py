"""`accept run --web`: the same screens in a browser on this machine, and on no other."""

import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from accept.base.console import say
from accept.base.exit_codes import Exit
from specs.distribution import install

HOST = "127.0.0.1"
MISSING = f"accept: --web needs the extra 'web': {install('web')}"


def run(arguments: Sequence[str], port: int) -> Exit:
    """Serve `accept run` with these arguments until Ctrl+C; every browser window is a program of its own."""
    if find_spec("textual_serve") is None:
        say(MISSING)
        return Exit.BAD_INPUT
    from accept.commands.bench.loopback import Loopback, template_without_strangers

    with tempfile.TemporaryDirectory(prefix="accept-web-") as folder:
        template_without_strangers(Path(folder))
        photos = Path(folder) / "photos"
        photos.mkdir()
        server = Loopback(command(arguments), photos, HOST, port, "accept", templates_path=folder)
        say(f"accept: {server.address}\nin one browser on this machine; Ctrl+C ends it")
        try:
            server.serve()
        except OSError as e:
            say(f"accept: {HOST}:{port}: {e.strerror or e}")
            return Exit.BAD_INPUT
    return Exit.ACCEPTED


def command(arguments: Sequence[str]) -> list[str]:
    """Return the command for every window as a list of words: Windows quotes lines otherwise."""
    return [sys.executable, "-P", "-m", "accept", "run", *arguments]
