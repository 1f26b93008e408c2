"""The first paragraph: sentences of one file, numbers of the analysis, or why none."""

import dataclasses
import re
import tomllib
import warnings
from pathlib import Path
from typing import Any

import msgspec
import pytest

import masrel.lab.report
from masrel.lab.analysis import Analysis, analyze, as_analysis_document
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.report import ReportFiles, write_report
from masrel.scales import MODIFIED_ASHWORTH
from tests.lab.analysis.studies import of_session, plan, protocol_with, ratings, table_v
from tests.lab.report.pages import simulated_ratings

FILE = Path(masrel.lab.report.__file__).parent / "templates" / "sentences.toml"
SENTENCES = tomllib.loads(FILE.read_text(encoding="utf-8"))
AGAIN = plan(
    id="again",
    kind="test-retest",
    coefficient="stratified_kappa",
    sessions=["test", "retest"],
    target="items",
)


def pattern(sentence: str) -> str:
    """A sentence of the file, any words in its braces."""
    return re.sub(r"\\{\w+\\}", "(.*?)", re.escape(sentence))


def result_of(rows: Ratings, folder: Path, *lines: Any) -> tuple[str, Analysis]:
    """The first paragraph of a report, and the analysis that it is of."""
    protocol = protocol_with(*lines, sections=("intended",))
    analysis = analyze(protocol, rows)
    files = write_report(protocol, rows, analysis, folder)
    return paragraph(files), analysis


def paragraph(files: ReportFiles) -> str:
    """The first paragraph of both pages, which is the same."""
    page = files.html.read_text(encoding="utf-8")
    found = re.search(r'<p class="result">(.*?)</p>', page)
    assert found is not None
    text = re.sub("<.*?>", "", found[1]).replace("&#x27;", "'").replace("&nbsp;", " ")
    plain = files.markdown.read_text(encoding="utf-8").replace("*", "")
    assert text in plain.replace("\\", "")
    return text


def of_the_file(text: str) -> bool:
    """Whether a paragraph is sentences of the file and nothing else."""
    known = [*SENTENCES["result"].values(), *SENTENCES["interval"].values()]
    known = [sentence for sentence in known if sentence.endswith(".")]
    return re.fullmatch(f"(?:(?:{'|'.join(map(pattern, known))}) ?)+", text) is not None


def numbers(content: object) -> set[str]:
    """Every number of an analysis, as a paragraph may show it."""
    if isinstance(content, dict):
        return set().union(*map(numbers, content.values()))
    if isinstance(content, list):
        return {str(len(content))}.union(*map(numbers, content))
    if isinstance(content, float):
        return {f"{content:.3f}", f"{content:.1f}", f"{100 * content:g}"}
    return {str(content)} if isinstance(content, int) else set()


def test_the_published_result_is_told_in_sentences_of_the_file(tmp_path: Path) -> None:
    text, analysis = result_of(
        table_v(),
        tmp_path,
        plan(id="kappa", interval="jackknife"),
        plan(id="items", interval="posterior", target="items"),
        AGAIN,
    )
    assert text == (
        "In session test, 8 raters graded 4 standard models (32 grades, none missing): "
        "Fleiss' κ was 0.626 (95 % confidence interval 0.320 to 0.933, for other "
        "raters like these on the same models). For these raters on other models like "
        "these, its 95 % credible interval is 0.370 to 0.874. On average over the 4 "
        "standard models, 84.4 % of the grades were as intended. Agreement of raters "
        "with themselves could not be estimated: there are no ratings of session "
        "retest."
    )
    assert of_the_file(text)
    assert not of_the_file(text.replace("graded", "scored"))
    known = numbers(
        msgspec.json.decode(msgspec.json.encode(as_analysis_document(analysis)))
    )
    told = re.findall(r"\d+(?:\.\d+)?", text.replace("32 grades", ""))
    assert set(told) <= known


def test_of_one_model_no_average_is_told(tmp_path: Path) -> None:
    rows = ratings(*of_session("test", R1=("1",), R2=("1",)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        text, _ = result_of(rows, tmp_path, plan(coefficient="percent_agreement"))
    assert "Of the grades of 1 standard model, 100.0 % were as intended." in text
    assert of_the_file(text)


def test_raters_who_grade_again_and_missing_grades_are_told(tmp_path: Path) -> None:
    text, _ = result_of(simulated_ratings(), tmp_path, plan(), AGAIN)
    assert text.startswith(
        "Simulated data. In session test, 2 raters graded 2 standard"
    )
    assert "(3 grades, 1 missing)" in text
    assert "In test and again in retest, 2 raters graded 2 standard models:" in text
    assert of_the_file(text.removeprefix("Simulated data. "))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (plan(coefficient="fleiss_kappa"), "Fleiss' κ is undefined, as "),
        (plan(models="dummy"), "Fleiss' κ of the dummy models in session test could "),
        (None, "The plan asks for no estimate of agreement between raters."),
    ],
    ids=["undefined", "not there", "not planned"],
)
def test_what_there_is_not_is_told_with_its_reason(
    line: Any, expected: str, tmp_path: Path
) -> None:
    rows = ratings(*of_session("test", R1=("1", "1"), R2=("1", "1")))
    protocol = protocol_with(*filter(None, [line]), sections=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warnings.warn", lambda *_, **__: None)
        analysis = analyze(protocol, rows)
    text = paragraph(write_report(protocol, rows, analysis, tmp_path))
    assert expected in text
    assert of_the_file(text)
    if analysis.estimates:
        (entry,) = analysis.estimates
        reason = entry.reason or (entry.estimate and entry.estimate.reason)
        assert str(reason) in text


def test_raters_alone_are_told_by_the_least_and_the_most(tmp_path: Path) -> None:
    line = msgspec.structs.replace(AGAIN, coefficient="cohen_kappa")
    rows = simulated_ratings()
    graded = tuple(row._replace(grade=row.grade or "2") for row in rows.rows)
    rows = dataclasses.replace(rows, rows=graded)
    text, analysis = result_of(rows, tmp_path, plan(), line)
    (entry,) = (e for e in analysis.estimates if e.line.id == "again")
    values = sorted(rater.estimate.value for rater in entry.by_rater)
    assert (
        f"lay between {values[0]:.3f} and {values[-1]:.3f}.".replace("-", "−") in text
    )


def test_excluded_raters_are_named(tmp_path: Path) -> None:
    protocol, rows = protocol_with(plan(), sections=()), table_v()
    analysis = analyze(protocol, rows, excluded=["R3"])
    text = paragraph(write_report(protocol, rows, analysis, tmp_path))
    assert "7 raters" in text
    assert text.endswith("None of this counts the grades of R3, who is excluded.")


def test_a_model_that_came_again_is_one_model(tmp_path: Path) -> None:
    once = simulated_ratings().table.to_dict("records")
    keys = ("session", "rater", "model", "grade")
    rows = [{key: row[key] for key in keys} for row in once if row["session"] == "test"]
    twice = [{**row, "repeat": repeat} for row in rows for repeat in (1, 2)]
    text, _ = result_of(ratings_from_rows(twice, MODIFIED_ASHWORTH), tmp_path, plan())
    assert (
        "2 raters graded 2 standard models, 4 presentations of them, (6 grades" in text
    )


def test_weights_are_told_within_a_sentence(tmp_path: Path) -> None:
    line = plan(coefficient="krippendorff_alpha", weights="quadratic")
    text, _ = result_of(table_v(), tmp_path, line)
    assert "none missing): Krippendorff's α with quadratic weights was 0.886." in text
