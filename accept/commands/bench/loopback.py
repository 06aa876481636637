"""The web server of `accept run --web`; imported only if the extra `web` is installed."""

import asyncio
import re
import secrets
import tempfile
from asyncio.subprocess import PIPE, Process
from collections.abc import Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

from aiohttp import web
from aiohttp.typedefs import Handler
from textual_serve import server
from textual_serve.app_service import AppService

from accept.base.child_processes import protected

COOKIE = "accept-session-{}"  # of a port: browsers give the cookies of an address to every port of it
HEADERS = {  # of every answer, an error too
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_MOST_BYTES = 200_000_000  # of a photo, as of a file of a note
_UNSAFE = re.compile(r"[^\w.-]")  # in a file's name
_ELSEWHERE = re.compile(r"<(link|script)\b[^>]*(?:href|src)\s*=\s*[\"']https?://[^>]*>(?:\s*</script>)?", re.DOTALL)

# Keys go to the program at once, without a click into the page first: the terminal takes them in a text area that comes
# when it is drawn.
_FOCUS = """<script>
(function focus(left) {
  const line = document.querySelector("textarea.xterm-helper-textarea");
  if (line) line.focus();
  if (left > 0 && document.activeElement !== line) setTimeout(focus, 100, left - 1);
})(600);
</script>
"""


class Window(AppService):
    """The program of a window, started without a shell: the library starts a line of text by one, and no quoting holds
    for both that of POSIX and cmd of Windows."""

    def __init__(self, words: Sequence[str], *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._words = words

    async def _open_app_process(self, width: int = 80, height: int = 24) -> Process:
        with protected():
            given = self._build_environment(width=width, height=height)
            started = await asyncio.create_subprocess_exec(
                *self._words, stdin=PIPE, stdout=PIPE, stderr=PIPE, env=given
            )
        self._process = started
        self._stdin = started.stdin
        return started

    async def stop(self) -> None:
        """Stop the program and wait for its end, lest the server end before it."""
        await super().stop()
        if self._process is not None:
            await self._process.communicate()


class Loopback(server.Server):
    """Serve pages of its own address only: another site that is open in the same browser could otherwise press keys
    here, by name or by a name that points to this machine."""

    def __init__(self, words: Sequence[str], photos: Path, *arguments: Any, **options: Any) -> None:
        """Make the server. photos: folder that dropped files are written to, until the server ends."""
        super().__init__("accept run", *arguments, **options)
        self._photos = photos
        vars(server)["AppService"] = partial(Window, words)  # the name by which the library starts a window
        self._token: str | None = secrets.token_urlsafe(24)
        self._session = secrets.token_urlsafe(24)

    @property
    def address(self) -> str:
        """Return the address to open in the browser; it works once."""
        return f"http://{self._own}/?token={self._token}"

    def initialize_logging(self) -> None:
        """Keep the server's log silent, because it would mix with the program's own output."""

    async def on_startup(self, app: web.Application) -> None:
        """Print no banner."""

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.middlewares.append(self._own_only)
        app.on_response_prepare.append(_harden)
        app.router.add_post(UPLOAD, self._photo)
        return app

    async def _photo(self, request: web.Request) -> web.Response:
        """Keep a file that was dropped on the page; answer with its path, which the page types into the line."""
        name = _UNSAFE.sub("_", Path(request.query.get("name", "")).name).lstrip(".") or "photo"
        folder = Path(tempfile.mkdtemp(dir=self._photos))
        size = 0
        with open(folder / name, "wb") as file:
            async for chunk in request.content.iter_chunked(2**16):
                size += len(chunk)
                if size > _MOST_BYTES:
                    raise web.HTTPRequestEntityTooLarge(_MOST_BYTES, size)
                file.write(chunk)
        return web.Response(text=str(folder / name))

    @property
    def _own(self) -> str:
        return f"{self.host}:{self.port}"

    @web.middleware
    async def _own_only(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        origin = request.headers.get("Origin")
        if request.host != self._own or origin not in (None, f"http://{self._own}"):
            raise web.HTTPForbidden(text=f"only http://{self._own} itself is answered")
        if _same(request.cookies.get(COOKIE.format(self.port), ""), self._session):
            return await handler(request)
        if request.method != "GET":  # a preview of the link must not spend it
            raise web.HTTPForbidden(text="open the address in a browser")
        raise self._admit(request.query.get("token", ""))

    def _admit(self, token: str) -> web.HTTPFound:
        """Return the redirection that gives the session to the first browser alone that brings the printed token."""
        if self._token is None or not _same(token, self._token):
            raise web.HTTPForbidden(text="open the address that accept run --web printed; one browser, once")
        self._token = None
        answer = web.HTTPFound(f"http://{self._own}/")
        answer.set_cookie(COOKIE.format(self.port), self._session, httponly=True, samesite="Strict")
        return answer


async def _harden(_: web.Request, answer: web.StreamResponse) -> None:
    answer.headers.update(HEADERS)


def _same(given: str, expected: str) -> bool:
    """Return whether two strings are equal, in constant time and for any letters."""
    return secrets.compare_digest(given.encode("utf-8", "surrogatepass"), expected.encode())


def template_without_strangers(folder: Path) -> None:
    """Write the package's page without its links to other hosts, which a bench may not reach and which must not learn
    what is measured."""
    page = files("textual_serve").joinpath("templates", "app_index.html").read_text(encoding="utf-8")
    page = _ELSEWHERE.sub("", page).replace("</body>", f"{additions()}{_FOCUS}</body>")
    (folder / "app_index.html").write_text(page, encoding="utf-8")


UPLOAD = "/photo"  # takes a dropped or pasted file, answers with its path

_KEYS = (  # what stands on it, the key of the browser, its code; ^: with Ctrl
    ("Esc", "Escape", 27),
    ("←", "ArrowLeft", 37),
    ("↑", "ArrowUp", 38),
    ("↓", "ArrowDown", 40),
    ("→", "ArrowRight", 39),
    ("PgUp", "PageUp", 33),
    ("PgDn", "PageDown", 34),
    ("Tab", "Tab", 9),
    ("⌫", "Backspace", 8),
    *((f"F{n}", f"F{n}", 111 + n) for n in (*range(1, 11), 12)),
    *((f"^{letter}", letter, ord(letter.upper())) for letter in "zrdflsotekp"),
    ("Enter", "Enter", 13),
)
_STYLE = """<style>
body { margin: 0; height: 100vh; display: flex; flex-direction: column; }
#terminal { flex: 1; min-height: 0; height: auto !important; }
#touch { display: flex; flex-wrap: wrap; gap: 4px; padding: 2px; z-index: 5; }  /* further rows in a narrow window */
#touch button { flex: 1 0 48px; height: 52px; margin: 0; padding: 0; background: #1f2937; color: #dfe6ef;
  font: 16px monospace; border: 0; border-radius: 6px; touch-action: manipulation; }
#touch button:active { background: #6cb6ff; }
#touch button[data-key=Enter] { flex-grow: 2; background: #2b4a6f; }
</style>
"""
_SCRIPT = """<script>
const line = () => document.querySelector("textarea.xterm-helper-textarea");
function press(key, code, ctrlKey) {
  const event = new KeyboardEvent("keydown", { key, code: key, ctrlKey, bubbles: true, cancelable: true });
  Object.defineProperty(event, "keyCode", { get: () => code });
  Object.defineProperty(event, "which", { get: () => code });
  line()?.focus();
  line()?.dispatchEvent(event);
}
document.querySelectorAll("#touch button").forEach((button) => {
  button.addEventListener("pointerdown", (event) => {
    event.preventDefault();  // the terminal keeps the focus
    press(button.dataset.key, Number(button.dataset.code), button.textContent.startsWith("^"));
  });
});
async function take(files, event) {
  if (!files || !files.length) return;
  event.preventDefault();
  event.stopPropagation();
  const name = encodeURIComponent(files[0].name || "photo.png");
  const answer = await fetch("UPLOAD?name=" + name, { method: "POST", body: files[0] });
  if (!answer.ok) return;
  const pasted = new DataTransfer();
  pasted.setData("text/plain", await answer.text());
  line()?.focus();
  line()?.dispatchEvent(new ClipboardEvent("paste", { clipboardData: pasted, bubbles: true, cancelable: true }));
}
document.addEventListener("dragover", (event) => event.preventDefault(), true);
document.addEventListener("drop", (event) => take(event.dataTransfer.files, event), true);
document.addEventListener("paste", (event) => take(event.clipboardData.files, event), true);
</script>
""".replace("UPLOAD", UPLOAD)


def additions() -> str:
    """Return the HTML to put before `</body>`: style, a bar of touch keys, and the script for keys and photos."""
    keys = "".join(
        f'<button tabindex="-1" data-key="{key}" data-code="{code}">{label}</button>' for label, key, code in _KEYS
    )
    return f'{_STYLE}<div id="touch">{keys}</div>\n{_SCRIPT}'
