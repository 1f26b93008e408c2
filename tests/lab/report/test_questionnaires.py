"""The section of questionnaires says how questions were answered, not by whom."""

import math
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from masrel.lab.analysis import QuestionSummary, analyze
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import (
    GivenAnswer,
    read_answers,
    read_study_data,
    write_answers,
)
from masrel.lab.report._document import write_report
from tests.lab.analysis.studies import ratings
from tests.lab.protocol.documents import changed, write

HESS = StudyPaths(Path(__file__).parents[3] / "studies" / "hess2012")


def summaries_of(*answers: GivenAnswer) -> tuple[QuestionSummary, ...]:
    data = read_study_data(HESS, read_protocol(HESS.protocol))
    return analyze(data.protocol, data.ratings, answers=answers).questionnaires


def score(answer: int | None, rater: str = "R1") -> GivenAnswer:
    return GivenAnswer(
        session="test",
        rater=rater,
        questionnaire="realism",
        question="score",
        model=None,
        repeat=None,
        answer=answer,
        grades_from="console",
    )


def test_the_published_realism_is_printed_and_its_answers_are_no_bodys(
    tmp_path: Path,
) -> None:
    data = read_study_data(HESS, read_protocol(HESS.protocol))
    assert [each.answer for each in data.answers] == [6, 7, 7, 8, 8, 8, 8, 9]
    assert {each.rater for each in data.answers} == {None}
    analysis = analyze(data.protocol, data.ratings, answers=data.answers)
    files = write_report(data.protocol, data.ratings, analysis, tmp_path)
    text = files.markdown.read_text(encoding="utf-8")
    _, section = text.split("## Questionnaires")
    assert "7.63 ± 0.92" in section
    assert section.count("not the answers that were given") >= 2
    assert "R1" not in section


def test_numbers_are_summed_up_as_by_hand() -> None:
    # mean 6, deviations -4, 0, 0, 1, 3: SD = sqrt(26 / 4)
    answers = (2, 6, 6, 7, 9, None)
    (summary,) = summaries_of(*(score(x, f"R{i}") for i, x in enumerate(answers)))
    assert (summary.n, summary.n_missing) == (5, 1)
    assert summary.mean == 6.0
    assert summary.sd == pytest.approx((26 / 4) ** 0.5, rel=1e-15)
    assert (summary.median, summary.least, summary.most) == (6.0, 2.0, 9.0)
    counts = {count.label: count.n for count in summary.counts}
    assert len(counts) == 10
    assert [label for label, n in counts.items() if n] == ["2", "6", "7", "9"]


def test_what_few_raters_answered_shows_nobodys_answer(tmp_path: Path) -> None:
    data = read_study_data(HESS, read_protocol(HESS.protocol))
    report = msgspec.structs.replace(data.protocol.report, sections=("questionnaires",))
    protocol = msgspec.structs.replace(data.protocol, report=report)

    def shown(*answers: GivenAnswer) -> tuple[QuestionSummary, str]:
        analysis = analyze(protocol, data.ratings, answers=answers)
        files = write_report(protocol, data.ratings, analysis, tmp_path)
        texts = [files.markdown, *files.tables]
        (summary,) = analysis.questionnaires
        return summary, "".join(text.read_text(encoding="utf-8") for text in texts)

    four = [score(3, f"R{i}") for i in range(4)]
    few, page = shown(*four, *four)  # each asked twice
    assert (few.n, few.counts) == (8, ())
    numbers = (few.mean, few.sd, few.median, few.least, few.most)
    assert all(math.isnan(number) for number in numbers)
    assert "3.00" not in page
    assert "fewer than 5 raters answered a question" in page
    many, page = shown(*four, score(8, "R4"))
    assert (many.n, many.mean, many.least, many.most) == (5, 4.0, 3.0, 8.0)
    assert "4.00 ± 2.24" in page
    assert "fewer than" not in page


def test_one_answer_has_no_deviation_and_an_excluded_rater_none() -> None:
    data = read_study_data(HESS, read_protocol(HESS.protocol))
    document = msgspec.to_builtins(data.protocol)
    document["questionnaires"][0]["questions"][0]["public"] = True  # of few, too
    asked = msgspec.convert(document, Protocol)
    answers = (score(5), score(9, "R2"))
    analysis = analyze(asked, data.ratings, answers=answers, excluded=["R2"])
    (summary,) = analysis.questionnaires
    assert (summary.n, summary.mean) == (1, 5.0)
    assert summary.sd != summary.sd


CHOICE = {
    "id": "again",
    "text": "Again?",
    "type": "choice",
    "choices": ["yes", "no"],
    "public": True,
}
ANALOGUE = {"id": "sure", "text": "Sure?", "type": "visual-analogue", "public": True}
TEXT = {"id": "note", "text": "What?", "type": "text"}


@pytest.fixture
def asking(tmp_path: Path) -> Protocol:
    questions = [CHOICE, ANALOGUE, TEXT]
    document = changed(
        "questionnaires",
        to=[{"id": "q", "title": "Q", "when": "session", "questions": questions}],
    )
    return read_protocol(write(document, tmp_path))


def test_choices_are_counted_analogues_are_in_tenths_and_texts_are_left_out(
    asking: Protocol,
) -> None:
    def given(question: str, *answers: str | float) -> list[GivenAnswer]:
        like = replace(score(1), questionnaire="q", question=question)
        return [replace(like, answer=answer) for answer in answers]

    answers = [
        *given("again", "no", "no", "yes"),
        *given("sure", 0, 9.9, 10, 100),
        *given("note", "it stuck"),
    ]
    rows = ratings(("test", "R1", "HM1", "1"))
    analysis = analyze(asking, rows, answers=answers)
    again, sure, note = analysis.questionnaires
    assert [(c.label, c.n) for c in again.counts] == [("yes", 1), ("no", 2)]
    assert [c.n for c in sure.counts] == [2, 1, 0, 0, 0, 0, 0, 0, 0, 1]
    assert sure.counts[0].label == "0–10"
    assert (note.n, note.counts) == (1, ())


def test_answers_are_read_as_they_were_written(
    asking: Protocol, tmp_path: Path
) -> None:
    answers = tuple(
        replace(score(1), questionnaire="q", question=question, answer=answer)
        for question, answer in (
            ("again", "no"),
            ("sure", 12.5),
            ("note", '=1+1, "so"'),
            ("note", None),
        )
    )
    file = tmp_path / "answers.csv"
    write_answers(answers, file)
    assert "'=1+1" in file.read_text(encoding="utf-8")
    assert read_answers(file, asking) == answers
