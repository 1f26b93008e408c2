"""How a study stands, for the coordinator's page: by its logs, no model named."""

import dataclasses
from typing import Any

from masrel.errors import MasrelError
from masrel.lab._once import read_once
from masrel.lab.conduct import read_conduct
from masrel.lab.progress import next_step, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.run._settings import torque_problems

_N_EVENTS = 100
_DEVICE = (
    "backend",
    "rate_hz",
    "torque_limit_nm",
    "torque_rate_limit_nm_s",
    "speed_limit_deg_s",
    "lowest_angle_deg",
    "highest_angle_deg",
    "missed_ticks_limit",
    "watchdog_ms",
)


@read_once()
def overview(study: StudyPaths) -> dict[str, Any]:
    """Return sessions, raters, what happened beside them, and the device."""
    protocol = read_protocol(study.protocol)
    sessions = session_progress(study, protocol)
    raters: list[dict[str, Any]] = []
    events: list[dict[str, Any]] = []
    problem, step = None, None
    try:
        progress = rater_progress(study, protocol, sessions)
        raters = [{"rater": each.rater, "status": each.status} for each in progress]
        step = dataclasses.asdict(next_step(study, sessions, progress))
        events = [
            {"event": event.kind, "time_utc": event.time_utc, **event.fields}
            for event in read_conduct(study)[-_N_EVENTS:]
        ]
    except MasrelError as error:  # hides no session
        problem = str(error)
    return {
        "study": protocol.study.id,
        "title": protocol.study.title,
        "sessions": [dataclasses.asdict(session) for session in sessions],
        "raters": raters,
        "events": events,
        "problem": problem,
        "next": step,
        "grades": list(protocol.scale.grades),
        "questions": _questions(protocol),
        "device": {name: getattr(protocol.device, name) for name in _DEVICE},
        "n_torque_problems": len(tuple(torque_problems(protocol))),
        "has_report": (study.root / "report" / "report.html").is_file(),
    }


def _questions(protocol: Protocol) -> list[str]:
    return [
        f"{questionnaire.id}.{question.id}"
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    ]
