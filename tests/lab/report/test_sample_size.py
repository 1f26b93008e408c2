"""Section *Sample size*: what the protocol says was planned, beside what came."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from masrel.lab.analysis import analyze
from masrel.lab.checklist import fill_checklist
from masrel.lab.protocol import Protocol, SampleSize, StudyPaths, report_sections
from masrel.lab.report import write_report
from tests.lab.analysis.studies import STUDY, plan, protocol_with, table_v

PLANNED: dict[str, Any] = {
    "estimate": "kappa",
    "n_items": 6,
    "n_raters": 8,
    "value": 0.6,
    "model": "mixture",
    "half_width": 0.25,
    "expected_half_width": 0.2431,
    "assurance": 0.7,
    "method": "simulation",
    "n_studies": 5000,
}


def protocol(*sizes: dict[str, Any], **changes: Any) -> Protocol:
    line = plan(**{"id": "kappa", "interval": "jackknife", **changes})
    whole = protocol_with(line, sections=("sample-size",))
    made = tuple(msgspec.convert({**PLANNED, **size}, SampleSize) for size in sizes)
    analysis = msgspec.structs.replace(whole.analysis, sample_sizes=made)
    return msgspec.structs.replace(whole, analysis=analysis)


def page(folder: Path, of: Protocol) -> str:
    files = write_report(of, table_v(), analyze(of, table_v()), folder)
    assert files.markdown is not None
    text = files.markdown.read_text("utf-8")
    return text[text.index("## Sample size") : text.index("## Provenance")]


def test_what_was_planned_stands_beside_what_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("masrel.planning._sizes.shown", refuse)  # nothing is drawn
    text = page(tmp_path, protocol({}))
    assert "With 6 items and 8 raters, the 95 % interval of Fleiss' κ" in text
    assert "assurance 0.700 of a half-width up to 0.25, if the coefficient is" in text
    assert "4 items and 8 raters came, with a half-width of 0.306" in text
    assert "more than was wanted, 0.250." in text
    assert "| kappa | planned | 6 | 8 | 0.600 | 0.243 | – | – | 0.700 | – |" in text
    assert "| kappa | came | 4 | 8 | 0.626 | 0.306 | 0.320 | 0.933 | – | – |" in text


def test_what_was_expected_is_the_limit_where_no_aim_was(tmp_path: Path) -> None:
    expected = {"half_width": None, "expected_half_width": 0.31}
    assert "no more than was expected, 0.310." in page(tmp_path, protocol(expected))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"interval": "none"}, "4 items and 8 raters came; there is no interval of"),
        ({"models": "dummy"}, "Of this nothing came: no dummy model has ratings"),
    ],
)
def test_what_did_not_come_is_said(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    assert words in page(tmp_path, protocol({}, **changes))


def test_only_a_study_that_says_its_size_has_the_section(tmp_path: Path) -> None:
    silent, loud = protocol(), protocol({})
    for of, has in ((silent, False), (loud, True)):
        report = msgspec.structs.replace(of.report, sections=None)
        names = report_sections(msgspec.structs.replace(of, report=report))
        assert ("sample-size" in names) == has
    assert "the protocol does not say how its size was chosen" in page(tmp_path, silent)


def test_a_checklist_has_the_sentence() -> None:
    checklist = fill_checklist(StudyPaths(STUDY), protocol({}), "grras")
    (item,) = (i for i in checklist.items if "Planned subjects" in i.topic)
    assert any(fact.startswith("With 6 items and 8 raters") for fact in item.facts)
