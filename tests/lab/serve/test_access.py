"""Who is let in, for how long, what each role can ask, and what every answer says."""

import asyncio
import contextlib
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from masrel.errors import MasrelError, ParameterError
from tests.lab.serve.pages import (
    LIFE_S,
    OCCASIONS,
    ORIGIN,
    ROLES,
    Browser,
    Page,
    Pages,
    Role,
    Site,
    scope_of,
    small_study,
)


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path / "study")


def status(browser: Browser, path: str = "/rater/state") -> int:
    return browser.get(path).status_code


def restarted(site: Site, browser: Browser) -> Browser:
    """The same browser, when the server has been started again."""
    site.restart()
    browser.app = site.app
    return browser


@pytest.mark.parametrize(
    ("origin", "name", "more"),
    [
        (ORIGIN, "masrel-rater-", set()),
        ("https://192.168.1.5:8723", "__Host-masrel-rater-", {"Secure"}),
    ],
)
def test_a_cookie_is_no_scripts_and_no_other_sites_and_stays_encrypted(
    tmp_path: Path, origin: str, name: str, more: set[str]
) -> None:
    site = Site(tmp_path / "study", origin=origin)
    cookie = site.browser().get(site.access.new_address("rater")).headers["set-cookie"]
    first, *flags = cookie.split("; ")
    assert first.startswith(name)
    expected = {"Path=/", f"Max-Age={LIFE_S}", "HttpOnly", "SameSite=Strict"}
    assert set(flags) == expected | more


def test_an_address_lets_in_once_and_the_browser_it_let_in_again(site: Site) -> None:
    address, browser = site.access.new_address("rater"), site.browser()
    # and to the page, out of the history
    assert 'content="0; url=/rater"' in browser.get(address).text
    tablet = browser.get("/rater").json()["tablet"]
    answer = site.browser().get(address)
    assert answer.status_code == 401
    assert "This address was opened before" in answer.text
    assert status(browser, address) == 200
    assert browser.get("/rater").json()["tablet"] == tablet
    address = site.access.new_address("rater")
    answer = restarted(site, site.browser()).get(address)
    assert answer.status_code == 401
    assert "This address is no longer valid" in answer.text


def test_the_oldest_of_many_addresses_lapses_and_no_other_token_lets_in(
    site: Site,
) -> None:
    addresses = [site.access.new_address("rater") for _ in range(9)]
    other = site.access.new_address("coordinator")
    wrong = [f"/rater?token={token}" for token in ("", "x", "é", "%00", "x" * 400)]
    statuses = [status(site.browser(), each) for each in (*addresses, other, *wrong)]
    assert statuses == [401, *[200] * 9, *[401] * 5]


def test_every_token_is_compared(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    # How long a guess takes says nothing of where it is right.
    compared: list[bytes] = []
    monkeypatch.setattr("hmac.compare_digest", lambda one, _: compared.append(one))
    for role in (*ROLES, *ROLES):
        site.access.new_address(role)
    site.browser().get("/rater?token=guess")
    assert len(set(compared)) == 4


DAY_S = 86_400
Passing = tuple[float, float, bool]  # seconds of both clocks, whether it opens the page


@pytest.mark.parametrize(
    ("passing", "expected"),
    [
        ([(0.0, LIFE_S - 1, False)], 200),
        ([(0.0, LIFE_S + 1, False)], 401),
        # opening the page lets it live on
        ([(LIFE_S - 1, LIFE_S - 1, True)] * 3, 200),
        # a clock that is set logs nobody out
        *(([(days * DAY_S, 0.0, False)], 200) for days in (-3650, -1, 1, 3650)),
    ],
)
def test_a_cookie_ends_after_its_life_whatever_the_clock_is_set_to(
    site: Site, passing: list[Passing], expected: int
) -> None:
    browser = site.let_in()
    for now_s, ticks_s, opens in passing:
        site.now.s += now_s
        site.ticks.s += ticks_s
        if opens:
            browser.get("/rater")
    assert status(browser) == expected


def test_a_clock_that_was_wrong_gives_no_more_than_a_life(site: Site) -> None:
    site.now.s += 3650 * DAY_S
    browser = site.let_in()
    site.now.s -= 3650 * DAY_S
    assert status(restarted(site, browser)) == 200
    site.ticks.s += LIFE_S + 1
    assert status(browser) == 401


def test_the_key_is_its_owners_alone_and_without_it_everybody_is_logged_out(
    site: Site,
) -> None:
    key, browser = site.study.serve_key_file, site.let_in("coordinator")
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert stat.S_IMODE(key.parent.stat().st_mode) == 0o700
    assert restarted(site, browser).post("/coordinator/start").status_code == 200
    key.unlink()
    assert status(restarted(site, browser), "/coordinator/state") == 401


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("serve.txt", "format: 1\nkey: 12\n", "needed a line 'format: 1'"),
        *(
            ("tablets", text, "needed JSON with the rater of each")
            for text in ("", "[]", "{}", '{"tablets": 3}')
        ),
    ],
)
def test_a_damaged_key_or_list_of_tablets_is_refused(
    site: Site, name: str, text: str, why: str
) -> None:
    site.study.serve_key_file.with_name(name).write_text(text)
    with pytest.raises(ParameterError, match=why):
        site.restart()


def test_a_tablet_is_one_raters(site: Site) -> None:
    tablet = site.let_in().get("/rater/state").json()["tablet"]
    assert site.access.is_of_rater(tablet, "R1")
    assert not site.access.is_of_rater(tablet, "R2")
    site.restart()
    assert not site.access.is_of_rater(tablet, "R2")
    assert site.access.is_of_rater(tablet, "R1")
    browser = site.browser()
    browser.get(site.access.new_address("rater", rater="R2"))
    tablet = browser.get("/rater").json()["tablet"]
    assert not site.access.is_of_rater(tablet, "R1")


def test_requests_have_a_limit_and_an_emergency_stop_has_none(site: Site) -> None:
    def statuses(n: int) -> list[int]:
        return [each.status_code for each in browser.all("GET", ["/rater/state"] * n)]

    browser, coordinator = site.let_in(), site.let_in("coordinator")
    assert statuses(200)[-1] == 429
    assert browser.get("/rater/state").headers["retry-after"] == "1"
    assert {browser.post("/rater/stop").status_code for _ in range(50)} == {200}
    assert status(coordinator, "/coordinator/state") == 200  # each has its own
    site.ticks.s += 1
    assert statuses(40).count(200) == 30


@pytest.mark.parametrize(
    ("role", "path", "expected"),
    [
        ("rater", "/rater", 200),
        ("rater", "/rater/state", 200),
        ("rater", "/coordinator", 403),
        ("rater", "/static/common.js", 200),
        ("rater", "/report/report.html", 403),
        ("coordinator", "/report/report.html", 200),
        ("rater", "/rater?" + "x" * 600, 414),
    ],
)
def test_every_answer_has_the_headers_and_a_report_runs_no_script(
    site: Site, role: Any, path: str, expected: int
) -> None:
    answer = site.let_in(role).get(path)
    assert answer.status_code == expected
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert ("script-src 'self'" in policy) is not path.startswith("/report/")
    assert "unsafe-eval" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["referrer-policy"] == "same-origin"


def test_other_methods_and_bodies_are_refused_in_a_sentence(site: Site) -> None:
    browser = site.let_in()
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE", "PATCH"):
        assert browser.all(method, ["/rater/state"])[0].status_code == 405
    for body in (b"", b"[]", b"3", b"{", b'{"a":NaN}', b'{"a":"\\ud800"}'):
        answer = browser.post("/rater/answer", body)
        assert answer.status_code == 400
        assert answer.json() == {"why": "The request must be a JSON object."}
    answer = site.browser().get("/rater")  # which a person reads
    assert answer.status_code == 401
    assert answer.headers["content-type"].startswith("text/html")
    assert "needs an address that lets this browser in" in answer.text


class Streams:
    """Streams of events of one browser, which begin when a test says so."""

    def __init__(self, root: Path) -> None:
        self.n_open = 0
        self.site = Site(root, self.stream)
        (self.cookie,) = Site(root).let_in().cookies.jar
        self.ends: list[str] = []

    async def stream(self, _: Scope, receive: Receive, send: Send) -> None:
        """Stay open until it is ended."""
        await send({"type": "http.response.start", "status": 200, "headers": []})
        self.n_open += 1
        try:
            await receive()
        finally:
            self.n_open -= 1

    async def open(self) -> None:
        """Open one, and go on when it is over."""
        sent: list[Message] = []

        async def send(message: Message) -> None:
            sent.append(message)

        headers = {"cookie": f"{self.cookie.name}={self.cookie.value}"}
        request = httpx.Request("GET", f"{ORIGIN}/rater/events", headers=headers)
        await self.site.app(scope_of(request), asyncio.Event().wait, send)  # type: ignore[arg-type]
        self.ends.append(str(sent[-1]["type"]))


@pytest.mark.parametrize(("limit", "n_left"), [(4, 4), (1000, 10)])
def test_a_browsers_oldest_stream_ends_where_it_opens_too_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: int, n_left: int
) -> None:
    # without the limit all stay
    monkeypatch.setattr("masrel.lab.serve._middleware._MAX_STREAMS", limit)
    streams = Streams(tmp_path / "study")

    async def run() -> None:
        tasks = [asyncio.create_task(streams.open()) for _ in range(10)]
        await asyncio.sleep(0.05)
        assert streams.n_open == n_left
        assert [task.done() for task in tasks] == [
            *[True] * (10 - n_left),
            *[False] * n_left,
        ]
        streams.site.app.close_streams()
        await asyncio.gather(*tasks)
        assert streams.n_open == 0
        await streams.open()  # none begins any more
        assert set(streams.ends) == {"http.response.body"}

    asyncio.run(run())


ANYTHING = [None, True, 3, -1.5, 1e300, "", "x", "é" * 300, [], [[]], {}, {"a": []}]
NAMES = """ask answer grade code why who rater session rehearsal kind text severity
verb question id go_on begin stretch again skip anew cancel""".split()
ACTIONS = {
    "rater": ("answer", "done", "stop", "correct"),
    "coordinator": """start unblind note correct skip withdraw draw answer tablet job
    leave stop""".split(),
    "report": (),
}


@pytest.fixture
def pages(tmp_path: Path) -> Pages:
    return Pages(small_study(tmp_path / "study", OCCASIONS))


@pytest.mark.parametrize(
    ("who", "role", "expected"),
    [
        *(("rater", role, 403) for role in ("coordinator", "report")),
        ("coordinator", "rater", 403),
        *((None, role, 401) for role in ACTIONS),
    ],
)
def test_a_role_sees_and_does_nothing_of_the_other_and_a_stranger_nothing_at_all(
    pages: Pages, who: Role | None, role: str, expected: int
) -> None:
    browser = pages.let_in(who) if who else pages.browser()
    browser.headers["Origin"] = ORIGIN
    assert {
        (browser.get(path) if method == "GET" else browser.post(path)).status_code
        for method, path in pages.routes(role, ACTIONS[role])
    } == {expected}


@pytest.mark.parametrize("role", ["rater", "coordinator"])
def test_nothing_is_done_without_the_pages_secret(pages: Pages, role: Role) -> None:
    browser = pages.let_in(role)
    del browser.headers["X-Masrel-CSRF"]
    for action in ACTIONS[role]:
        assert browser.post(f"/{role}/{action}").status_code == 403


def bodies(number: int) -> Iterator[dict[str, object]]:
    """What a page never sends."""
    for i, value in enumerate(ANYTHING):
        body = dict.fromkeys(NAMES, value)
        yield {**body, "id": f"{number}-{i}-12345678"}
        yield {**body, "id": f"{number}-{i}-87654321", "who": "MK", "why": "x"}
        yield {**body, "id": f"{number}-{i}-11111111", "rater": "R1", "who": "MK"}


@pytest.mark.slow
@pytest.mark.parametrize("role", ["rater", "coordinator"])
def test_nothing_that_is_sent_makes_a_page_fail(pages: Pages, role: Role) -> None:
    browser = pages.let_in(role)

    async def send() -> set[int]:
        transport, answers = httpx.ASGITransport(pages.app), set()
        who = {"headers": browser.headers, "cookies": browser.cookies}
        async with httpx.AsyncClient(
            transport=transport, base_url=ORIGIN, **who
        ) as client:
            for number, action in enumerate(ACTIONS[role]):
                for body in bodies(number):
                    answer = await client.post(f"/{role}/{action}", json=body)
                    assert len(answer.json().get("why") or "") < 8000
                    answers.add(answer.status_code)
        await pages.manager.close()
        return answers

    assert asyncio.run(send()) <= {200, 403, 404, 409, 422}


ANSWERS = [
    {},
    *(
        {name: value}
        for name in ("grade", "go_on", "begin", "skip")
        for value in ANYTHING
    ),
    *({"again": value} for value in ANYTHING if value is not True),
    *({"grade": "2", "stretch": value} for value in ("1", -1, 1.5, [1], {}, 10**9)),
    *(
        {"answer": value}
        for value in ([1], {"a": 1}, "much", 1e300, 10**400, "y" * 9000)
    ),
]


@pytest.mark.slow
def test_no_answer_ends_a_session(pages: Pages) -> None:
    """What is no answer is refused, at every screen; the session goes on."""
    seen = set()

    async def run() -> None:
        manager = pages.manager
        await manager.start("R1", "test")
        page = Page(manager)
        while (state := manager.state())["screen"] != "over":
            if state["ask"] is None:
                await manager.changed(state["version"])
            elif state["screen"] in seen:
                await page.answer(state)
            else:
                seen.add(state["screen"])
                for answer in ANSWERS:
                    if manager.state()["ask"] == state["ask"]:
                        with contextlib.suppress(MasrelError):
                            await manager.answer(state["ask"], answer)
        await manager.close()
        assert state["how"] == "complete", state

    asyncio.run(run())
    assert seen >= {"instructions", "ready", "grade", "break", "question"}


@pytest.mark.parametrize(
    "path",
    [
        *("/report/../protocol.toml", "/report/%2e%2e/protocol.toml", "/report/%00"),
        *("/report/..%2f.key%2fsecret.txt", "/report//etc/passwd", "/report/"),
        *(
            "/static/../_role_pages.py",
            "/static/%2e%2e%2f_role_pages.py",
            "/static/%00",
        ),
        *("/static/", "/coordinator/x/y", "/rater/x", "/nothing", "/", "//rater"),
        "/RATER",
    ],
)
def test_nothing_else_is_there(pages: Pages, path: str) -> None:
    assert pages.let_in("coordinator").get(path).status_code in (403, 404)
