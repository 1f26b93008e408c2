"""Who is let in, for how long, and what every answer says."""

import asyncio
import stat
from pathlib import Path
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from masrel.errors import ParameterError
from masrel.lab.serve._access import LIFE_S, ROLES
from tests.lab.serve.sender import Browser, Site


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path / "study")


def status(browser: Browser, path: str = "/rater/state") -> int:
    return browser.get(path).status_code


@pytest.mark.parametrize("role", ROLES)
def test_an_address_leads_to_the_page_and_out_of_the_history(
    site: Site, role: Any
) -> None:
    browser = site.browser()
    answer = browser.get(site.access.new_address(role))
    assert f'content="0; url=/{role}"' in answer.text
    assert browser.get(f"/{role}").json()["role"] == role


def test_a_cookie_is_no_scripts_and_no_other_sites(site: Site) -> None:
    answer = site.browser().get(site.access.new_address("rater"))
    flags = set(answer.headers["set-cookie"].split("; ")[1:])
    assert flags == {"Path=/", f"Max-Age={LIFE_S}", "HttpOnly", "SameSite=Strict"}


def test_a_cookie_stays_in_what_is_encrypted(tmp_path: Path) -> None:
    site = Site(tmp_path / "study", origin="https://192.168.1.5:8723")
    answer = site.browser().get(site.access.new_address("rater"))
    assert answer.headers["set-cookie"].startswith("__Host-masrel-rater-")
    assert "Secure" in answer.headers["set-cookie"].split("; ")


def test_an_address_opened_again_says_so(site: Site) -> None:
    address = site.access.new_address("rater")
    site.browser().get(address)
    answer = site.browser().get(address)
    assert answer.status_code == 401
    assert "This address was opened before" in answer.text


def test_the_browser_that_was_let_in_may_open_its_address_again(site: Site) -> None:
    address = site.access.new_address("rater")
    browser = site.browser()
    browser.get(address)
    before = browser.get("/rater").json()["tablet"]
    assert status(browser, address) == 200
    assert browser.get("/rater").json()["tablet"] == before


def test_the_oldest_of_many_addresses_lapses(site: Site) -> None:
    addresses = [site.access.new_address("rater") for _ in range(9)]
    other = site.access.new_address("coordinator")
    assert [status(site.browser(), each) for each in (*addresses, other)] == [
        401,
        *[200] * 9,
    ]


@pytest.mark.parametrize("token", ["", "x", "é", "%00", "x" * 400])
def test_no_other_token_lets_in(site: Site, token: str) -> None:
    site.access.new_address("rater")
    assert status(site.browser(), f"/rater?token={token}") == 401


def test_every_token_is_compared(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    # How long a guess takes says nothing of where it is right.
    compared: list[bytes] = []

    def note(one: bytes, _: bytes) -> bool:
        compared.append(one)
        return False

    monkeypatch.setattr("hmac.compare_digest", note)
    for role in ROLES:
        site.access.new_address(role)
        site.access.new_address(role)
    site.browser().get("/rater?token=guess")
    assert len(set(compared)) == 4


def test_a_browser_stays_let_in_when_the_server_is_started_again(site: Site) -> None:
    browser = site.let_in("coordinator")
    site.restart()
    browser.app = site.app
    assert status(browser, "/coordinator/state") == 200
    assert browser.post("/coordinator/start").status_code == 200


def test_an_address_does_not_outlive_the_server(site: Site) -> None:
    address = site.access.new_address("rater")
    site.restart()
    answer = site.browser().get(address)
    assert answer.status_code == 401
    assert "not one of this study now" in answer.text


def test_a_cookie_ends(site: Site) -> None:
    browser = site.let_in()
    site.ticks.s += LIFE_S - 1
    assert status(browser) == 200
    site.ticks.s += 2
    assert status(browser) == 401


def test_opening_the_page_lets_it_live_on(site: Site) -> None:
    browser = site.let_in()
    for _ in range(3):
        site.ticks.s += LIFE_S - 1
        site.now.s += LIFE_S - 1
        browser.get("/rater")
    assert status(browser) == 200


@pytest.mark.parametrize("days", [-3650, -1, 1, 3650])
def test_a_clock_that_is_set_logs_nobody_out(site: Site, days: int) -> None:
    browser = site.let_in()
    site.now.s += days * 86_400
    assert status(browser) == 200


def test_a_clock_that_was_wrong_gives_no_more_than_a_life(site: Site) -> None:
    site.now.s += 10 * 365 * 86_400
    browser = site.let_in()
    site.now.s -= 10 * 365 * 86_400
    site.restart()
    browser.app = site.app
    assert status(browser) == 200
    site.ticks.s += LIFE_S + 1
    assert status(browser) == 401


def test_the_key_is_its_owners_alone(site: Site) -> None:
    key = site.study.serve_key_file
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert stat.S_IMODE(key.parent.stat().st_mode) == 0o700


def test_without_the_key_everybody_is_logged_out(site: Site) -> None:
    browser = site.let_in()
    site.study.serve_key_file.unlink()
    site.restart()
    browser.app = site.app
    assert status(browser) == 401


def test_a_key_that_is_none_is_refused(site: Site) -> None:
    site.study.serve_key_file.write_text("format: 1\nkey: 12\n")
    with pytest.raises(ParameterError, match="needed a line 'format: 1'"):
        site.restart()


def test_a_tablet_is_one_raters(site: Site) -> None:
    tablet = site.let_in().get("/rater/state").json()["tablet"]
    assert site.access.is_of_rater(tablet, "R1")
    assert not site.access.is_of_rater(tablet, "R2")
    site.restart()
    assert not site.access.is_of_rater(tablet, "R2")
    assert site.access.is_of_rater(tablet, "R1")


def test_an_address_can_be_for_one_rater(site: Site) -> None:
    browser = site.browser()
    browser.get(site.access.new_address("rater", rater="R2"))
    tablet = browser.get("/rater").json()["tablet"]
    assert not site.access.is_of_rater(tablet, "R1")


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"tablets": 3}'])
def test_a_list_of_tablets_that_is_none_is_refused(site: Site, text: str) -> None:
    site.study.serve_key_file.with_name("tablets").write_text(text)
    with pytest.raises(ParameterError, match="needed JSON with the rater of each"):
        site.restart()


def test_an_emergency_stop_is_never_too_much(site: Site) -> None:
    browser = site.let_in()
    states = browser.all("GET", ["/rater/state"] * 200, headers={})
    assert states[-1].status_code == 429
    assert states[-1].headers["retry-after"] == "1"
    stops = [browser.post("/rater/stop").status_code for _ in range(50)]
    assert set(stops) == {200}


def test_one_browser_does_not_use_up_what_others_may(site: Site) -> None:
    rater, coordinator = site.let_in(), site.let_in("coordinator")
    rater.all("GET", ["/rater/state"] * 200, headers={})
    assert status(coordinator, "/coordinator/state") == 200


def test_what_may_be_asked_comes_back_with_time(site: Site) -> None:
    browser = site.let_in()
    browser.all("GET", ["/rater/state"] * 200, headers={})
    site.ticks.s += 1
    answers = browser.all("GET", ["/rater/state"] * 40, headers={})
    assert [answer.status_code for answer in answers].count(200) == 30


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("/rater", 200),
        ("/rater/state", 200),
        ("/coordinator", 403),
        ("/static/common.js", 200),
        ("/report/report.html", 403),
        ("/rater?" + "x" * 600, 414),
    ],
)
def test_every_answer_has_the_headers(site: Site, path: str, expected: int) -> None:
    answer = site.let_in().get(path)
    assert answer.status_code == expected
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "script-src 'self'" in policy or path.startswith("/report/")
    assert "unsafe-eval" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["referrer-policy"] == "same-origin"


def test_a_report_runs_no_script(site: Site) -> None:
    answer = site.let_in("coordinator").get("/report/report.html")
    assert "script-src" not in answer.headers["content-security-policy"]


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "TRACE", "PATCH"])
def test_other_methods_are_refused(site: Site, method: str) -> None:
    assert site.let_in().all(method, ["/rater/state"], headers={})[0].status_code == 405


@pytest.mark.parametrize(
    "body", [b"", b"[]", b"3", b"{", b'{"a":NaN}', b'{"a":"\\ud800"}']
)
def test_what_is_no_object_is_refused_in_a_sentence(site: Site, body: bytes) -> None:
    answer = site.let_in().post("/rater/answer", body)
    assert answer.status_code == 400
    assert answer.json() == {"why": "What is sent needs to be an object in JSON."}


def test_a_person_reads_why_and_what_comes_from_outside_is_text(site: Site) -> None:
    answer = site.browser().get("/rater")
    assert answer.status_code == 401
    assert answer.headers["content-type"].startswith("text/html")
    assert "needs an address that lets this browser in" in answer.text


class Streams:
    """Streams of events of one browser, which begin when a test says so."""

    def __init__(self, tmp_path: Path) -> None:
        self.n_open = 0
        self.site = Site(tmp_path / "study", self.stream)
        self.browser = Site(tmp_path / "study").let_in()
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

        (cookie,) = self.browser.cookies.jar
        headers = {"host": "127.0.0.1:8723", "cookie": f"{cookie.name}={cookie.value}"}
        scope = {
            **{"type": "http", "method": "GET", "path": "/rater/events"},
            **{"query_string": b"", "client": ("10.0.0.7", 1)},
            "headers": [(k.encode(), str(v).encode()) for k, v in headers.items()],
        }
        await self.site.app(scope, asyncio.Event().wait, send)  # type: ignore[arg-type]
        self.ends.append(str(sent[-1]["type"]))


def test_a_browsers_oldest_stream_ends_where_it_opens_too_many(tmp_path: Path) -> None:
    streams = Streams(tmp_path)

    async def run() -> None:
        tasks = [asyncio.create_task(streams.open()) for _ in range(10)]
        await asyncio.sleep(0.05)
        assert streams.n_open == 4
        assert [task.done() for task in tasks] == [True] * 6 + [False] * 4
        streams.site.app.close_streams()
        await asyncio.gather(*tasks)
        assert streams.n_open == 0
        await streams.open()  # none begins any more
        assert set(streams.ends) == {"http.response.body"}

    asyncio.run(run())


def test_without_the_limit_all_streams_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("masrel.lab.serve._middleware._MAX_STREAMS", 1000)

    streams = Streams(tmp_path)

    async def run() -> None:
        tasks = [asyncio.create_task(streams.open()) for _ in range(10)]
        await asyncio.sleep(0.05)
        assert streams.n_open == 10
        streams.site.app.close_streams()
        await asyncio.gather(*tasks)

    asyncio.run(run())
