"""The analysis as JSON: every digit, a reason for each null, inputs that check."""

import dataclasses
import hashlib
import json
import math
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import fleiss_kappa
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval
from masrel.intervals import estimate
from masrel.lab.analysis import (
    Analysis,
    analyze,
    to_frame,
    write_analysis,
)
from masrel.lab.protocol import protocol_hash
from masrel.lab.ratings import ratings_csv
from tests.lab.analysis.studies import (
    IN_PERSON,
    PUBLISHED,
    in_person,
    of_session,
    plan,
    protocol_with,
    ratings,
    table_v,
)

SECTIONS = ("intended", "in-person", "speeds")


def published() -> Analysis:
    lines = (plan(id="kappa", interval="jackknife"), plan(id="lost", models="dummy"))
    protocol = protocol_with(*lines, sections=SECTIONS)
    return analyze(protocol, table_v(), in_person=in_person())


def read_back(analysis: Analysis, folder: Path) -> dict[str, Any]:
    path = folder / "deep" / "analysis.json"
    write_analysis(analysis, path)
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def test_the_inputs_are_named_by_hashes_anybody_can_check(tmp_path: Path) -> None:
    document = read_back(published(), tmp_path)
    inputs = document["inputs"]
    assert inputs == {
        "protocol_sha256": protocol_hash(
            protocol_with(
                plan(id="kappa", interval="jackknife"),
                plan(id="lost", models="dummy"),
                sections=SECTIONS,
            )
        ),
        "ratings_sha256": hashlib.sha256(PUBLISHED.read_bytes()).hexdigest(),
        "in_person_sha256": hashlib.sha256(IN_PERSON.read_bytes()).hexdigest(),
    }
    described = [document[name] for name in ("intended", "in_person", "speeds")]
    parts = [*document["estimates"], *described]
    assert all(part["inputs"] == inputs for part in parts)


def test_ratings_without_a_file_are_named_by_their_rows() -> None:
    rows = of_session("test", R1=("1", "2"), R2=("1", "3"))
    found = analyze(protocol_with(), ratings(*rows))
    assert found.inputs["ratings_sha256"] == (
        hashlib.sha256(ratings_csv(ratings(*rows)).encode()).hexdigest()
    )
    other = analyze(protocol_with(), ratings(*rows[:-1]))
    assert found.inputs["ratings_sha256"] != other.inputs["ratings_sha256"]
    assert "in_person_sha256" not in found.inputs


RATINGS = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"], ["a", "a"]] * 3


def test_a_row_holds_every_field_of_an_estimate_and_its_interval() -> None:
    with_one = estimate("cohen_kappa", RATINGS, target="items", method="jackknife")
    interval = with_one.interval
    assert interval is not None
    row = to_frame([with_one]).iloc[0]
    for field in dataclasses.fields(Estimate):
        if field.name != "interval":
            expected = getattr(with_one, field.name)
            assert row[field.name] == expected or row[field.name] is expected
    names = {field.name for field in dataclasses.fields(Interval) if field.repr}
    for name in names - {"reason"}:
        assert row[name] == getattr(interval, name) or row[name] is None
    assert row["interval_reason"] is None


def test_columns_are_the_same_with_and_without_intervals() -> None:
    with_one = estimate("cohen_kappa", RATINGS, target="items")
    without = fleiss_kappa(RATINGS)
    frame = to_frame({"one": with_one, "none": without})
    assert list(frame.index) == ["one", "none"]
    assert list(frame.columns) == list(to_frame([]).columns)
    assert list(frame["coefficient"]) == ["cohen_kappa", "fleiss_kappa"]
    assert math.isnan(frame.loc["none", "low"])
    assert frame["low"].dtype == frame["value"].dtype == float
    assert frame["n_items"].dtype == int


def test_what_is_no_estimate_is_refused() -> None:
    kappa = fleiss_kappa(RATINGS)
    with pytest.raises(ParameterError, match="place 1: needs an Estimate, got float"):
        to_frame([kappa, kappa.value])  # type: ignore[list-item]
