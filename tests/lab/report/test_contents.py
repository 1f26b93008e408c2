"""What a report says of its data, in the files that it writes."""

import csv
import re
from math import radians
from pathlib import Path

import msgspec
import pytest

from masrel.lab.analysis import analyze
from masrel.lab.elbow import ConstantSpeed, peak_torque
from masrel.lab.protocol import elbow_parameters
from masrel.lab.report import ReportFiles, write_report
from tests.lab.analysis.studies import hess2012, protocol_with, table_v
from tests.lab.report.pages import name_of


def rows_of(files: ReportFiles, name: str) -> list[dict[str, str]]:
    (path,) = [path for path in files.tables if name_of(path) == name]
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_in_person_pairs_and_remarks_are_told(published: ReportFiles) -> None:
    text = published.markdown.read_text(encoding="utf-8")
    assert "11 of 11 pairs are equal (100.0 %)" in text
    assert "absent by Table IV and its footnote" in text
    rows = rows_of(published, "in_person")
    assert len(rows) == 11
    assert {row["equal"] for row in rows} == {"yes"}


def test_the_peaks_are_those_of_the_law(published: ReportFiles) -> None:
    # R1 stretched HM1 at 122 deg/s from 30 deg to the end of the range, 146 deg.
    protocol = hess2012()
    motion = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(122))
    peak = peak_torque(elbow_parameters(protocol, "HM1"), motion)
    (hm1, *_) = rows_of(published, "peak_torque")
    assert float(hm1["R1_nm"]) == pytest.approx(peak, rel=1e-14)
    own = [float(hm1[f"R{n}_nm"]) for n in range(1, 9)]
    assert (float(hm1["least_nm"]), float(hm1["most_nm"])) == (min(own), max(own))


def test_the_design_says_how_often_the_arm_is_stretched(
    published: ReportFiles,
) -> None:
    text = published.markdown.read_text(encoding="utf-8")
    assert "Before each grade a rater stretches the arm as often as wanted." in text


def test_traces_are_called_reconstructions(published: ReportFiles) -> None:
    text = published.markdown.read_text(encoding="utf-8")
    assert "reconstructions, not measurements" in text
    assert "published mean speeds" in text


def test_the_parameters_are_shown_as_they_were_given(tmp_path: Path) -> None:
    protocol = protocol_with(sections=("design",))
    first = msgspec.structs.replace(protocol.models[0], residual_ratio=0.1255)
    protocol = msgspec.structs.replace(protocol, models=(first, *protocol.models[1:]))
    rows = table_v()
    files = write_report(protocol, rows, analyze(protocol, rows), tmp_path)
    text = files.markdown.read_text(encoding="utf-8")
    assert re.search(r"\| HM1 \| standard \| 1 \| 130 \| 1.40 \| 0.1255 \| 60 \|", text)


@pytest.mark.parametrize(
    ("rules", "sentence"),
    [
        ({}, None),
        ({"scheme": "williams"}, "meets the models in an order of a Williams design"),
        (
            {"scheme": "restricted", "standards_apart": True, "max_same_grade": 2},
            "meets the models in an order drawn from all in which no two standards "
            "come in a row and at most 2 of one grade come in a row.",
        ),
    ],
)
def test_the_design_says_how_orders_were_drawn(
    tmp_path: Path, rules: dict[str, object], sentence: str | None
) -> None:
    protocol = protocol_with(sections=("design",))
    scheme = msgspec.structs.replace(protocol.schedule, **rules)
    protocol = msgspec.structs.replace(protocol, schedule=scheme)
    rows = table_v()
    files = write_report(protocol, rows, analyze(protocol, rows), tmp_path)
    text = files.markdown.read_text(encoding="utf-8")
    assert (sentence or "scale MAS") in text
    assert ("meets the models" in text) == (sentence is not None)
