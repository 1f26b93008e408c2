"""The process of one session: ``python -m masrel.lab.serve._session_process``.

It is started with the number of a connected socket and what to run, as JSON.
"""

import json
import socket
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from masrel.errors import MasrelError, SessionLogInUseError, SessionStoppedError
from masrel.lab.hess._clock import may_use
from masrel.lab.protocol import StudyPaths, read_protocol, scale_of
from masrel.lab.run import SessionSummary, run_session
from masrel.lab.serve._channel import Channel, Message
from masrel.lab.serve._page_grades import PageGrades

_OTHER_ENDS_S = 10.0  # within this a process ends whose server is gone


def main(arguments: list[str]) -> None:
    """Run a session, and say how it ended."""
    order = json.loads(arguments[0])
    may_use(order["processors"])
    channel = Channel(socket.socket(fileno=order["socket"]))

    def note(message: Warning | str, *_: object) -> None:
        channel.send({"kind": "note", "text": f"{message}"})

    warnings.showwarning = note  # type: ignore[assignment]
    channel.send(_outcome(channel, order))


def _outcome(channel: Channel, order: dict[str, Any]) -> Message:
    try:
        summary = _session(channel, order)
    except SessionStoppedError as error:
        return {"kind": "over", "how": "stopped", "text": f"{error}"}
    except (MasrelError, OSError) as error:
        return {"kind": "over", "how": "failed", "text": f"{error}"}
    text = f"session {summary.session} of {summary.rater} is complete"
    return {"kind": "over", "how": "complete", "text": text}


def _session(channel: Channel, order: dict[str, Any]) -> SessionSummary:
    study = StudyPaths(Path(order["study"]))
    protocol = read_protocol(study.protocol)
    grades = PageGrades(channel, scale_of(protocol))
    until = time.monotonic() + _OTHER_ENDS_S
    while True:
        try:
            return run_session(
                study,
                protocol,
                order["rater"],
                order["session"],
                grades=grades,
                clock=order["clock"],
                rehearsal=order["rehearsal"],
            )
        except SessionLogInUseError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


if __name__ == "__main__":
    main(sys.argv[1:])
