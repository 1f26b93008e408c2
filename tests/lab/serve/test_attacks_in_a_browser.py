"""Attacks by pages in a real browser, each with its guard and without."""

import asyncio
import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.responses import HTMLResponse, JSONResponse
from starlette.types import Receive, Scope, Send

from masrel.lab.serve import _access, _middleware, _server
from masrel.lab.serve._middleware import Middleware
from tests.lab.serve.test_server import Running

api = pytest.importorskip("playwright.async_api", reason="needs playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs chromium"),
]


class Pages:
    """Pages as ours, one of which shows what comes from outside as it is."""

    def __init__(self) -> None:
        self.n_stops = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request that has passed."""
        if scope["path"] == "/rater/stop":
            self.n_stops += 1
            await JSONResponse({})(scope, receive, send)
        else:
            text = "<h1>page</h1><script>document.title = 'run'</script>"
            page = f"<!doctype html><title>safe</title>{text}<p id=x onclick='1'>"
            await HTMLResponse(page)(scope, receive, send)


EVIL = """<!doctype html><title>evil</title>
<iframe src="{victim}/rater"></iframe>
<form method=post enctype=text/plain target=hidden action="{victim}/rater/stop">
<input name='{{"a":"' value='"}}'></form><iframe name=hidden></iframe>
<script>
const options = {{method: "POST", credentials: "include", body: "{{}}"}};
const json = {{...options, headers: {{"Content-Type": "application/json"}}}};
const sent = ["no-cors", "cors"].map(mode =>
  fetch("{victim}/rater/stop", {{...options, mode}}).catch(() => 0));
fetch("{victim}/rater/stop", json).catch(() => 0);
document.forms[0].submit();
Promise.all(sent).then(() => setTimeout(() => document.title = "done", 300));
</script>"""


async def evil_site(victim: str) -> asyncio.Server:
    """A page of somebody else, on another port of the same computer."""

    async def answer(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        await reader.readuntil(b"\r\n\r\n")
        page = EVIL.format(victim=victim)
        writer.write(
            f"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n{page}".encode()
        )
        await writer.drain()
        writer.close()

    return await asyncio.start_server(answer, "127.0.0.1", 0)


async def sends_from_elsewhere(page: Any, pages: Pages, server: Running) -> bool:
    """Whether a page on another port can press the stop."""
    await visit_evil(page, server)
    return pages.n_stops > 0


async def frames(page: Any, _: Pages, server: Running) -> bool:
    """Whether a page can put ours into a frame, under its own buttons."""
    await visit_evil(page, server)
    shown = [await frame.content() for frame in page.frames[1:]]
    return any("<h1>page</h1>" in text for text in shown)


async def visit_evil(page: Any, server: Running) -> None:
    evil = await evil_site(server.access.origin)
    async with evil:
        await page.goto(f"http://127.0.0.1:{evil.sockets[0].getsockname()[1]}/")
        await page.wait_for_function("document.title === 'done'")


async def reads_the_cookie(page: Any, _: Pages, __: Running) -> bool:
    """Whether a script can read what lets the browser in."""
    return "masrel" in await page.evaluate("document.cookie")


async def runs_a_script(page: Any, _: Pages, __: Running) -> bool:
    """Whether a script runs that got into the page."""
    return bool(await page.title() == "run")


async def keeps_the_token(page: Any, _: Pages, __: Running) -> bool:
    """Whether one can go back to the address that lets in."""
    await page.go_back()
    return "token" in page.url


def no_checks(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Middleware, "_check_sender", lambda *_: None)
    patch.setattr(Middleware, "_check_page", lambda *_: None)


def no_policy(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(_middleware, "_OF_PAGES", "default-src * 'unsafe-inline'")
    left = {"Cache-Control": "no-store"}
    patch.setattr(_middleware, "_HEADERS", left)


def readable(patch: pytest.MonkeyPatch) -> None:
    cookie = _access.Access.cookie
    patch.setattr(
        _access.Access,
        "cookie",
        lambda *args: cookie(*args).replace("HttpOnly; ", ""),
    )


def by_a_link(patch: pytest.MonkeyPatch) -> None:
    page = _middleware.page

    def clicked(name: str, **context: object) -> str:
        text = page(name, **context)
        return text.replace('http-equiv="refresh"', "")

    patch.setattr(_middleware, "page", clicked)


Attack = Callable[[Any, Pages, Running], Awaitable[bool]]
ATTACKS: dict[str, tuple[Attack, Callable[[pytest.MonkeyPatch], None]]] = {
    "sends from elsewhere": (sends_from_elsewhere, no_checks),
    "frames": (frames, no_policy),
    "reads the cookie": (reads_the_cookie, readable),
    "runs a script": (runs_a_script, no_policy),
    "keeps the token": (keeps_the_token, by_a_link),
}


async def works(attack: Attack, pages: Pages, root: Path) -> bool:
    """Let a browser in and see whether an attack works."""
    server = Running(root)
    async with server, api.async_playwright() as playwright:
        browser = await playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox"]
        )
        page = await browser.new_page()
        await page.goto(server.access.new_address("rater"))
        if await page.get_by_text("Go on").count():
            await page.get_by_text("Go on").click(timeout=1000)
        await page.wait_for_url("**/rater")
        has_worked = await attack(page, pages, server)
        await browser.close()
        return has_worked


@pytest.mark.parametrize("guarded", [True, False])
@pytest.mark.parametrize("name", ATTACKS)
def test_no_page_does_what_only_ours_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, guarded: bool
) -> None:
    attack, without = ATTACKS[name]
    pages = Pages()
    monkeypatch.setattr(
        _server, "make_app", lambda _, access: Middleware(pages, access)
    )
    if not guarded:
        without(monkeypatch)
    is_done = asyncio.run(works(attack, pages, tmp_path / "study"))
    assert is_done is not guarded
