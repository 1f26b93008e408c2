"""What each role can ask of the pages as they are, and that nothing makes them fail."""

import asyncio
import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from starlette.routing import Route

from masrel.errors import MasrelError
from masrel.lab.schedule import read_schedule
from masrel.lab.serve._access import Access, Role
from masrel.lab.serve._app import make_app
from masrel.lab.serve._desk import Desk
from tests.lab.serve.desks import OCCASIONS, Page, small_study
from tests.lab.serve.sender import ORIGIN, Browser

ANYTHING = [None, True, 3, -1.5, 1e300, "", "x", "é" * 300, [], [[]], {}, {"a": []}]
NAMES = """ask answer grade code why who rater session rehearsal kind text severity
verb question id go_on begin stretch again skip anew cancel""".split()


class Study:
    """A study and its pages, without a server."""

    def __init__(self, root: Path) -> None:
        self.paths = small_study(root, OCCASIONS)
        self.access = Access(self.paths, origin=ORIGIN)
        self.desk = Desk(self.paths, clock="simulated")
        self.app = make_app(self.desk, self.access)
        self.app._with_cookie.allow = lambda _: True  # type: ignore[method-assign]

    def browser(self, role: Role) -> Browser:
        """Return a browser that was let in."""
        browser = Browser(self.app, ORIGIN, "10.0.0.7")
        browser.get(self.access.new_address(role))
        page = browser.get(f"/{role}").text
        (csrf,) = re.findall(r'name="csrf" content="([0-9a-f]{64})"', page)
        browser.headers.update({"X-Masrel-CSRF": csrf, "Origin": ORIGIN})
        return browser

    def routes(self, role: str) -> Iterator[tuple[str, str]]:
        """Methods and paths of what is there for a role."""
        for route in self.app._app.routes:  # type: ignore[attr-defined]
            assert isinstance(route, Route)
            acts = ("start", "unblind", "note", "correct", "skip", "withdraw", "draw")
            acts += ("answer", "tablet", "job", "leave")
            if route.path.startswith(f"/{role}"):
                for act in acts if "{act}" in route.path else ("",):
                    path = route.path.replace("{act}", act)
                    for method in (route.methods or set()) - {"HEAD"}:
                        yield method, path.replace("{path:path}", "report.html")


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return Study(tmp_path / "study")


def statuses(browser: Browser, routes: Iterator[tuple[str, str]]) -> set[int]:
    return {
        (browser.get(path) if method == "GET" else browser.post(path)).status_code
        for method, path in routes
    }


@pytest.mark.parametrize("at", ["coordinator", "report"])
def test_a_rater_sees_and_does_nothing_of_the_coordinators(
    study: Study, at: str
) -> None:
    assert statuses(study.browser("rater"), study.routes(at)) == {403}


def test_a_coordinator_does_nothing_in_the_raters_name(study: Study) -> None:
    assert statuses(study.browser("coordinator"), study.routes("rater")) == {403}


@pytest.mark.parametrize("role", ["rater", "coordinator", "report"])
def test_a_stranger_sees_nothing(study: Study, role: str) -> None:
    browser = Browser(study.app, ORIGIN, "10.0.0.7")
    browser.headers["Origin"] = ORIGIN
    assert statuses(browser, study.routes(role)) == {401}


@pytest.mark.parametrize("role", ["rater", "coordinator"])
def test_nothing_is_done_without_the_pages_secret(study: Study, role: Role) -> None:
    browser = study.browser(role)
    del browser.headers["X-Masrel-CSRF"]
    posts = [each for each in study.routes(role) if each[0] == "POST"]
    assert len(posts) >= 4
    assert statuses(browser, iter(posts)) == {403}


def bodies(number: int) -> Iterator[dict[str, object]]:
    """What a page never sends."""
    for i, value in enumerate(ANYTHING):
        body = dict.fromkeys(NAMES, value)
        yield {**body, "id": f"{number}-{i}-12345678"}
        yield {**body, "id": f"{number}-{i}-87654321", "who": "MK", "why": "x"}
        yield {**body, "id": f"{number}-{i}-11111111", "rater": "R1", "who": "MK"}


async def send_anything(study: Study, browser: Browser, paths: list[str]) -> set[int]:
    """Send everything to every address -> the statuses."""
    transport = httpx.ASGITransport(study.app)
    answers = set()
    async with httpx.AsyncClient(
        transport=transport,
        base_url=ORIGIN,
        headers=browser.headers,
        cookies=browser.cookies,
    ) as client:
        for number, path in enumerate(paths):
            for body in bodies(number):
                answer = await client.post(path, json=body)
                assert len(answer.json().get("why") or "") < 8000
                answers.add(answer.status_code)
    await study.desk.close()
    return answers


@pytest.mark.slow
@pytest.mark.parametrize("role", ["rater", "coordinator"])
def test_nothing_that_is_sent_makes_a_page_fail(study: Study, role: Role) -> None:
    posts = [path for method, path in study.routes(role) if method == "POST"]
    sent = send_anything(study, study.browser(role), posts)
    assert asyncio.run(sent) <= {200, 403, 404, 409, 422}


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
def test_no_answer_ends_a_session(study: Study) -> None:
    """What is no answer is refused, at every screen; the session goes on."""
    seen = set()

    async def run() -> None:
        desk = study.desk
        await desk.start("R1", "test")
        page = Page(desk)
        while (state := desk.state())["screen"] != "over":
            if state["ask"] is None:
                await desk.changed(state["version"])
                continue
            if state["screen"] not in seen:
                seen.add(state["screen"])
                for answer in ANSWERS:
                    if desk.state()["ask"] == state["ask"]:
                        with contextlib.suppress(MasrelError):
                            await desk.answer(state["ask"], answer)
                continue
            await page.answer(state)
        await desk.close()
        assert state["how"] == "complete", state

    asyncio.run(run())
    assert seen >= {"instructions", "ready", "grade", "break", "question"}


@pytest.mark.parametrize(
    "path",
    [
        *("/report/../protocol.toml", "/report/%2e%2e/protocol.toml", "/report/%00"),
        *("/report/..%2f.key%2fsecret.txt", "/report//etc/passwd", "/report/"),
        *("/static/../_app.py", "/static/%2e%2e%2f_app.py", "/static/%00", "/static/"),
        *("/coordinator/x/y", "/rater/x", "/nothing", "/", "//rater", "/RATER"),
    ],
)
def test_nothing_else_is_there(study: Study, path: str) -> None:
    assert study.browser("coordinator").get(path).status_code in (403, 404)


class Watcher:
    """A rater's page through a session; all that it was shown, step by step."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self.shown: list[str] = []

    async def run(self) -> None:
        """Grade everything, and look at every step."""
        transport = httpx.ASGITransport(self.study.app)
        async with httpx.AsyncClient(transport=transport, base_url=ORIGIN) as client:
            await client.get(self.study.access.new_address("rater"))
            await self.look(client, "/rater")
            await self.study.desk.start("R1", "test")
            page = Page(self.study.desk)
            while True:
                state = self.study.desk.state()
                await self.look(client, "/rater/state")
                if state["screen"] == "over":
                    await self.study.desk.close()
                    return
                if state["ask"]:
                    await page.answer(state)
                else:
                    await self.study.desk.changed(state["version"])

    async def look(self, client: httpx.AsyncClient, path: str) -> None:
        """Keep what a page is shown."""
        answer = await client.get(path)
        assert answer.status_code == 200
        self.shown.append(answer.text)


def test_a_raters_page_names_no_model_no_order_and_no_other_rater(
    study: Study,
) -> None:
    watcher = Watcher(study)
    asyncio.run(watcher.run())
    schedule = read_schedule(study.paths.schedule_file("R1", "test"))
    codes = [each.code for each in schedule.presentations]
    assert all(any(code in text for text in watcher.shown) for code in codes)
    reached = -1
    for text in watcher.shown:
        assert not re.search(r"HM\d|\bR2\b|intended|residual|catch_", text)
        here = [i for i, code in enumerate(codes) if code in text]
        reached = max(reached, *here, -1) if here else reached
        assert all(i <= reached for i in here)
        assert max(here, default=-1) - min(here, default=-1) <= 1  # the last grade's
