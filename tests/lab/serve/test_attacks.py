"""Attacks: none works, and each does when the guard against it is taken out."""

import hmac
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from masrel.lab.serve import _access, _middleware
from masrel.lab.serve._access import Visitor
from masrel.lab.serve._middleware import Middleware
from tests.lab.serve.sender import Site

Attack = Callable[[Site], bool]
Removal = Callable[[pytest.MonkeyPatch], None]


@dataclass(frozen=True, slots=True)
class Guard:
    """An attack, which says whether it has worked, and what takes its guard out."""

    attack: Attack
    without: Removal


def passes(name: str, of: object = Middleware) -> Removal:
    """Take out a check that raises."""

    def without(patch: pytest.MonkeyPatch) -> None:
        patch.setattr(of, name, lambda *_: None)

    return without


def value(name: str, to: object, of: object = _middleware) -> Removal:
    """Set a limit or a function."""
    return lambda patch: patch.setattr(of, name, to)


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


def forged_cookie(site: Site) -> bool:
    browser = site.browser()
    value = f"{'0' * 32}.{int(site.now())}.{'0' * 64}"
    browser.cookies.set(site.access.cookie_name("coordinator"), value)
    return browser.get("/coordinator/state").status_code == 200


def raters_cookie_as_the_coordinators(site: Site) -> bool:
    rater, browser = site.let_in("rater"), site.browser()
    (value,) = rater.cookies.values()
    browser.cookies.set(site.access.cookie_name("coordinator"), value)
    return browser.get("/coordinator/state").status_code == 200


def cookie_of_another_study(site: Site) -> bool:
    other = Site(site.study.root.with_name("other"))
    (value,), browser = other.let_in("rater").cookies.values(), site.browser()
    browser.cookies.set(site.access.cookie_name("rater"), value)
    return browser.get("/rater/state").status_code == 200


def stolen_cookie_of_last_month(site: Site) -> bool:
    browser = site.let_in("rater")
    site.now.s += 30 * 86_400
    site.restart()  # a server that has seen it knows how long it lives
    browser.app = site.app
    return browser.get("/rater/state").status_code == 200


def rater_at_the_coordinators_pages(site: Site) -> bool:
    browser = site.let_in("rater")
    paths = ("/coordinator", "/coordinator/state", "/coordinator/events", "/report/x")
    acts = ("start", "unblind", "withdraw", "tablet", "job")
    return 200 in [
        *(browser.get(path).status_code for path in paths),
        *(browser.post(f"/coordinator/{act}").status_code for act in acts),
    ]


def post_without_the_pages_secret(site: Site) -> bool:
    browser = site.let_in("coordinator")
    return browser.post("/coordinator/start", X_Masrel_CSRF="0" * 64).status_code == 200


def secret_of_the_raters_page(site: Site) -> bool:
    rater, browser = site.let_in("rater"), site.let_in("coordinator")
    secret = rater.headers["X-Masrel-CSRF"]
    return browser.post("/coordinator/start", X_Masrel_CSRF=secret).status_code == 200


def post_of_a_page_on_another_port(site: Site) -> bool:
    # The same site for cookies, which are sent, strict or not.
    browser = site.let_in("rater")
    return (
        browser.post("/rater/stop", Origin="http://127.0.0.1:9999").status_code == 200
    )


def read_by_another_port(site: Site) -> bool:
    headers = {"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "no-cors"}
    browser = site.let_in("rater")
    del browser.headers["Origin"]  # as for a script or an image
    return browser.get("/rater/state", **headers).status_code == 200


def foreign_name_of_this_computer(site: Site) -> bool:
    browser = site.let_in("rater")
    del browser.headers["Origin"]
    headers = {"Host": "evil.example:8723"}
    return browser.get("/rater/state", **headers).status_code == 200


def form_of_another_page(site: Site) -> bool:
    # What a form can send without the browser asking first.
    browser = site.let_in("rater")
    return browser.post("/rater/stop", Content_Type="text/plain").status_code == 200


def flood(site: Site) -> bool:
    browser = site.let_in("rater")
    answers = browser.all("GET", ["/rater/state"] * 400, headers={})
    return {answer.status_code for answer in answers} == {200}


def flood_without_a_cookie(site: Site) -> bool:
    browser = site.browser()
    answers = browser.all("GET", ["/static/x"] * 200, headers={})
    return {answer.status_code for answer in answers} == {200}


def many_clients(site: Site) -> bool:
    for i in range(1500):
        site.app._without.allow(f"10.0.{i // 250}.{i % 250}")
    return len(site.app._without._left) > 1024


def huge_body(site: Site) -> bool:
    return (
        site.let_in("rater").post("/rater/answer", {"answer": "x" * 70_000}).status_code
        == 200
    )


def huge_body_of_unknown_length(site: Site) -> bool:
    async def pieces() -> AsyncIterator[bytes]:
        yield b'{"answer": "'
        for _ in range(100):
            yield b"x" * 1000
        yield b'"}'

    browser = site.let_in("rater")
    return browser.post("/rater/answer", pieces()).status_code == 200


def deep_body(site: Site) -> bool:
    deep = b'{"a":' + b"[" * 30_000 + b"]" * 30_000 + b"}"
    try:
        site.let_in("rater").post("/rater/answer", deep)
    except RecursionError:  # the server fails
        return True
    return False


def huge_headers(site: Site) -> bool:
    headers = {f"X_{i}": "x" * 1000 for i in range(20)}
    return site.let_in("rater").get("/rater/state", **headers).status_code == 200


def huge_query(site: Site) -> bool:
    return site.let_in("rater").get("/rater/state?" + "x" * 1000).status_code == 200


def preview_uses_an_address_up(site: Site) -> bool:
    address = site.access.new_address("rater")
    site.browser().get(address, Sec_Purpose="prefetch;prerender")
    site.browser().all("HEAD", [address], headers={})
    return site.browser().get(address).status_code != 200


def no_limit(*_: object) -> bool:
    return True


def twice(patch: pytest.MonkeyPatch) -> None:
    class Kept(list[object]):
        def remove(self, _: object) -> None:
            pass

    begin = _access.Access.__init__

    def init(self: _access.Access, *args: object, **options: object) -> None:
        begin(self, *args, **options)  # type: ignore[arg-type]
        self._tokens = Kept()  # type: ignore[assignment]

    patch.setattr(_access.Access, "__init__", init)


def any_token(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(_access, "_same", lambda tokens, *_: tokens[0] if tokens else None)
    new = _access.Access.let_in

    def let_in(
        self: _access.Access, role: _access.Role, token: str, client: str
    ) -> Visitor:
        if not self._tokens:
            self.new_address(role)
        return new(self, role, token, client)

    patch.setattr(_access.Access, "let_in", let_in)


def any_mac(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(hmac, "compare_digest", lambda *_: True)


def any_role(patch: pytest.MonkeyPatch) -> None:
    visitor = _access.Access.visitor

    def anybody(
        self: _access.Access, role: _access.Role, cookies: dict[str, str]
    ) -> Visitor | None:
        known = [visitor(self, each, cookies) for each in (role, *_access.ROLES)]
        return next((Visitor(role, each.tablet) for each in known if each), None)

    patch.setattr(_access.Access, "visitor", anybody)


def any_sender(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Middleware, "_check_sender", lambda *_: None)


def any_preview(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(_middleware, "_is_preview", lambda _: False)


GUARDS = {
    "one time": Guard(address_opened_twice, twice),
    "role of an address": Guard(address_of_the_other_role, any_token),
    "study of an address": Guard(address_of_another_study, any_token),
    "signature": Guard(forged_cookie, any_mac),
    "role of a cookie": Guard(raters_cookie_as_the_coordinators, any_mac),
    "study of a cookie": Guard(cookie_of_another_study, any_mac),
    "life of a cookie": Guard(
        stolen_cookie_of_last_month, value("LIFE_S", 10**9, _access)
    ),
    "roles": Guard(rater_at_the_coordinators_pages, any_role),
    "CSRF": Guard(post_without_the_pages_secret, passes("_check_page")),
    "CSRF of a role": Guard(secret_of_the_raters_page, passes("_check_page")),
    "Origin": Guard(post_of_a_page_on_another_port, any_sender),
    "Sec-Fetch-Site": Guard(read_by_another_port, any_sender),
    "Host": Guard(foreign_name_of_this_computer, any_sender),
    "JSON alone": Guard(form_of_another_page, passes("_check_page")),
    "rate": Guard(flood, value("allow", no_limit, _middleware._Budgets)),
    "rate of strangers": Guard(
        flood_without_a_cookie, value("allow", no_limit, _middleware._Budgets)
    ),
    "number of clients": Guard(many_clients, value("_MAX_CLIENTS", 10**6)),
    "size of a body": Guard(huge_body, value("_MAX_BODY", 10**9)),
    "size of pieces": Guard(huge_body_of_unknown_length, value("_MAX_BODY", 10**9)),
    "depth of a body": Guard(deep_body, value("parse_json", json.loads)),
    "size of headers": Guard(huge_headers, value("_MAX_HEADERS", 10**9)),
    "size of a query": Guard(huge_query, value("_MAX_QUERY", 10**9)),
    "previews": Guard(preview_uses_an_address_up, any_preview),
}


@pytest.mark.parametrize("name", GUARDS)
def test_no_attack_works(tmp_path: Path, name: str) -> None:
    assert not GUARDS[name].attack(Site(tmp_path / "study"))


@pytest.mark.parametrize("name", GUARDS)
def test_each_works_without_its_guard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    GUARDS[name].without(monkeypatch)
    assert GUARDS[name].attack(Site(tmp_path / "study"))
