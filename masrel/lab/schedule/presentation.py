"""The schedule of one rater in one session: what it is, drawing it, checking it."""

from collections import Counter
from dataclasses import dataclass

import masrel
from masrel.errors import ScheduleError
from masrel.lab.protocol import Protocol, presented_hash, protocol_hash
from masrel.lab.schedule._orders import WITH_ROWS, draw_order
from masrel.lab.schedule._secret import StudySecret, check_secret
from masrel.lab.schedule._sites import site_of
from masrel.lab.schedule._stream import Stream

# No letter that reads as a digit (I, O, Q, S, Z), that makes a number of the code
# (E), or that says left or right (L, R).
_CODE_LETTERS = "ABCDFGHJKMNPTUVWXY"


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
    site : str or None
        The rater's site, where sites are strata.
    row : int or None
        Which row of a design the rater has, from 1; None where orders have no rows.
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
    site: str | None = None
    row: int | None = None


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
        Row of a design, from 1; schemes ``williams`` and ``latin-square`` need one,
        the others have none. :func:`masrel.lab.conduct.allot_schedules` allots them.

    Returns
    -------
    Schedule
        Every model as often as the protocol repeats it, in an order of its scheme.

    Raises
    ------
    ScheduleError
        If the session is not the protocol's or does not have the rater, the secret
        has another length, a row is missing or named where there are none, or no order
        keeps the limits of the scheme.

    Notes
    -----
    Order and codes come from two streams for each session and rater alone, so
    adding a rater, a session or a repeat of another study moves nobody else's
    schedule; rows come from streams of the session, and of the site where sites are
    strata. With a secret nobody can tell one stream from the other without it: all
    codes of a study say nothing about its orders.
    """
    if secret is not None:
        check_secret(secret)
    key = None if secret is None else StudySecret.of_study(secret)
    return _draw_with_key(protocol, rater, session, key=key, row=row)


def _draw_with_key(
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    key: StudySecret | None,
    row: int | None,
) -> Schedule:
    """Draw the order and the codes of one rater from the secret of study or site."""
    _require_place(protocol, rater, session)
    site = site_of(protocol, rater)
    secret = None if key is None else key.of(site)
    shown = draw_order(protocol, rater, session, site=site, row=row, secret=secret)
    stream = Stream(protocol.schedule.seed, "codes", session, rater, secret=secret)
    codes = _draw_codes(protocol, len(shown), stream)
    return Schedule(
        study=protocol.study.id,
        rater=rater,
        session=session,
        seed=protocol.schedule.seed,
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
        commitment=None if key is None else key.commitment,
        site=site,
        row=row,
    )


def _draw_codes(protocol: Protocol, n_codes: int, stream: Stream) -> list[str]:
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
        changed since the draw, the site is not that of the rater, a row is missing,
        or the presentations do not have every model as often as the protocol
        repeats it.

    Notes
    -----
    A protocol may still change in its texts, raters, sessions, plan and report;
    :func:`masrel.lab.protocol.presented_hash` has the rest. The stored order is not
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
    if schedule.site != (site := site_of(protocol, schedule.rater)):
        raise ScheduleError(
            f"{where}: needed one drawn for site {site}, got one for {schedule.site}"
        )
    if (schedule.row is None) == (schedule.scheme in WITH_ROWS):
        raise ScheduleError(
            f"{where}: needed {'a' if schedule.row is None else 'no'} row with scheme "
            f"{schedule.scheme}, got {'none' if schedule.row is None else schedule.row}"
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
