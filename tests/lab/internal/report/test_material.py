"""Where the data come from is said in one word, one line, and one line for traces."""

import dataclasses
from pathlib import Path

import msgspec
import pytest

from masrel.lab.analysis import analyze
from masrel.lab.ratings import Ratings
from masrel.lab.report import write_report
from masrel.lab.report._material import Material, gather
from masrel.pages._sections import Paragraph
from tests.lab.analysis.studies import of_session, protocol_with, ratings, table_v
from tests.lab.internal.report.made import build_sections


def material(rows: Ratings, *sections: str) -> Material:
    protocol = protocol_with(sections=sections)
    return gather(protocol, rows, analyze(protocol, rows))


def of_source(source: str, rater: str = "R1") -> Ratings:
    return ratings(("test", rater, "HM1", "1"), source=source)


SOURCE = (
    "Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370, "
    "doi 10.1109/TNSRE.2012.2195330"
)


@pytest.mark.parametrize(
    ("rows", "data", "stamp", "trace_stamp"),
    [
        (of_source("simulated"), "simulated", "SIMULATED DATA", "SIMULATED DATA"),
        (
            table_v(),
            "published",
            f"Published data: {SOURCE}",
            "Model reconstruction at published mean speeds, not a measurement: "
            + SOURCE,
        ),
        (
            of_source("recorded"),
            "recorded",
            "",
            "Model reconstruction at recorded mean speeds, not a measurement",
        ),
    ],
    ids=["simulated", "published", "recorded"],
)
def test_the_source_is_said(
    rows: Ratings, data: str, stamp: str, trace_stamp: str
) -> None:
    made = material(rows)
    assert (made.data, made.stamp, made.trace_stamp) == (data, stamp, trace_stamp)


def test_one_simulated_rating_makes_all_of_it_simulated() -> None:
    first, second = of_source("recorded"), of_source("simulated", "R2")
    rows = (*first.rows, *second.rows)
    mixed = material(dataclasses.replace(second, rows=rows))
    assert mixed.data == "recorded+simulated"
    assert mixed.stamp == "SIMULATED DATA"


def test_recorded_ratings_are_introduced_by_their_study(tmp_path: Path) -> None:
    protocol, rows = protocol_with(sections=()), of_source("recorded")
    files = write_report(protocol, rows, analyze(protocol, rows), tmp_path)
    for path in (files.html, files.markdown):
        page = path.read_text(encoding="utf-8")
        assert "Study hess2012, recorded ratings." in page
        assert "simulated" not in page.lower()


def test_a_source_without_a_name_leaves_no_colon() -> None:
    made = material(table_v())
    study = msgspec.structs.replace(made.protocol.study, source="")
    protocol = msgspec.structs.replace(made.protocol, study=study)
    assert gather(protocol, made.ratings, made.analysis).stamp == "Published data"


def test_speeds_that_are_not_known_are_counted() -> None:
    known = ratings(*of_session("test", R1=("1",)), mean_speed_deg_s=80.0)
    lost = ratings(*of_session("test", R2=("1",)))
    both = dataclasses.replace(known, rows=(*known.rows, *lost.rows))
    (section,) = build_sections(material(both, "speeds"))
    about = section.blocks[0]
    assert isinstance(about, Paragraph)
    assert about.text.endswith("Ratings whose speed is not known: 1.")
