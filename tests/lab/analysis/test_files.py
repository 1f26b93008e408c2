"""The analysis as JSON: every digit, a reason for each null, inputs that check."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import UndefinedStatisticWarning
from masrel.lab.analysis import Analysis, analyze, as_analysis_document, write_analysis
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


def undefined() -> Analysis:
    same = ratings(*of_session("test", R1=("1", "1"), R2=("1", "1")))
    with pytest.warns(UndefinedStatisticWarning):
        return analyze(protocol_with(plan(interval="analytic", target="items")), same)


def read_back(analysis: Analysis, folder: Path) -> dict[str, Any]:
    path = folder / "deep" / "analysis.json"
    write_analysis(analysis, path)
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def test_every_digit_survives(tmp_path: Path) -> None:
    analysis = published()
    kappa, _ = read_back(analysis, tmp_path)["estimates"]
    estimate = analysis.estimates[0].estimate
    assert estimate is not None
    assert estimate.interval is not None
    assert kappa["estimate"]["value"] == estimate.value
    assert kappa["estimate"]["interval"]["low"] == estimate.interval.low
    assert kappa["estimate"]["interval"]["method"] == estimate.interval.method


def test_a_line_of_the_plan_stands_beside_its_numbers(tmp_path: Path) -> None:
    _, lost = read_back(published(), tmp_path)["estimates"]
    assert (lost["id"], lost["models"], lost["coefficient"]) == (
        "lost",
        "dummy",
        "fleiss_kappa",
    )
    assert lost["estimate"] is None
    assert lost["reason"] == "no dummy model has ratings in session test"


def test_nan_is_null_with_a_reason(tmp_path: Path) -> None:
    (line,) = read_back(undefined(), tmp_path)["estimates"]
    assert line["estimate"]["value"] is None
    assert line["estimate"]["reason"]
    assert line["estimate"]["interval"]["low"] is None
    assert line["estimate"]["interval"]["reason"]


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


def test_the_same_analysis_gives_the_same_bytes(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("one.json", "two.json")]
    for path in paths:
        write_analysis(published(), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_parts_nobody_asked_for_are_null() -> None:
    document = as_analysis_document(analyze(protocol_with(), table_v()))
    assert document["intended"] is None
    assert document["speeds"] is None


def test_no_value_is_left_that_json_does_not_have() -> None:
    def leaves(value: object) -> list[object]:
        if isinstance(value, dict):
            return [leaf for part in value.values() for leaf in leaves(part)]
        if isinstance(value, list):
            return [leaf for part in value for leaf in leaves(part)]
        return [value]

    for document in map(as_analysis_document, (published(), undefined())):
        for leaf in leaves(document):
            assert leaf is None or isinstance(leaf, str | bool | int | float)
            assert not (isinstance(leaf, float) and not math.isfinite(leaf))
