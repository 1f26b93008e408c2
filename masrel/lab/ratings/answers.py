"""Answers to a study's questionnaires: from its logs, or from a table of them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from masrel._files import from_safe_cell, write_file
from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._study_files import table_csv
from masrel.lab.conduct._study_log import study_answers
from masrel.lab.protocol import Protocol, Question, StudyPaths
from masrel.lab.protocol._values import Answer, checked_answer, questions_of
from masrel.lab.ratings.study_file import (
    _check_columns,
    _Problem,
    _read_rows,
    _refuse,
)
from masrel.lab.run._state import FROM_PERSONS, SessionState, read_session
from masrel.lab.schedule.presentation import read_schedule

RECONSTRUCTED = "reconstructed"
"""Where answers come from that were never given: one set that fits what is printed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenAnswer:
    """One question to one rater, and the answer.

    Attributes
    ----------
    session : str or None
        The session; None for a question about the study.
    rater : str or None
        Who was asked; None where the answers are known and not whose they are.
    questionnaire, question : str
        Their ids.
    model : str or None
        The model of the presentation that it is about, if it is about one.
    repeat : int or None
        Which of the model's presentations it was.
    answer : str, int, float or None
        The answer as its type has it; None is missing.
    grades_from : str
        Who answered, as in the ratings; ``"reconstructed"`` for answers that were never
        given, but fit what is printed of them.
    """

    session: str | None
    rater: str | None
    questionnaire: str
    question: str
    model: str | None
    repeat: int | None
    answer: Answer
    grades_from: str


_FORMAT = 1  # version of a table of answers

_COLUMNS = tuple(field.name for field in fields(GivenAnswer))


def answers_from_logs(study: StudyPaths, protocol: Protocol) -> tuple[GivenAnswer, ...]:
    """Collect the answers of a study from its logs.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    tuple of GivenAnswer
        Of every session that has begun one for each question, None where there is no
        answer yet; then those about the study. Corrections replace what they correct.

    Raises
    ------
    SessionLogError
        If a log is damaged.
    ScheduleError
        If the schedule of a log is missing or damaged.
    """
    if not protocol.questionnaires:
        return ()
    begun = [
        (rater, session, read_session(log)[1])
        for rater, session in protocol.rater_sessions
        if (log := study.log_file(rater, session)).exists()
    ]
    begun = [each for each in begun if each[2].header]
    of_sessions = [
        answer
        for rater, session, state in begun
        for answer in _of_session(study, protocol, session, rater, state)
    ]
    # who answers for each rater who has begun
    sources = {rater: str(state.source) for rater, _, state in begun}
    of_study = study_answers(study)
    about_study = [
        GivenAnswer(
            session=None,
            rater=rater,
            questionnaire=questionnaire.id,
            question=question.id,
            model=None,
            repeat=None,
            answer=of_study.get(rater, {}).get((questionnaire.id, question.id)),
            grades_from=source,
        )
        for rater, source in sources.items()
        for questionnaire, question in questions_of(protocol, "study")
    ]
    return (*of_sessions, *about_study)


def answers_of(
    study: StudyPaths, protocol: Protocol, *, file: Path | None = None
) -> tuple[GivenAnswer, ...]:
    """Read the answers that belong to the ratings of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    file : Path, optional
        A table of ratings that is used whatever the logs say; answers belong to it only
        if it is the study's.

    Returns
    -------
    tuple of GivenAnswer
        What the logs say, where there are some; else what is in ``answers.csv`` where
        there are ratings of the study, or in ``published_answers.csv``.

    Raises
    ------
    RatingsError
        If the file is not a table of answers.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If the schedule of a log is missing or damaged.
    """
    of_study = (None, study.ratings_file, study.published_file)
    if file not in of_study or not protocol.questionnaires:
        return ()
    if file != study.published_file and study.logs():
        return answers_from_logs(study, protocol)
    is_published = file == study.published_file or not study.ratings_file.is_file()
    path = study.published_answers_file if is_published else study.answers_file
    return read_answers(path, protocol) if path.is_file() else ()


def _of_session(
    study: StudyPaths, protocol: Protocol, session: str, rater: str, state: SessionState
) -> Iterator[GivenAnswer]:
    schedule = read_schedule(study.schedule_file(rater, session))
    about = [(p.code, p.model, p.repeat) for p in schedule.presentations]
    asked_of = (
        *(
            (each, place)
            for place in about
            for each in questions_of(protocol, "presentation")
        ),
        *((each, (None, None, None)) for each in questions_of(protocol, "session")),
    )
    for (questionnaire, question), (code, model, repeat) in asked_of:
        key = questionnaire.id, question.id, code
        yield GivenAnswer(
            session=session,
            rater=rater,
            questionnaire=questionnaire.id,
            question=question.id,
            model=model,
            repeat=repeat,
            answer=state.answers.get(key),
            grades_from=state.answered_from.get(key, str(state.source)),
        )


def answers_csv(answers: tuple[GivenAnswer, ...]) -> str:
    """Return answers as the text of their file.

    Parameters
    ----------
    answers : tuple of GivenAnswer
        The answers.

    Returns
    -------
    str
        What `write_answers` writes.
    """
    of_persons = (*FROM_PERSONS, RECONSTRUCTED)
    is_simulated = any(each.grades_from not in of_persons for each in answers)
    head = ["SIMULATED: not answers of persons."] * is_simulated
    head += ["Answers to questionnaires, one row a question; empty is missing."]
    rows = ((getattr(each, name) for name in _COLUMNS) for each in answers)
    return table_csv(_COLUMNS, rows, head=[*head, f"format: {_FORMAT}"], absent="")


def write_answers(
    answers: tuple[GivenAnswer, ...], path: Path, *, within: Path | None = None
) -> None:
    """Write answers as CSV, for their owner alone; the same answers, the same bytes.

    Parameters
    ----------
    answers : tuple of GivenAnswer
        The answers.
    path : Path
        The file.
    within : Path, optional
        A folder that the file may not leave by a link, such as the study's.

    Raises
    ------
    ParameterError
        If `path` is the place of a study's primary record, or not within `within`.
    OSError
        If the file cannot be written; what was there is then there still.
    """
    write_file(path, answers_csv(answers), within=within, mode=0o600)


def read_answers(path: Path, protocol: Protocol) -> tuple[GivenAnswer, ...]:
    """Read a table of answers.

    Parameters
    ----------
    path : Path
        A CSV file with the columns that `write_answers` writes.
    protocol : Protocol
        The study's protocol, whose questions they are.

    Returns
    -------
    tuple of GivenAnswer
        In the order of the file.

    Raises
    ------
    RatingsError
        If a column is missing, or a row has a question that the protocol has not or an
        answer that it cannot have. The message lists up to 20 problems.
    """
    rows = _read_rows(path)
    _check_columns(rows, _COLUMNS)
    questions = {
        (questionnaire.id, question.id): question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    problems: list[_Problem] = []
    answers = []
    for line, cells in rows.rows:
        try:
            answers.append(_of_row(cells, questions))
        except ParameterError as error:
            problems.append((line, None, str(error)))
    _refuse(path, problems)
    return tuple(answers)


def _of_row(
    cells: Mapping[str, str], questions: Mapping[tuple[str, str], Question]
) -> GivenAnswer:
    key = cells["questionnaire"], cells["question"]
    if key not in questions:
        known = listed(".".join(name) for name in questions) or "none"
        raise ParameterError(f"question: needed one of {known}, got {'.'.join(key)}")
    text, repeat = from_safe_cell(cells["answer"]), cells["repeat"]
    if repeat and not repeat.isdecimal():
        raise ParameterError(f"repeat: needed a whole number, got {repeat!r}")
    answer = checked_answer(questions[key], text, where="answer") if text else None
    return GivenAnswer(
        session=cells["session"] or None,
        rater=cells["rater"] or None,
        questionnaire=key[0],
        question=key[1],
        model=cells["model"] or None,
        repeat=int(repeat) if repeat else None,
        answer=answer,
        grades_from=cells["grades_from"],
    )
