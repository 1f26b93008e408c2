"""The rules that tie the analysis plan to the rest of a protocol."""

from collections.abc import Iterator
from typing import Any

from masrel.protocol.wording import got, with_id

__all__ = ["plan_rules"]

Values = dict[str, Any]

SESSIONS_NEEDED = {"inter-rater": 1, "test-retest": 2}


def plan_rules(values: Values) -> Iterator[str]:
    """Check each line of the analysis plan against sessions, raters and models."""
    plan = (values.get("analysis") or {}).get("estimates") or []
    for index, line in enumerate(plan):
        if line is not None:
            for problem in _line(line, values):
                yield f"analysis.estimates[{index}].{problem}{with_id(line)}"


def _line(line: Values, values: Values) -> Iterator[str]:
    yield from _models(line, values)
    kind, named = line.get("kind"), line.get("sessions")
    if kind is None or named is None or None in named:
        return
    count = SESSIONS_NEEDED[kind]
    if len(named) not in SESSIONS_NEEDED.values():
        return  # no line has so many, and the key itself has been refused
    if len(named) != count:
        words = "exactly one session" if count == 1 else "exactly two sessions"
        yield f"sessions: needed {words} for {got(kind)}, got {len(named)}"
    elif len(set(named)) != len(named):
        yield f"sessions: needed two different sessions, got {got(named[0])} twice"
    yield from _raters(kind, named, values)


def _raters(kind: str, named: list[str], values: Values) -> Iterator[str]:
    sessions = values.get("sessions") or []
    if not sessions or any(s is None or "id" not in s for s in sessions):
        return  # nothing can be said to be unknown
    raters = {session["id"]: session.get("raters") for session in sessions}
    for place, name in enumerate(named):
        if name not in raters:
            known = ", ".join(raters)
            yield (
                f"sessions[{place}]: needed a session of [[sessions]] ({known}), "
                f"got {got(name)}"
            )
    groups = [set(raters.get(name) or ()) for name in named]
    present = {rater.get("id") for rater in values.get("raters") or [] if rater}
    if not all(group and group <= present for group in groups):
        return  # something else is wrong with a session; who meets whom is open
    if kind == "inter-rater" and len(groups) == 1 and len(groups[0]) < 2:
        yield "sessions: needed a session of at least two raters, got one of 1"
    if kind == "test-retest" and len(groups) == 2 and not groups[0] & groups[1]:
        yield "sessions: needed two sessions that share a rater, got none in both"


def _models(line: Values, values: Values) -> Iterator[str]:
    models = values.get("models") or []
    if not models or any(m is None or "role" not in m for m in models):
        return
    asked = line.get("models")
    if asked in ("standard", "dummy") and asked not in {m["role"] for m in models}:
        yield f"models: needed a role that some model has, got {got(asked)}"
