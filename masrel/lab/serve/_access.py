"""Who is let in: one-time addresses, signed cookies, and whose tablet a tablet is."""

import hmac
import io
import json
import re
import secrets
import sys
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import segno

from masrel._files import write_files
from masrel.errors import MasrelError, ParameterError
from masrel.lab._study_files import MAX_SMALL, parse_json, read_regular, sha256_of
from masrel.lab.protocol import StudyPaths

Role = Literal["rater", "coordinator"]
ROLES: tuple[Role, ...] = ("rater", "coordinator")

LIFE_S = 7 * 86_400
"""Seconds that a cookie lives; each opening of a page restarts them."""

_N_BYTES = 32
_KEY_TEXT = re.compile(r"format: 1\nkey: ([0-9a-f]{64})\n?")
_COOKIE = re.compile(r"([0-9a-f]{32})\.([0-9]{1,12})\.([0-9a-f]{64})")
_MAX_WAITING = 8  # addresses of a role that nobody has opened yet
_MAX_KNOWN = 1024  # cookies, tablets


class AccessError(MasrelError):
    """An address does not let anybody in."""


@dataclass(frozen=True, slots=True)
class Visitor:
    """A browser that was let in."""

    role: Role
    tablet: str


@dataclass(frozen=True, slots=True)
class _Token:
    """What opens a role's page, once."""

    role: Role
    text: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    rater: str | None = None  # whose tablet it will be


class Access:
    """Who is let into the pages of one study.

    Attributes
    ----------
    origin : str
        Where the pages are, as a browser says it: ``http://127.0.0.1:8723``.
    hosts : frozenset of str
        By which names and ports a browser may call the server.
    say : callable
        Says a sentence at the terminal.
    """

    def __init__(
        self,
        study: StudyPaths,
        *,
        origin: str,
        hosts: frozenset[str] = frozenset(),
        say: Callable[[str], None] = print,
        now: Callable[[], float] = time.time,
        ticks: Callable[[], float] = time.monotonic,
    ) -> None:
        self.origin = origin
        self.hosts = hosts | {origin.partition("://")[2]}
        self.say, self._now, self._ticks = say, now, ticks
        self._key = _find_key(study.serve_key_file, study.root)
        self._root = study.root
        self._tablets_file = study.serve_key_file.with_name("tablets")
        # kept, so that a restart gives none to another rater
        self._raters = _read_tablets(self._tablets_file)  # by tablet
        self._tokens: list[_Token] = []
        self._used: deque[_Token] = deque(maxlen=_MAX_WAITING * len(ROLES))
        self._ends: OrderedDict[str, float] = OrderedDict()  # in ticks, by cookie

    @property
    def is_encrypted(self) -> bool:
        """Whether what goes to and fro is encrypted."""
        return self.origin.startswith("https://")

    @property
    def origins(self) -> frozenset[str]:
        """Origins that a page of this server can have."""
        scheme = self.origin.partition("://")[0]
        return frozenset(f"{scheme}://{host}" for host in self.hosts)

    def new_address(self, role: Role, rater: str | None = None) -> str:
        """Return an address that opens a role's page once, the oldest ones lapse."""
        token = _Token(role, rater=rater)
        of_role = [each for each in self._tokens if each.role == role]
        if len(of_role) == _MAX_WAITING:
            self._tokens.remove(of_role[0])
        self._tokens.append(token)
        return f"{self.origin}/{role}?token={token.text}"

    def show_addresses(self) -> None:
        """Print an address for each role, which nobody has opened yet."""
        for role in ROLES:
            address = self.new_address(role)
            self.say(f"{role}: {address}")
            if sys.stdout.isatty():
                self.say(qr_lines(address))
        has_keys = sys.stdin is not None and sys.stdin.isatty()
        enter = "Enter: new ones. " if has_keys else ""
        self.say(f"Each address lets in one browser, once. {enter}Ctrl-C: stop.")

    def let_in(self, role: Role, token: str, client: str) -> Visitor:
        """Return whom an address lets in, which it does once; say so at the terminal.

        Raises
        ------
        AccessError
            If it does not.
        """
        if (known := _same(self._tokens, role, token)) is None:
            new = "press Enter in the terminal of masrel serve for a new one"
            if role == "rater":
                new = "the coordinator's page makes a new one"
            if _same(self._used, role, token) is not None:
                raise AccessError(f"This address was opened before; {new}.")
            raise AccessError(f"This address is no longer valid; {new}.")
        self._tokens.remove(known)
        self._used.append(known)
        visitor = Visitor(role, secrets.token_hex(16))
        if known.rater is not None:
            self.is_of_rater(visitor.tablet, known.rater)
        self.say(f"{role}: a browser at {client} was let in")
        return visitor

    def cookie(self, visitor: Visitor) -> str:
        """Return the header that gives a browser its cookie."""
        issued = int(self._now())
        value = f"{visitor.tablet}.{issued}.{self._signed(visitor, issued)}"
        secure = "; Secure" if self.is_encrypted else ""
        return (
            f"{self.cookie_name(visitor.role)}={value}; Path=/; Max-Age={LIFE_S}; "
            f"HttpOnly; SameSite=Strict{secure}"
        )

    def cookie_name(self, role: Role) -> str:
        """Return the name of a role's cookie: browsers mix those of all ports."""
        prefix = "__Host-" if self.is_encrypted else ""
        return f"{prefix}masrel-{role}-{sha256_of(self._key)[:8]}"

    def visitor(self, role: Role, cookies: Mapping[str, str]) -> Visitor | None:
        """Return who comes with these cookies, or None."""
        parts = _COOKIE.fullmatch(cookies.get(self.cookie_name(role), ""))
        if parts is None:
            return None
        visitor, issued = Visitor(role, parts[1]), int(parts[2])
        if not hmac.compare_digest(parts[3], self._signed(visitor, issued)):
            return None
        return visitor if self._lives(parts[3], issued) else None

    def csrf(self, visitor: Visitor) -> str:
        """Return what a page sends back to show that it is one of ours."""
        return self._mac("csrf", visitor.role, visitor.tablet)

    def is_csrf(self, visitor: Visitor, text: str) -> bool:
        """Return whether a page has sent it back."""
        return hmac.compare_digest(text.encode(), self.csrf(visitor).encode())

    def is_of_rater(self, tablet: str, rater: str) -> bool:
        """Return whether a tablet is this rater's, who gets it if it is nobody's."""
        if tablet not in self._raters:
            self._raters[tablet] = rater
            if len(self._raters) > _MAX_KNOWN:
                del self._raters[next(iter(self._raters))]
            text = json.dumps({"format": 1, "tablets": self._raters}, indent=1)
            files = {self._tablets_file: f"{text}\n"}
            write_files(files, within=self._root)
        return self._raters[tablet] == rater

    def _signed(self, visitor: Visitor, issued: int) -> str:
        return self._mac("cookie", visitor.role, visitor.tablet, issued)

    def _mac(self, *parts: str | int) -> str:
        text = json.dumps(parts, separators=(",", ":"))
        return hmac.digest(self._key, text.encode("ascii"), "sha256").hex()

    def _lives(self, mac: str, issued: int) -> bool:
        # The clock on the wall is looked at once: set forward it logs nobody out.
        if mac not in self._ends:
            age = max(0.0, self._now() - issued)
            if age > LIFE_S:
                return False
            self._ends[mac] = self._ticks() + LIFE_S - age
            if len(self._ends) > _MAX_KNOWN:
                self._ends.popitem(last=False)
        self._ends.move_to_end(mac)
        return self._ticks() < self._ends[mac]


def _same(
    tokens: "list[_Token] | deque[_Token]", role: Role, text: str
) -> "_Token | None":
    # All are compared, each in constant time: how long it takes says nothing.
    same = [
        token
        for token in tokens
        if hmac.compare_digest(token.text.encode(), text.encode())
    ]
    return same[0] if same and same[0].role == role else None


def _read_tablets(file: Path) -> dict[str, str]:
    """Return whose tablet each one is."""
    if not file.is_file():
        return {}
    try:
        document = parse_json(read_regular(file, most=MAX_SMALL))
        return {str(tablet): str(of) for tablet, of in document["tablets"].items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        raise ParameterError(
            f"{file}: needed JSON with the rater of each tablet, got another text; "
            "without this file no tablet belongs to a rater"
        ) from None


def _find_key(file: Path, root: Path) -> bytes:
    """Return the key that cookies are signed with; draw it if there is none yet."""
    if not file.is_file():
        key = secrets.token_bytes(_N_BYTES)
        text = f"format: 1\nkey: {key.hex()}\n"
        write_files({file: text}, within=root)
        return key
    text = read_regular(file, most=MAX_SMALL).decode("utf-8", errors="replace")
    if match := _KEY_TEXT.fullmatch(text):
        return bytes.fromhex(match[1])
    raise ParameterError(
        f"{file}: needed a line 'format: 1' and a line 'key: ' with {2 * _N_BYTES} "
        "hexadecimal digits, got another text; without this file a new key is drawn"
    )


def qr_lines(address: str) -> str:
    """Return an address as a QR code for a terminal."""
    lines = io.StringIO()
    segno.make(address, error="l", micro=False).terminal(lines, compact=True)
    return lines.getvalue()


def qr_svg(address: str) -> str:
    """Return an address as a QR code for a page: what its `src` is, dark on light."""
    code = segno.make(address, error="l", micro=False)
    return str(code.svg_data_uri(scale=6, border=3, dark="black", light="white"))
