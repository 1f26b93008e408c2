"""How far a study is: every session, every rater, and what to do next.

In: a protocol, its schedules and logs. Out: where each session stands, what became of
each rater, and one next step.
"""

from masrel.lab.progress._standing import (
    NextStep,
    RaterProgress,
    SessionProgress,
    next_step,
    rater_progress,
    raters_csv,
    session_progress,
)

__all__ = [
    "NextStep",
    "RaterProgress",
    "SessionProgress",
    "next_step",
    "rater_progress",
    "raters_csv",
    "session_progress",
]
