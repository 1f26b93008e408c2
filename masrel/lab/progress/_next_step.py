"""What a coordinator does next: one verb."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.lab.progress._raters import RaterProgress
from masrel.lab.progress._session_stages import SessionProgress
from masrel.lab.protocol import StudyPaths


@dataclass(frozen=True, slots=True, kw_only=True)
class NextStep:
    """What is to be done next.

    Attributes
    ----------
    command : str
        The command.
    why : str
        What it is for.
    verb : str
        The verb of the command: ``"run"``, say.
    rater, session : str or None
        Whose session the verb is about; None where it is about the study.
    """

    command: str
    why: str
    verb: str
    rater: str | None = None
    session: str | None = None


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
        return _of_study("verify", root, why)
    if "not drawn" in by_stage and "begun" not in by_stage:
        n_absent = sum(session.stage == "not drawn" for session in open_)
        why = f"{n_absent} of {len(sessions)} schedules are not drawn"
        return _of_study("schedule", root, why)
    for stage in ("begun", "drawn"):
        if stage in by_stage:
            return _to_run(root, by_stage[stage])
    return _to_make(study, root)


def _of_study(verb: str, root: str, why: str) -> NextStep:
    return NextStep(command=f"masrel {verb} {root}", why=why, verb=verb)


def _to_run(root: str, session: SessionProgress) -> NextStep:
    place = f"--rater {session.rater} --session {session.session}"
    verb, command = "run", f"masrel run {root} {place}"
    if session.grades_from == "paper":
        verb, command = "enter", f"masrel enter {root} FILE {place} --who WHO"
    return NextStep(
        command=command,
        why=f"{session.n_graded} of {session.n_presentations} graded",
        verb=verb,
        rater=session.rater,
        session=session.session,
    )


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
            return _of_study(verb, root, why)
    why = "all sessions are complete, and their report is written"
    return _of_study("verify", root, why)
