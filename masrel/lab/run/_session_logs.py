"""Session logs read, verified and replayed."""

from pathlib import Path

from masrel.lab._event_log import Event, read_log
from masrel.lab._once import once
from masrel.lab.run._state import SessionState, replay


@once
def read_session(log: Path) -> tuple[tuple[Event, ...], SessionState]:
    """Return the events of a session's log, and where the session stands."""
    events = read_log(log)
    return events, replay(log, events)
