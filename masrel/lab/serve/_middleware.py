"""HTTP middleware: senders, roles, limits of requests, and headers of every answer."""

import functools
import json
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import Path

import anyio
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request, cookie_parser
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from masrel.lab._study_files import parse_json
from masrel.lab.serve._access import ROLES, Access, AccessError, Role, Visitor
from masrel.pages._sections import template_environment

_TEMPLATES = Path(__file__).with_name("templates")
_MAX_BODY = 65_536
_MAX_HEADERS = 16_384
_MAX_PATH = 512
_MAX_QUERY = 512
_MAX_STREAMS = 4  # of one browser; its oldest ends where it opens one more
_TO_END_S = 1.0  # for the last bytes of such a stream

# Requests at once, and then per second: of a browser with a cookie, and of a computer
# for those without
_WITH_COOKIE, _WITHOUT = (120, 30.0), (60, 10.0)
_MAX_CLIENTS = 1024

_PAGES = ("/rater", "/coordinator")
_STOPS = ("/rater/stop", "/coordinator/stop")

_POLICY = (
    "default-src 'none'; {0}; connect-src 'self'; img-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_OF_PAGES = _POLICY.format("script-src 'self'; style-src 'self'")
_OF_REPORT = _POLICY.format("style-src 'self' 'unsafe-inline'")
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), usb=()",
}


class Middleware:
    """Lets through what its sender may ask, and answers the rest in one sentence.

    A page is given ``role``, ``tablet`` and ``csrf`` of who asks in the state of its
    request, and in ``fields`` the object that was sent.
    """

    def __init__(
        self,
        app: ASGIApp,
        access: Access,
        *,
        ticks: Callable[[], float] = time.monotonic,
    ) -> None:
        self._app, self._access = app, access
        self._with_cookie = _Budgets(*_WITH_COOKIE, ticks)
        self._without = _Budgets(*_WITHOUT, ticks)
        self._streams = _Streams()

    def close_streams(self) -> None:
        """End every stream of events, and let no new one begin."""
        self._streams.close()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            return
        policy = _OF_REPORT if scope["path"].startswith("/report/") else _OF_PAGES
        send = _with_headers(send, {**_HEADERS, "Content-Security-Policy": policy})
        try:
            visitor = self._visitor(scope)
            if scope["method"] == "POST":
                scope["state"]["fields"] = await _sent_fields(Request(scope, receive))
        except HTTPException as refused:
            answer = _refusal(scope, refused.status_code, refused.detail)
            await answer(scope, receive, send)
            return
        if _opens(scope):
            await self._open(scope, visitor)(scope, receive, send)
        elif visitor is not None and scope["path"].endswith("/events"):
            await self._streams.run(visitor.tablet, self._app, scope, receive, send)
        else:
            if visitor is not None and scope["path"] in _PAGES:
                send = _with_headers(send, {"Set-Cookie": self._access.cookie(visitor)})
            await self._app(scope, receive, send)

    def _visitor(self, scope: Scope) -> Visitor | None:
        """Return who asks; None for what anybody may ask."""
        headers = Headers(scope=scope)
        _check_sizes(scope)
        self._check_sender(scope, headers)
        cookies = cookie_parser(headers.get("cookie", ""))
        visitors = {each: self._access.visitor(each, cookies) for each in ROLES}
        others = [each for each in visitors.values() if each is not None]
        role = _role(scope["path"])
        visitor = visitors[role] if role else None
        self._check_budget(scope, visitor or next(iter(others), None))
        if role is None or (visitor is None and _opens(scope)):
            if scope["method"] == "POST":
                raise HTTPException(405, "Nothing can be sent to this address.")
            return None
        if visitor is None and others:
            raise HTTPException(403, f"This is only for the {role}.")
        if visitor is None:
            raise HTTPException(
                401,
                "This page needs an address that lets this browser in, as masrel serve "
                "prints it and the coordinator's page makes it.",
            )
        csrf = self._access.csrf(visitor)
        if scope["method"] == "POST":
            self._check_page(headers, visitor)
        state = {"role": role, "tablet": visitor.tablet, "csrf": csrf}
        scope["state"] = {**scope.get("state", {}), **state}
        return visitor

    def _check_sender(self, scope: Scope, headers: Headers) -> None:
        """Refuse what a page of somebody else makes a browser send."""
        if scope["method"] not in ("GET", "HEAD", "POST"):
            raise HTTPException(405, "This address accepts only GET and POST.")
        if headers.get("host", "").lower() not in self._access.hosts:
            # a foreign name that its owner has made to mean this computer
            where = self._access.origin
            raise HTTPException(421, f"These pages are at {where} and nowhere else.")
        origin, site = headers.get("origin"), headers.get("sec-fetch-site")
        if origin is None and scope["method"] == "POST":
            raise HTTPException(403, "The request needs the header Origin.")
        is_link = headers.get("sec-fetch-mode") == "navigate"
        if (origin is not None and origin not in self._access.origins) or (
            site in ("cross-site", "same-site")
            and not (is_link and scope["method"] == "GET")
        ):
            raise HTTPException(403, "This was sent by a page of another site.")

    def _check_budget(self, scope: Scope, visitor: Visitor | None) -> None:
        """Refuse more requests than a person makes; an emergency stop never is."""
        if visitor is not None:
            if scope["path"] in _STOPS or self._with_cookie.allow(visitor.tablet):
                return
        elif self._without.allow(_client(scope)):
            return
        raise HTTPException(429, "Too many requests; wait a second.")

    def _check_page(self, headers: Headers, visitor: Visitor) -> None:
        """Refuse what was not sent by a page that this server has made."""
        if not self._access.is_csrf(visitor, headers.get("x-masrel-csrf", "")):
            raise HTTPException(403, "The request needs the header X-Masrel-CSRF.")
        if headers.get("content-type", "").partition(";")[0] != "application/json":
            raise HTTPException(415, "The request must be application/json.")

    def _open(self, scope: Scope, visitor: Visitor | None) -> Response:
        """Let a browser in by its one-time address."""
        role = _role(scope["path"])
        if role is None or _is_preview(scope):
            return _refusal(scope, 503, "This address is opened by a person.")
        try:
            new = self._access.let_in(role, _token(scope), _client(scope))
        except AccessError as error:
            if visitor is None:
                return _refusal(scope, 401, str(error))
            new = visitor  # the same address again, by the browser that it let in
        # A page that goes on by itself: a redirection of a link from elsewhere would
        # be without the cookie, which is strict, and this takes the token from the
        # history.
        headers = {"Set-Cookie": self._access.cookie(new)}
        return HTMLResponse(page("opened.html", role=role), headers=headers)


def _role(path: str) -> Role | None:
    """Return who may ask for a path; None for anybody."""
    first = path.split("/")[1] if path.startswith("/") else ""
    if first == "rater":
        return "rater"
    return "coordinator" if first in ("coordinator", "report") else None


def _client(scope: Scope) -> str:
    """Return the address of the computer that asks."""
    return str((scope.get("client") or ("?",))[0])


def _token(scope: Scope) -> str:
    name, _, text = scope["query_string"].decode("latin-1").partition("=")
    return text if name == "token" else ""


def _opens(scope: Scope) -> bool:
    """Return whether a request opens a page by a one-time address."""
    is_page = scope["method"] == "GET" and scope["path"] in _PAGES
    return is_page and _token(scope) != ""


def _is_preview(scope: Scope) -> bool:
    """Return whether a browser only guesses what will be opened."""
    return "sec-purpose" in Headers(scope=scope)


def _check_sizes(scope: Scope) -> None:
    if not scope["path"].isprintable():  # no file has such a name
        raise HTTPException(404, "There is no such page.")
    if len(scope["path"]) > _MAX_PATH or len(scope["query_string"]) > _MAX_QUERY:
        raise HTTPException(414, "This address is too long.")
    if sum(len(name) + len(value) for name, value in scope["headers"]) > _MAX_HEADERS:
        raise HTTPException(431, "The headers of this request are too long.")


async def _sent_fields(request: Request) -> dict[str, object]:
    """Return the object in JSON that was sent, which has a limit."""
    long = HTTPException(413, f"The request may have at most {_MAX_BODY} bytes.")
    length = request.headers.get("content-length", "0")
    if not length.isdecimal() or len(length) > 9 or int(length) > _MAX_BODY:
        raise long
    body = b""
    try:
        async for piece in request.stream():
            body += piece
            if len(body) > _MAX_BODY:
                raise long
        document = parse_json(body)
        # neither NaN nor half a letter, which no answer and no log can hold
        json.dumps(document, allow_nan=False, ensure_ascii=False).encode()
    except ClientDisconnect:
        why = "The connection ended before its request."
        raise HTTPException(400, why) from None
    except ValueError:
        document = None
    if not isinstance(document, dict):
        raise HTTPException(400, "The request must be a JSON object.")
    return document


def _refusal(scope: Scope, status: int, why: str) -> Response:
    """Return why a request is refused, as a page where a person would see it."""
    headers = {"Retry-After": "1"} if status == 429 else {}
    if scope["path"] in ("/", *_PAGES) or scope["path"].startswith("/report/"):
        return HTMLResponse(page("refused.html", why=why), status, headers)
    return JSONResponse({"why": why}, status, headers)


def page(name: str, **context: object) -> str:
    """Return a page as HTML, with everything escaped that comes from a study."""
    return _environment(_TEMPLATES).get_template(name).render(**context)


_environment = functools.cache(template_environment)


def _with_headers(send: Send, headers: Mapping[str, str]) -> Send:
    """Return what sends an answer with more headers."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(headers)
        await send(message)

    return sent


class _Budgets:
    """How many requests each client may still make."""

    def __init__(self, burst: int, per_s: float, ticks: Callable[[], float]) -> None:
        self._burst, self._per_s, self._ticks = burst, per_s, ticks
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def allow(self, client: str) -> bool:
        """Take one request from a client's budget; say whether there was one."""
        now = self._ticks()
        left, since = self._left.pop(client, (float(self._burst), now))
        left = min(float(self._burst), left + (now - since) * self._per_s)
        self._left[client] = (left - 1 if left >= 1 else left), now
        if len(self._left) > _MAX_CLIENTS:
            self._left.popitem(last=False)
        return left >= 1


class _Streams:
    """The streams of events that are open, of each browser a few."""

    def __init__(self) -> None:
        self._open: dict[str, list[anyio.CancelScope]] = {}
        self._is_closed = False

    def close(self) -> None:
        """End them all."""
        self._is_closed = True
        for stream in [each for streams in self._open.values() for each in streams]:
            stream.cancel()

    async def run(
        self, tablet: str, app: ASGIApp, scope: Scope, receive: Receive, send: Send
    ) -> None:
        """Send a stream until it ends, its browser goes or opens too many others."""
        if self._is_closed:
            await _refusal(scope, 503, "The server is stopping.")(scope, receive, send)
            return
        streams = self._open.setdefault(tablet, [])
        if len(streams) >= _MAX_STREAMS:
            streams.pop(0).cancel()
        stream = anyio.CancelScope()
        streams.append(stream)
        try:
            with stream:
                await app(scope, receive, send)
        finally:
            if stream in streams:
                streams.remove(stream)
            if not streams and self._open.get(tablet) is streams:
                del self._open[tablet]
        if stream.cancelled_caught:
            with anyio.move_on_after(_TO_END_S):  # who does not read is cut off
                await send({"type": "http.response.body", "body": b""})
