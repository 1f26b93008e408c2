"""What a coordinator does next: one command."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.progress._raters import RaterProgress
from masrel.progress._session_stages import SessionProgress
from masrel.protocol import StudyPaths


@dataclass(frozen=True, slots=True, kw_only=True)
class NextStep:
    """What is to be done next.

    Attributes
    ----------
    command : str
        The command.
    why : str
        What it is for.
    """

    command: str
    why: str


def next_step(
    study: StudyPaths,
    sessions: Sequence[SessionProgress],
    raters: Sequence[RaterProgress],
) -> NextStep:
    """Say what is to be done next in a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    sessions : sequence of SessionProgress
        What `session_progress` returned.
    raters : sequence of RaterProgress
        What `rater_progress` returned.

    Returns
    -------
    NextStep
        A command: what is damaged first, then what has begun, then what has not, and
        what is made of complete sessions.
    """
    root = shlex.quote(str(study.root))
    absent = {r.rater for r in raters if r.status in ("withdrawn", "excluded")}
    open_ = [s for s in sessions if s.stage != "complete" and s.rater not in absent]
    by_stage = {session.stage: session for session in reversed(open_)}
    if "unreadable" in by_stage:
        session = by_stage["unreadable"]
        why = f"the log of {session.rater} in session {session.session} is damaged"
        return NextStep(command=f"masrel verify {root}", why=why)
    if "not drawn" in by_stage and "begun" not in by_stage:
        n_absent = sum(session.stage == "not drawn" for session in open_)
        why = f"{n_absent} of {len(sessions)} schedules are not drawn"
        return NextStep(command=f"masrel schedule {root}", why=why)
    for stage in ("begun", "drawn"):
        if stage in by_stage:
            return _to_run(root, by_stage[stage])
    return _to_make(study, root)


def _to_run(root: str, session: SessionProgress) -> NextStep:
    place = f"--rater {session.rater} --session {session.session}"
    done = f"{session.n_graded} of {session.n_presentations} graded"
    if session.grades_from == "paper":
        command = f"masrel enter {root} FILE {place} --who WHO"
    else:
        command = f"masrel run {root} {place}"
    return NextStep(command=command, why=done)


def _to_make(study: StudyPaths, root: str) -> NextStep:
    # of sessions that are complete: each output is made after what it is made of
    logs = [*study.logs(), *study.conduct_logs()]
    manifest = study.report / "manifest.json"
    newest = max((log.stat().st_mtime_ns for log in logs), default=0)
    for verb, file in (("ratings", study.ratings_file), ("report", manifest)):
        made = file.stat().st_mtime_ns if file.exists() else -1
        if made < newest:
            why = f"all sessions are complete; {file.name} is "
            why += "not there yet" if made < 0 else "older than the logs"
            return NextStep(command=f"masrel {verb} {root}", why=why)
    why = "all sessions are complete, and their report is written"
    return NextStep(command=f"masrel verify {root}", why=why)
