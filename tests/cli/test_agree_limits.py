"""Measurements: `masrel limits`, and SEM and concordance of `masrel agree`."""

import json
from pathlib import Path

import pytest

from masrel.agreement import limits_of_agreement
from tests.cli.process import Caller

PAIRS = [(9, 8), (5, 7), (4, 4), (8, 7), (6, 6), (5, 7)]
ROWS = "".join(f"p{i},{a},{b}\n" for i, (a, b) in enumerate(PAIRS))


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    file = tmp_path / "pairs.csv"
    file.write_text("item,Kim,Lee\n" + ROWS, encoding="utf-8")
    return file


def test_table_and_record_are_those_of_the_library(masrel: Caller, pairs: Path) -> None:
    call = ("limits", pairs, "--unit", "deg")
    limits = limits_of_agreement(PAIRS)
    out = masrel(*call).out
    assert "Limits of agreement (deg)" in out
    assert f"{limits.upper:.3f}" in out
    assert "Difference: Kim less Lee." in out
    (record,) = json.loads(masrel(*call, "--json", "-").out)["limits_of_agreement"]
    assert (record["first"], record["second"]) == ("Kim", "Lee")
    assert (record["lower"], record["upper"]) == (limits.lower, limits.upper)
    assert record["outer"] == list(limits.outer)
    assert record["upper_interval"]["high"] == limits.upper_interval.high


def test_estimates_in_small_units_keep_their_digits(
    masrel: Caller, tmp_path: Path
) -> None:
    # differences of 0, 2 and 1 tenths of a millimetre, in metres: SD 0.0001, and
    # SEM = 0.0001 / √2
    file = tmp_path / "metres.csv"
    file.write_text("item,Kim,Lee\na,1,1\nb,2,2.0002\nc,3,3.0001\n", encoding="utf-8")
    call = ("agree", file, "--coefficients", "lin_ccc,sem_consistency")
    out = masrel(*call).out
    row = next(line for line in out.splitlines() if "SEM" in line)
    assert " 7.071e−05 " in row
    assert " 1.000 " in next(line for line in out.splitlines() if "Lin's" in line)
    assert "SEM, consistency = 7.071e−05" in masrel(*call, "--sentence").out
