"""The workflow in a browser: on this machine only, and only for its own page."""

import asyncio
import importlib
import pkgutil
import re
import socket
import sys
from pathlib import Path

import pytest

from accept.base.exit_codes import Exit
from accept.commands.bench import web
from accept.commands.bench.run import RunOptions

aiohttp = pytest.importorskip("aiohttp")
pytest.importorskip("textual_serve")

FIRST_SCREEN = b"type a serial"
TIMEOUT_S = 60.0  # for the program to start on a crowded machine


def free_port() -> int:
    with socket.socket() as found:
        found.bind((web.HOST, 0))
        return int(found.getsockname()[1])


async def first_screen(session, url: str, own: str) -> bytes:
    got = b""
    async with session.ws_connect(url, headers={"Origin": own}) as line, asyncio.timeout(TIMEOUT_S):
        while FIRST_SCREEN not in got:
            got += (await line.receive()).data
    return got


async def test_a_window_is_started_without_a_shell(tmp_path: Path, monkeypatch):
    """Words with what a shell of POSIX or of Windows would take apart arrive as they are."""
    from textual_serve import server

    from accept.commands.bench import loopback

    async def by_a_shell(*_, **__):
        raise AssertionError("a shell")

    monkeypatch.setattr(asyncio, "create_subprocess_shell", by_a_shell)
    written = [r"C:\Program Files\python", "it's", 'a "word"', "%PATH%", "$HOME", "a;b&c"]
    words = [sys.executable, "-c", "import sys; print(sys.argv[1:])", *written]
    serving = loopback.Loopback(words, tmp_path, web.HOST, free_port(), "accept")
    window = server.AppService(
        serving.command, write_bytes=None, write_str=None, close=None, download_manager=serving.download_manager
    )
    started = await window._open_app_process()
    out, _ = await started.communicate()
    started._transport.close()
    assert out.decode().strip() == str(written)


def test_the_command_of_a_window_is_words():
    assert web.command(["it's here"])[-2:] == ["run", "it's here"]


def test_every_key_that_a_screen_names_can_be_touched():
    """Those of the row of keys, of the app, of the pages; and what forgets an open key and shows more values."""
    from textual.screen import Screen

    from accept.commands.bench.loopback import additions
    from accept.tui import screens
    from accept.tui.app import BenchApp

    names = [one.name for one in pkgutil.iter_modules(screens.__path__)]
    modules = [importlib.import_module(f"{screens.__name__}.{name}") for name in names]
    found = {kind for module in modules for kind in vars(module).values() if isinstance(kind, type)}
    bound = [one for kind in found if issubclass(kind, Screen) for one in vars(kind).get("BINDINGS", ())]
    named = {one.key.split(",")[0] for one in bound if one.show} | {"ctrl+l", "ctrl+d", "pageup", "pagedown"}
    named |= {one.key for one in BenchApp.BINDINGS if one.key.startswith("f")}
    codes = {"escape": 27, "enter": 13, "tab": 9, **{f"f{n}": 111 + n for n in range(1, 13)}}
    codes |= {"left": 37, "right": 39, "backspace": 8, "pageup": 33, "pagedown": 34}
    codes |= {f"ctrl+{letter}": ord(letter.upper()) for letter in "abcdefghijklmnopqrstuvwxyz"}
    touched = dict(re.findall(r'data-code="(\d+)">([^<]+)<', additions()))
    assert {"ctrl+z", "ctrl+r", "f5", "f12"} <= named
    assert not {key for key in named if str(codes[key]) not in touched}
    assert not {key for key in named if touched[str(codes[key])].startswith("^") is not key.startswith("ctrl+")}


async def test_the_first_screen_comes_to_its_own_page_and_to_no_other(tmp_path: Path, monkeypatch):
    """And the program of the window has ended when the server has."""
    from aiohttp import web as server

    from accept.commands.bench.loopback import HEADERS, UPLOAD, Loopback, template_without_strangers

    programs, start = [], asyncio.create_subprocess_exec

    async def noted(*words, **options):
        programs.append(await start(*words, **options))
        return programs[-1]

    monkeypatch.setattr(asyncio, "create_subprocess_exec", noted)
    template_without_strangers(tmp_path)
    port = free_port()
    own = f"http://{web.HOST}:{port}"
    words, photos = web.command(["--spec", "apa-basic"]), tmp_path / "photos"
    photos.mkdir()
    serving = Loopback(words, photos, web.HOST, port, "accept", templates_path=tmp_path)
    runner = server.AppRunner(await serving._make_app())
    await runner.setup()
    await server.TCPSite(runner, web.HOST, port).start()
    async with aiohttp.ClientSession() as other, other.get(own) as page:
        assert page.status == 403  # another user of this machine does not know the token
        assert HEADERS.items() <= dict(page.headers).items()
    entrance = serving.address
    async with aiohttp.ClientSession(cookies={"accept": "\u00e9"}) as other:
        async with other.get(f"{own}?token=%C3%A9") as page:
            assert page.status == 403  # letters beyond ASCII are no reason to fail
        async with other.head(entrance) as page:
            assert page.status in (403, 405)  # a preview of the link does not take the token
    async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as session:
        async with session.get(entrance) as page:
            text = await page.text()
        assert page.status == 200
        assert own in text
        assert HEADERS.items() <= dict(page.headers).items()
        assert [cookie.key for cookie in session.cookie_jar] == [f"accept-session-{port}"]
        async with session.get(f"{own}/static/nothing") as page:
            assert (page.status, HEADERS.items() <= dict(page.headers).items()) == (404, True)
        assert "googleapis" not in text  # nothing is loaded from another host
        async with session.get(own, headers={"Host": "bench.example"}) as page:
            assert page.status == 403  # a name of somebody else that points to this machine
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            await first_screen(session, f"{own}/ws", "http://bench.example")
        async with aiohttp.ClientSession() as other, other.get(entrance) as page:
            assert page.status == 403  # the token is taken: one browser, once
        upload = f"{own}{UPLOAD}?name=..%2Fa%20crack.jpg"
        async with aiohttp.ClientSession() as other, other.post(upload, data=b"photo") as page:
            assert page.status == 403
        assert not list(photos.iterdir())
        async with session.post(upload, data=b"photo", headers={"Origin": own}) as page:
            written = Path(await page.text())
        assert written.read_bytes() == b"photo"
        assert (written.name, written.parent.parent) == ("a_crack.jpg", photos)
        assert FIRST_SCREEN in await first_screen(session, f"{own}/ws?width=80&height=24", own)
    await runner.cleanup()
    assert [program.returncode for program in programs] == [Exit.INCOMPLETE]


def test_without_the_extra_one_line_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(web, "find_spec", lambda name: None)
    assert web.run([], 8000) == Exit.BAD_INPUT
    assert capsys.readouterr().err == f"{web.MISSING}\n"


def test_the_browser_gets_what_was_asked_for(tmp_path: Path):
    wanted = RunOptions("APA-02", "apa", None, tmp_path, "Ann", True, 3)
    words = ["APA-02", "--spec", "apa", "--records", str(tmp_path), "--operator", "Ann", "--seed", "3", "--training"]
    assert wanted.arguments() == words
