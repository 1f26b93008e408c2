"""Attacks: none works, and each does when the guard against it is taken out.

By requests, and by pages in a real browser.
"""

import asyncio
import contextlib
import hmac
import json
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.responses import HTMLResponse, JSONResponse
from starlette.types import Receive, Scope, Send

from tests.lab.serve.pages import (
    ROLES,
    Access,
    Middleware,
    Role,
    Running,
    Site,
    access,
    middleware,
)

Attack = Callable[[Site], bool]
Removal = Callable[[pytest.MonkeyPatch], None]


def set_to(name: str, value: object, of: object = middleware) -> Removal:
    """Set a limit or a function."""
    return lambda patch: patch.setattr(of, name, value)


def nothing(*_: object) -> None:
    """Take the place of a check that raises."""


def sends(
    role: Role,
    method: str,
    path: str,
    body: Any = None,
    *,
    has_origin: bool = True,
    **headers: str,
) -> Attack:
    """A request of a browser that was let in, which a guard refuses."""

    def attack(site: Site) -> bool:
        browser = site.let_in(role)
        if not has_origin:  # as for a script or an image
            del browser.headers["Origin"]
        if method == "GET":
            return browser.get(path, **headers).status_code == 200
        return browser.post(path, body, **headers).status_code == 200

    return attack


def address_opened_twice(site: Site) -> bool:
    address = site.access.new_address("coordinator")
    site.browser().get(address)
    return site.browser("10.0.0.66").get(address).status_code == 200


def address_of_the_other_role(site: Site) -> bool:
    address = site.access.new_address("rater").replace("/rater", "/coordinator")
    return site.browser().get(address).status_code == 200


def address_of_another_study(site: Site) -> bool:
    other = Site(site.study.root.with_name("other"))
    return site.browser().get(other.access.new_address("rater")).status_code == 200


def opens(site: Site, role: Role, cookie: str) -> bool:
    """Whether a cookie opens a page."""
    browser = site.browser()
    browser.cookies.set(site.access.cookie_name(role), cookie)
    return browser.get(f"/{role}/state").status_code == 200


def forged_cookie(site: Site) -> bool:
    return opens(site, "coordinator", f"{'0' * 32}.{int(site.now())}.{'0' * 64}")


def raters_cookie_as_the_coordinators(site: Site) -> bool:
    return opens(site, "coordinator", *site.let_in("rater").cookies.values())


def cookie_of_another_study(site: Site) -> bool:
    other = Site(site.study.root.with_name("other"))
    return opens(site, "rater", *other.let_in("rater").cookies.values())


def stolen_cookie_of_last_month(site: Site) -> bool:
    browser = site.let_in("rater")
    site.now.s += 30 * 86_400
    site.restart()  # a server that has seen it knows how long it lives
    browser.app = site.app
    return browser.get("/rater/state").status_code == 200


def rater_at_the_coordinators_pages(site: Site) -> bool:
    browser = site.let_in("rater")
    paths = ("/coordinator", "/coordinator/state", "/coordinator/events", "/report/x")
    actions = ("start", "unblind", "withdraw", "tablet", "job")
    return 200 in [
        *(browser.get(path).status_code for path in paths),
        *(browser.post(f"/coordinator/{name}").status_code for name in actions),
    ]


def secret_of_the_raters_page(site: Site) -> bool:
    secret = site.let_in("rater").headers["X-Masrel-CSRF"]
    start = sends("coordinator", "POST", "/coordinator/start", X_Masrel_CSRF=secret)
    return start(site)


def flood(site: Site) -> bool:
    answers = site.let_in("rater").all("GET", ["/rater/state"] * 400)
    return {answer.status_code for answer in answers} == {200}


def flood_without_a_cookie(site: Site) -> bool:
    answers = site.browser().all("GET", ["/static/x"] * 200)
    return {answer.status_code for answer in answers} == {200}


def many_clients(site: Site) -> bool:
    for i in range(1500):
        site.app._without.allow(f"10.0.{i // 250}.{i % 250}")
    return len(site.app._without._left) > 1024


async def pieces() -> AsyncIterator[bytes]:
    """A body that does not say how long it is."""
    yield b'{"answer": "'
    for _ in range(100):
        yield b"x" * 1000
    yield b'"}'


def deep_body(site: Site) -> bool:
    deep = b'{"a":' + b"[" * 30_000 + b"]" * 30_000 + b"}"
    try:
        site.let_in("rater").post("/rater/answer", deep)
    except RecursionError:  # the server fails
        return True
    return False


def preview_uses_an_address_up(site: Site) -> bool:
    address = site.access.new_address("rater")
    site.browser().get(address, Sec_Purpose="prefetch;prerender")
    site.browser().all("HEAD", [address])
    return site.browser().get(address).status_code != 200


def twice(patch: pytest.MonkeyPatch) -> None:
    class Kept(list[object]):
        def remove(self, _: object) -> None:
            pass

    begin = Access.__init__

    def init(self: Access, *args: object, **options: object) -> None:
        begin(self, *args, **options)  # type: ignore[arg-type]
        self._tokens = Kept()  # type: ignore[assignment]

    patch.setattr(Access, "__init__", init)


def any_token(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(access, "_same", lambda tokens, *_: tokens[0] if tokens else None)
    new = Access.let_in

    def let_in(self: Access, role: Role, *token: str) -> access.Visitor:
        if not self._tokens:
            self.new_address(role)
        return new(self, role, *token)  # type: ignore[call-arg,arg-type]

    patch.setattr(Access, "let_in", let_in)


def any_role(patch: pytest.MonkeyPatch) -> None:
    visitor = Access.visitor

    def anybody(
        self: Access, role: Role, cookies: dict[str, str]
    ) -> access.Visitor | None:
        known = [visitor(self, each, cookies) for each in (role, *ROLES)]
        tablets = [each.tablet for each in known if each]
        return access.Visitor(role, tablets[0]) if tablets else None

    patch.setattr(Access, "visitor", anybody)


ANY_MAC = set_to("compare_digest", lambda *_: True, hmac)
ANY_PAGE = set_to("_check_page", nothing, Middleware)
ANY_SENDER = set_to("_check_sender", nothing, Middleware)
ANY_RATE = set_to("allow", lambda *_: True, middleware._Budgets)
ANY_SIZE = set_to("_MAX_BODY", 10**9)
LONG = {"answer": "x" * 70_000}
STOP, STATE = ("rater", "POST", "/rater/stop"), ("rater", "GET", "/rater/state")
ANSWER, START = ("rater", "POST", "/rater/answer"), ("coordinator", "POST")
SCRIPT = {"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "no-cors"}
HEADERS = {f"X_{i}": "x" * 1000 for i in range(20)}

GUARDS: dict[str, tuple[Attack, Removal]] = {
    "one time": (address_opened_twice, twice),
    "role of an address": (address_of_the_other_role, any_token),
    "study of an address": (address_of_another_study, any_token),
    "signature": (forged_cookie, ANY_MAC),
    "role of a cookie": (raters_cookie_as_the_coordinators, ANY_MAC),
    "study of a cookie": (cookie_of_another_study, ANY_MAC),
    "life of a cookie": (
        stolen_cookie_of_last_month,
        set_to("LIFE_S", 10**9, access),
    ),
    "roles": (rater_at_the_coordinators_pages, any_role),
    "CSRF": (sends(*START, "/coordinator/start", X_Masrel_CSRF="0" * 64), ANY_PAGE),
    "CSRF of a role": (secret_of_the_raters_page, ANY_PAGE),
    # The same site for cookies, which are sent, strict or not
    "Origin": (sends(*STOP, Origin="http://127.0.0.1:9999"), ANY_SENDER),
    "Sec-Fetch-Site": (sends(*STATE, has_origin=False, **SCRIPT), ANY_SENDER),
    # A foreign name of this computer
    "Host": (sends(*STATE, has_origin=False, Host="evil.example:8723"), ANY_SENDER),
    # What a form can send without the browser asking first
    "JSON alone": (sends(*STOP, Content_Type="text/plain"), ANY_PAGE),
    "rate": (flood, ANY_RATE),
    "rate of strangers": (flood_without_a_cookie, ANY_RATE),
    "number of clients": (many_clients, set_to("_MAX_CLIENTS", 10**6)),
    "size of a body": (sends(*ANSWER, LONG), ANY_SIZE),
    "size of pieces": (lambda site: sends(*ANSWER, pieces())(site), ANY_SIZE),
    "depth of a body": (deep_body, set_to("parse_json", json.loads)),
    "size of headers": (sends(*STATE, **HEADERS), set_to("_MAX_HEADERS", 10**9)),
    "size of a query": (
        sends("rater", "GET", "/rater/state?" + "x" * 1000),
        set_to("_MAX_QUERY", 10**9),
    ),
    "previews": (preview_uses_an_address_up, set_to("_is_preview", lambda _: False)),
}


@pytest.mark.parametrize("guarded", [True, False])
@pytest.mark.parametrize("name", GUARDS)
def test_no_attack_works_and_each_does_without_its_guard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, guarded: bool
) -> None:
    attack, without = GUARDS[name]
    if not guarded:
        without(monkeypatch)
    assert attack(Site(tmp_path / "study")) is not guarded


class Victim:
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


async def visit_evil(page: Any, server: Running) -> None:
    """Visit a page of somebody else, on another port of the same computer."""

    async def answer(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        await reader.readuntil(b"\r\n\r\n")
        text = EVIL.format(victim=server.access.origin)
        head = "HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n"
        writer.write(f"{head}{text}".encode())
        await writer.drain()
        writer.close()

    async with await asyncio.start_server(answer, "127.0.0.1", 0) as evil:
        await page.goto(f"http://127.0.0.1:{evil.sockets[0].getsockname()[1]}/")
        await page.wait_for_function("document.title === 'done'")


async def sends_from_elsewhere(page: Any, victim: Victim, server: Running) -> bool:
    """Whether a page on another port can press the stop."""
    await visit_evil(page, server)
    return victim.n_stops > 0


async def frames(page: Any, _: Victim, server: Running) -> bool:
    """Whether a page can put ours into a frame, under its own buttons."""
    await visit_evil(page, server)
    shown = [await frame.content() for frame in page.frames[1:]]
    return any("<h1>page</h1>" in text for text in shown)


async def reads_the_cookie(page: Any, *_: object) -> bool:
    """Whether a script can read what lets the browser in."""
    return "masrel" in await page.evaluate("document.cookie")


async def runs_a_script(page: Any, *_: object) -> bool:
    """Whether a script runs that got into the page."""
    return bool(await page.title() == "run")


async def keeps_the_token(page: Any, *_: object) -> bool:
    """Whether one can go back to the address that lets in."""
    await page.go_back()
    return "token" in page.url


def no_checks(patch: pytest.MonkeyPatch) -> None:
    ANY_SENDER(patch)
    ANY_PAGE(patch)


def no_policy(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(middleware, "_OF_PAGES", "default-src * 'unsafe-inline'")
    patch.setattr(middleware, "_HEADERS", {"Cache-Control": "no-store"})


def readable(patch: pytest.MonkeyPatch) -> None:
    cookie = Access.cookie
    plain = lambda *args: cookie(*args).replace("HttpOnly; ", "")  # noqa: E731
    patch.setattr(Access, "cookie", plain)


def by_a_link(patch: pytest.MonkeyPatch) -> None:
    page = middleware.page

    def clicked(name: str, **context: object) -> str:
        return page(name, **context).replace('http-equiv="refresh"', "")

    patch.setattr(middleware, "page", clicked)


BY_PAGES: dict[str, tuple[Callable[..., Awaitable[bool]], Removal]] = {
    "sends from elsewhere": (sends_from_elsewhere, no_checks),
    "frames": (frames, no_policy),
    "reads the cookie": (reads_the_cookie, readable),
    "runs a script": (runs_a_script, no_policy),
    "keeps the token": (keeps_the_token, by_a_link),
}


@pytest.mark.slow
def test_no_page_does_what_only_ours_may_and_each_does_without_its_guard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    api = pytest.importorskip("playwright.async_api", reason="needs playwright")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs chromium")

    async def works(name: str, guarded: bool, browser: Any) -> bool:
        (attack, without), victim = BY_PAGES[name], Victim()
        with monkeypatch.context() as patch:
            made = lambda _, access: Middleware(victim, access)  # noqa: E731
            patch.setattr("masrel.lab.serve._server.make_app", made)
            if not guarded:
                without(patch)
            async with Running(tmp_path / f"{name} {guarded}") as server:
                page = await (await browser.new_context()).new_page()
                await page.goto(server.access.new_address("rater"))
                # the page goes on by itself, but where its guard is out
                with contextlib.suppress(api.TimeoutError):
                    await page.wait_for_url("**/rater", timeout=2000)
                if "token" in page.url:
                    await page.get_by_text("Continue").click()
                    await page.wait_for_url("**/rater")
                has_worked = await attack(page, victim, server)
                await page.context.close()
                return has_worked

    async def all_of_them() -> dict[tuple[str, bool], bool]:
        async with api.async_playwright() as web:
            options = {"executable_path": chromium, "args": ["--no-sandbox"]}
            browser = await web.chromium.launch(**options)
            return {
                (name, guarded): await works(name, guarded, browser)
                for name in BY_PAGES
                for guarded in (True, False)
            }

    results = asyncio.run(all_of_them())
    assert results == {(name, guarded): not guarded for name, guarded in results}
