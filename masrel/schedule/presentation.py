"""The schedule of one rater in one session: what it is, drawing it, checking it."""

import hashlib
import hmac
import json
from collections import Counter
from collections.abc import MutableSequence
from dataclasses import dataclass
from typing import TypeVar

from numpy.random import PCG64

import masrel
from masrel.errors import ScheduleError
from masrel.protocol import Protocol, presented_hash, protocol_hash
from masrel.schedule._secret import check_secret, commitment_of

# No letter that reads as a digit (I, O, Q, S, Z), that makes a number of the code
# (E), or that says left or right (L, R).
_CODE_LETTERS = "ABCDFGHJKMNPTUVWXY"

_T = TypeVar("_T")

_N_WORDS = 2**64


@dataclass(frozen=True, slots=True, kw_only=True)
class Presentation:
    """One model put to one rater once.

    Attributes
    ----------
    position : int
        Place in the session, from 1.
    code : str
        Blinded name, all that the rater sees; unique in the session.
    model : str
        Id of the haptic model.
    repeat : int
        Which of the model's presentations in the session, from 1.
    """

    position: int
    code: str
    model: str
    repeat: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """What one rater meets in one session, in order, and where it comes from.

    Attributes
    ----------
    study, rater, session : str
        Their ids.
    seed : int
        The protocol's seed at drawing.
    scheme : str
        The protocol's scheme at drawing.
    protocol_sha256 : str
        Hash of the whole protocol at drawing.
    presented_sha256 : str
        Hash of what decides what a rater meets; when it differs from the
        protocol's, the schedule is stale.
    masrel_version : str
        Version that drew it.
    presentations : tuple of Presentation
        In order of presentation.
    commitment : str or None
        Hash of the secret that decided order and codes: when the secret is published,
        it shows that no other was used. None when the seed alone decided.
    """

    study: str
    rater: str
    session: str
    seed: int
    scheme: str
    protocol_sha256: str
    presented_sha256: str
    masrel_version: str
    presentations: tuple[Presentation, ...]
    commitment: str | None = None


def draw_schedule(
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    secret: bytes | None = None,
    row: int | None = None,
) -> Schedule:
    """Draw the order and the blinded codes of one rater in one session.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol; its seed, models and repeats decide the draw.
    rater, session : str
        Their ids.
    secret : bytes, optional
        16 random bytes that decide the draw together with the seed. Without them the
        seed alone does, and who knows it knows every order.
    row : int, optional
        Row of a design whose orders have rows; ``random-order`` has none.

    Returns
    -------
    Schedule
        Every model as often as the protocol repeats it, in random order.

    Raises
    ------
    ScheduleError
        If the session is not the protocol's or does not have the rater, the secret
        has another length, or the scheme has no rows and one is named.

    Notes
    -----
    Order and codes come from two streams for each session and rater alone, so
    adding a rater, a session or a repeat of another study moves nobody else's
    schedule. With a secret nobody can tell one stream from the other without it: all
    codes of a study say nothing about its orders.
    """
    _require_place(protocol, rater, session)
    if secret is not None:
        check_secret(secret)
    if row is not None:
        raise ScheduleError(
            f"row: needed none, scheme {protocol.schedule.scheme} has no rows, "
            f"got {row}"
        )
    seed, repeats = protocol.schedule.seed, protocol.schedule.repeats
    shown = [
        (model.id, repeat)
        for repeat in range(1, repeats + 1)
        for model in protocol.models
    ]
    _Stream(seed, "schedule", session, rater, secret=secret).shuffle(shown)
    stream = _Stream(seed, "codes", session, rater, secret=secret)
    codes = _draw_codes(protocol, len(shown), stream)
    return Schedule(
        study=protocol.study.id,
        rater=rater,
        session=session,
        seed=seed,
        scheme=protocol.schedule.scheme,
        protocol_sha256=protocol_hash(protocol),
        presented_sha256=presented_hash(protocol),
        masrel_version=masrel.__version__,
        presentations=tuple(
            Presentation(position=place, code=code, model=model, repeat=repeat)
            for place, (code, (model, repeat)) in enumerate(
                zip(codes, shown, strict=True), start=1
            )
        ),
        commitment=None if secret is None else commitment_of(secret),
    )


def _draw_codes(protocol: Protocol, n_codes: int, stream: "_Stream") -> list[str]:
    # Two digits and a letter, such as 47K: 1800 codes, of which at most 500 are
    # needed and 500 are some model's id, so that the draw always ends.
    taken = {model.id.upper() for model in protocol.models}
    codes: list[str] = []
    while len(codes) < n_codes:
        number, letter = divmod(
            stream.below(100 * len(_CODE_LETTERS)), len(_CODE_LETTERS)
        )
        code = f"{number:02d}{_CODE_LETTERS[letter]}"
        if code not in taken:
            taken.add(code)
            codes.append(code)
    return codes


def check_schedule(schedule: Schedule, protocol: Protocol) -> None:
    """Refuse a schedule that was not drawn from what the protocol presents now.

    Parameters
    ----------
    schedule : Schedule
        A schedule.
    protocol : Protocol
        The study's protocol.

    Raises
    ------
    ScheduleError
        If study, rater or session are not the protocol's, what is presented has
        changed since the draw, or the rows do not hold every model as often as the
        protocol repeats it.

    Notes
    -----
    A protocol may still change in its texts, raters, sessions, plan and report;
    :func:`masrel.protocol.presented_hash` has the rest. The stored order is not
    drawn again for comparison: the file is the schedule, the seed its provenance.
    """
    where = f"schedule of rater {schedule.rater} in session {schedule.session}"
    if schedule.study != protocol.study.id:
        raise ScheduleError(
            f"{where}: needed study {protocol.study.id}, got {schedule.study}"
        )
    _require_place(protocol, schedule.rater, schedule.session)
    if schedule.presented_sha256 != presented_hash(protocol):
        raise ScheduleError(
            f"{where}: needed one drawn from the protocol as it is, got one from "
            "before a change in what it presents; masrel check names the keys"
        )
    expected = Counter(
        (model.id, repeat)
        for model in protocol.models
        for repeat in range(1, protocol.schedule.repeats + 1)
    )
    scheduled = Counter((shown.model, shown.repeat) for shown in schedule.presentations)
    if expected != scheduled:
        # Names of models would tell the rater at the console which ones are missing.
        raise ScheduleError(
            f"{where}: needed every model of the protocol once per repeat, got rows "
            f"with {(expected - scheduled).total()} of these missing and "
            f"{(scheduled - expected).total()} others"
        )


def _require_place(protocol: Protocol, rater: str, session: str) -> None:
    """Refuse a rater and session the protocol does not bring together."""
    raters = {each.id: each.raters for each in protocol.sessions}
    if session not in raters:
        raise ScheduleError(
            f"session: needed one of {', '.join(raters)}, got {session!r}"
        )
    if rater not in raters[session]:
        raise ScheduleError(
            f"rater: needed one of {', '.join(raters[session])} for session "
            f"{session}, got {rater!r}"
        )


class _Stream:
    """Random words for one purpose, whatever else is drawn from the same seed."""

    # NumPy keeps the raw words of a bit generator the same for ever, but not what its
    # Generator methods make of them: words are taken raw, and numbers made here.
    #
    # The SHA-256 of the JSON array ``["masrel", seed, *purpose]`` (UTF-8, no spaces,
    # non-ASCII escaped) is the whole state of the generator: its first 16 bytes, big
    # endian, are PCG64's state, the other 16 its increment, made odd. With a secret it
    # is the HMAC-SHA256 of that array, whose key is the secret: who has the words of
    # some streams learns neither the secret nor any other stream.

    def __init__(self, seed: int, *purpose: str, secret: bytes | None = None) -> None:
        name = json.dumps(["masrel", seed, *purpose], separators=(",", ":")).encode()
        if secret is None:
            digest = hashlib.sha256(name).digest()
        else:
            digest = hmac.digest(secret, name, "sha256")
        self._generator = PCG64(0)
        self._generator.state = {
            "bit_generator": "PCG64",
            "state": {
                "state": int.from_bytes(digest[:16], "big"),
                "inc": int.from_bytes(digest[16:], "big") | 1,
            },
            "has_uint32": 0,
            "uinteger": 0,
        }

    def word(self) -> int:
        """Return the next word, uniform on 0 to 2**64 - 1."""
        return int(self._generator.random_raw())

    def below(self, limit: int) -> int:
        """Return a number uniform on 0 to `limit` - 1; `limit` from 1 to 2**64."""
        # Words at and above the last multiple of `limit` are rejected, so that every
        # number has exactly the same chance.
        usable = _N_WORDS - _N_WORDS % limit
        while (word := self.word()) >= usable:
            pass
        return word % limit

    def shuffle(self, items: MutableSequence[_T]) -> None:
        """Put `items` into a random order in place, each order equally likely."""
        # Fisher and Yates, from the last place down: place i takes the item of a place
        # drawn from 0 to i.
        for i in range(len(items) - 1, 0, -1):
            j = self.below(i + 1)
            items[i], items[j] = items[j], items[i]
