"""Draw a schedule: a pure function of protocol, rater and session."""

import masrel
from masrel.protocol import Protocol, presented_hash, protocol_hash
from masrel.schedule.presentation import Presentation, Schedule, require_place
from masrel.schedule.stream import Stream

__all__ = ["draw_schedule"]

# No letter that reads as a digit (I, O, Q, S, Z), that makes a number of the code
# (E), or that says left or right (L, R).
CODE_LETTERS = "ABCDFGHJKMNPTUVWXY"


def draw_schedule(protocol: Protocol, rater: str, session: str) -> Schedule:
    """Draw the order and the blinded codes of one rater in one session.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol; its seed, models and repeats decide the draw.
    rater, session : str
        Their ids.

    Returns
    -------
    Schedule
        Every model as often as the protocol repeats it, in random order.

    Raises
    ------
    ScheduleError
        If the session is not the protocol's or does not have the rater.

    Notes
    -----
    Order and codes come from two streams of their own per session and rater, so
    adding a rater, a session or a repeat of another study moves nobody else's
    schedule, and a code says nothing about the place or the model it stands for.
    """
    require_place(protocol, rater, session)
    seed, repeats = protocol.schedule.seed, protocol.schedule.repeats
    shown = [
        (model.id, repeat)
        for repeat in range(1, repeats + 1)
        for model in protocol.models
    ]
    Stream(seed, "schedule", session, rater).shuffle(shown)
    codes = _draw_codes(protocol, len(shown), rater, session)
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
    )


def _draw_codes(
    protocol: Protocol, n_codes: int, rater: str, session: str
) -> list[str]:
    # Two digits and a letter, such as 47K: 1800 codes, of which at most 500 are
    # needed and 500 are some model's id, so that the draw always ends.
    taken = {model.id.upper() for model in protocol.models}
    stream = Stream(protocol.schedule.seed, "codes", session, rater)
    codes: list[str] = []
    while len(codes) < n_codes:
        number, letter = divmod(
            stream.below(100 * len(CODE_LETTERS)), len(CODE_LETTERS)
        )
        code = f"{number:02d}{CODE_LETTERS[letter]}"
        if code not in taken:
            taken.add(code)
            codes.append(code)
    return codes
