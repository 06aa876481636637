"""The web server of `accept run --web`; imported only where the extra `web` is installed."""

import re
from importlib.resources import files
from pathlib import Path

from aiohttp import web
from aiohttp.typedefs import Handler
from textual_serve.server import Server

_ELSEWHERE = re.compile(r"<(link|script)\b[^>]*(?:href|src)\s*=\s*[\"']https?://[^>]*>(?:\s*</script>)?", re.DOTALL)


class Loopback(Server):
    """Answers pages of its own address only: another site that is open in the same browser could otherwise press keys
    here, by name or by a name that points to this machine."""

    def initialize_logging(self) -> None:
        """Its log would stand among the program's own words."""

    async def on_startup(self, app: web.Application) -> None:
        """No banner."""

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.middlewares.append(self._own_only)
        return app

    @property
    def _own(self) -> str:
        return f"{self.host}:{self.port}"

    @web.middleware
    async def _own_only(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        origin = request.headers.get("Origin")
        if request.host != self._own or origin not in (None, f"http://{self._own}"):
            raise web.HTTPForbidden(text=f"only http://{self._own} itself is answered")
        return await handler(request)


def template_without_strangers(folder: Path) -> None:
    """The package's page without what it would load from other hosts: a bench may have no way to them, and none of
    their business is what is measured here."""
    page = files("textual_serve").joinpath("templates", "app_index.html").read_text(encoding="utf-8")
    (folder / "app_index.html").write_text(_ELSEWHERE.sub("", page), encoding="utf-8")
