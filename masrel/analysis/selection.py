"""What a line of the plan means, and whether the data hold and fit it."""

from masrel.errors import RatingsError
from masrel.protocol import EstimatePlan, Protocol
from masrel.ratings import Ratings

__all__ = ["absence", "check_known", "rated_models"]


def rated_models(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> tuple[str, ...]:
    """Return the models a line asks for that have a rating in each of its sessions."""
    table = ratings.table
    given = table[table["grade"].notna()]
    rated = [
        set(given.loc[given["session"] == session, "model"])
        for session in line.sessions
    ]
    common = set.intersection(*rated)
    return tuple(model for model in _planned(line, protocol) if model in common)


def absence(line: EstimatePlan, protocol: Protocol, ratings: Ratings) -> str | None:
    """Say why a line of the plan cannot be estimated from these data."""
    present = set(ratings.table["session"])
    lost = [session for session in line.sessions if session not in present]
    if lost:
        return f"there are no ratings of session {' or '.join(lost)}"
    planned = _planned(line, protocol)
    if not planned:
        return f"the study has no {line.models} models"
    rated = set(rated_models(line, protocol, ratings))
    sessions = " and ".join(line.sessions)
    # A role without any rating was not part of these data: an estimate over the
    # rest would carry the name of more than it holds.
    for role in ("standard", "dummy"):
        of_role = [m.id for m in protocol.models if m.role == role and m.id in planned]
        if of_role and not rated.intersection(of_role):
            return f"no {role} model has ratings in session {sessions}"
    return None


def check_known(protocol: Protocol, ratings: Ratings) -> None:
    """Refuse ratings of sessions, raters or models the protocol does not have."""
    known = {
        "session": [session.id for session in protocol.sessions],
        "rater": [rater.id for rater in protocol.raters],
        "model": [model.id for model in protocol.models],
    }
    where = "the ratings" if ratings.source_path is None else str(ratings.source_path)
    problems = []
    for column, ids in known.items():
        strange = dict.fromkeys(x for x in ratings.table[column] if x not in ids)
        problems += [
            f"{where}: column {column!r}: needed one of the protocol's, "
            f"{', '.join(ids)}, got {got!r}"
            for got in strange
        ]
    if problems:
        raise RatingsError("\n".join(problems))


def _planned(line: EstimatePlan, protocol: Protocol) -> tuple[str, ...]:
    return tuple(
        model.id for model in protocol.models if line.models in ("all", model.role)
    )
