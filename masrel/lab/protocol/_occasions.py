"""Occasions: what a session has beside its presentations, and how sessions follow."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from msgspec import Meta

from masrel._input import listed
from masrel.lab.protocol._decode import got, with_id
from masrel.lab.protocol._keys import _Table


class Occasions(_Table, frozen=True, kw_only=True):
    """``[occasions]``: practice, instructions, breaks, and coming back to a session."""

    instructions: Annotated[str, Meta(max_length=10_000)] = ""
    practice: Annotated[tuple[str, ...], Meta(max_length=100)] = ()
    break_after: Annotated[int, Meta(ge=1)] | None = None
    break_minutes: Annotated[float, Meta(gt=0, le=1440)] = 5.0
    resume: Literal["always", "same-day", "restart", "ask"] = "always"


def occasion_rules(values: dict[str, Any]) -> Iterator[str]:
    """Check models of practice, places of breaks, and the order of sessions."""
    occasions = values.get("occasions") or {}
    models = [m.get("id") for m in values.get("models") or [] if m is not None]
    for place, model in enumerate(occasions.get("practice") or []):
        if models and None not in models and model not in (None, *models):
            yield (
                f"occasions.practice[{place}]: needed a model of [[models]] "
                f"({listed(models)}), got {got(model)}"
            )
    after, minutes = occasions.get("break_after"), occasions.get("break_minutes")
    repeats = (values.get("schedule") or {}).get("repeats")
    n_presentations = len(values.get("models") or []) * (repeats or 0)
    if after is not None and 0 < n_presentations <= after:
        yield (
            f"occasions.break_after: needed fewer than the {n_presentations} "
            f"presentations of a session, as no break comes after the last, got {after}"
        )
    default = Occasions().break_minutes
    if "break_after" in occasions and after is None and minutes not in (None, default):
        yield (
            f"occasions.break_minutes: needed with occasions.break_after only, got "
            f"{minutes:g}"
        )
    yield from _order_rules(values)


def _order_rules(values: dict[str, Any]) -> Iterator[str]:
    sessions = [s or {} for s in values.get("sessions") or []]
    earlier = {s["id"]: s.get("after") for s in sessions if s.get("id")}
    for index, session in enumerate(sessions):
        name, after = session.get("id"), session.get("after")
        where, at_end = f"sessions[{index}]", with_id(session)
        low, high = session.get("at_least_days"), session.get("at_most_days")
        if after is not None and len(earlier) == len(sessions):
            if after not in earlier:
                yield (
                    f"{where}.after: needed another session of [[sessions]] "
                    f"({listed(earlier)}), got {got(after)}{at_end}"
                )
            elif name is not None and _comes_back(name, earlier):
                yield (
                    f"{where}.after: needed a session that does not come after this "
                    f"one, got {got(after)}{at_end}"
                )
        if low is not None and high is not None and low > high:
            yield (
                f"{where}.at_least_days: needed at most at_most_days ({high}), "
                f"got {low}{at_end}"
            )
        if after is None and "after" in session:
            for key, default in _NEEDING_AFTER.items():
                if session.get(key, default) != default:
                    yield f"{where}.{key}: needed with after only, got it alone{at_end}"


_NEEDING_AFTER = {"at_least_days": None, "at_most_days": None, "order_policy": "refuse"}
"""Keys of a session that say nothing without ``after``, with their defaults."""


def _comes_back(name: str, earlier: dict[str, str | None]) -> bool:
    # whether the sessions before a session lead back to it
    before, n_steps = earlier.get(name), 0
    while before is not None and before != name and n_steps < len(earlier):
        before, n_steps = earlier.get(before), n_steps + 1
    return before == name
