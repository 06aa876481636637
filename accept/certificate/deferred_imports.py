"""Parts of pyHanko that load a network client. It imports them with every signature, and they serve time stamps and
revocation data that are fetched by `aiohttp`, which this program never does: it asks by `requests`."""

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

CLIENTS = {
    "pyhanko.sign.timestamps.aiohttp_client": "HTTPTimeStamper",
    "pyhanko_certvalidator.fetchers.aiohttp_fetchers": "AIOHttpFetcherBackend",
}


def defer() -> None:
    """Put a module into the place of each client that is not loaded yet. Its class loads the real one when called."""
    for module, name in CLIENTS.items():
        if module not in sys.modules:
            sys.modules[module] = stand_in = ModuleType(module)
            vars(stand_in)[name] = _deferred(module, name)


def _deferred(module: str, name: str) -> Callable[..., Any]:
    def real(*arguments: Any, **options: Any) -> Any:
        for each in CLIENTS:
            if not hasattr(sys.modules.get(each), "__file__"):
                sys.modules.pop(each, None)
        return getattr(import_module(module), name)(*arguments, **options)

    return real
