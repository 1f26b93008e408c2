"""What each role can ask of the pages as they are, and that nothing makes them fail."""

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from masrel.errors import MasrelError
from tests.lab.serve.pages import (
    OCCASIONS,
    ORIGIN,
    Browser,
    Page,
    Pages,
    Role,
    small_study,
)

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


def statuses(pages: Pages, browser: Browser, role: str) -> set[int]:
    return {
        (browser.get(path) if method == "GET" else browser.post(path)).status_code
        for method, path in pages.routes(role, ACTIONS[role])
    }


@pytest.mark.parametrize(
    ("who", "role"),
    [("rater", "coordinator"), ("rater", "report"), ("coordinator", "rater")],
)
def test_a_role_sees_and_does_nothing_of_the_other(
    pages: Pages, who: Role, role: str
) -> None:
    assert statuses(pages, pages.browser(who), role) == {403}


@pytest.mark.parametrize("role", ACTIONS)
def test_a_stranger_sees_nothing(pages: Pages, role: str) -> None:
    browser = Browser(pages.app)
    browser.headers["Origin"] = ORIGIN
    assert statuses(pages, browser, role) == {401}


@pytest.mark.parametrize("role", ["rater", "coordinator"])
def test_nothing_is_done_without_the_pages_secret(pages: Pages, role: Role) -> None:
    browser = pages.browser(role)
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
    browser = pages.browser(role)

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
    assert pages.browser("coordinator").get(path).status_code in (403, 404)
