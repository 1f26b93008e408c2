"""`masrel agree` of measurements: SEM, concordance, and limits of agreement drawn."""

import json
from pathlib import Path

import pytest

from masrel.agreement import limits_of_agreement, lin_ccc
from tests.cli.process import Caller

PAIRS = [(9, 8), (5, 7), (4, 4), (8, 7), (6, 6), (5, 7)]
ROWS = "".join(f"p{i},{a},{b}\n" for i, (a, b) in enumerate(PAIRS))


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    file = tmp_path / "pairs.csv"
    file.write_text("item,Kim,Lee\n" + ROWS, encoding="utf-8")
    return file


def test_table_and_record_are_those_of_the_library(masrel: Caller, pairs: Path) -> None:
    call = ("agree", pairs, "--limits-of-agreement", "--unit", "deg")
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


def test_limits_come_with_coefficients_of_measurements(
    masrel: Caller, pairs: Path
) -> None:
    def names(*more: str) -> list[str]:
        call = ("agree", pairs, "--limits-of-agreement", "--json", "-", *more)
        document = json.loads(masrel(*call).out)
        return [estimate["coefficient"] for estimate in document["estimates"]]

    for target in ((), ("--target", "items"), ("--target", "both")):
        assert names(*target) == ["icc_a1", "lin_ccc"]
    assert names("--coefficients", "scott_pi") == ["scott_pi"]
    assert names("--metric", "interval") == ["krippendorff_alpha"]
    assert names("--weights", "linear") == ["percent_agreement", "fleiss_kappa"]
    concordance = json.loads(
        masrel("agree", pairs, "--limits-of-agreement", "--json", "-").out
    )["estimates"][1]
    assert concordance["value"] == lin_ccc(PAIRS).value
    assert concordance["interval"]["low"] == lin_ccc(PAIRS).interval.low


def test_measurements_are_warned_of_where_equal_numbers_are_counted(
    masrel: Caller, tmp_path: Path
) -> None:
    file = tmp_path / "angles.csv"
    rows = "".join(f"p{k},{k + 0.25},{k + 0.5}\n" for k in range(20))
    file.write_text("item,Kim,Lee\n" + rows, encoding="utf-8")
    warning = "40 different numbers in 40 ratings look like measurements"
    for call in ((), ("--coefficients", "icc_a1,scott_pi"), ("--metric", "nominal")):
        assert warning in masrel("agree", file, *call).out
    for call in (
        ("--limits-of-agreement",),
        ("--coefficients", "icc_a1"),
        ("--metric", "interval"),
        ("--weights", "quadratic"),
    ):
        assert warning not in masrel("agree", file, *call).out


def test_figure_has_the_limits_with_their_unit(masrel: Caller, pairs: Path) -> None:
    file = pairs.parent / "limits.svg"
    call = ("agree", pairs, "--limits-of-agreement", "--unit", "deg")
    done = masrel(*call, "--figure", file)
    assert done.code == 0
    assert f"figure: {file}" in done.err
    assert file.read_text("utf-8").startswith("<?xml")


def test_each_group_has_its_limits(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "clinics.csv"
    rows = "".join(
        f"{clinic},{clinic}{i},{a},{b}\n"
        for clinic in ("North", "South")
        for i, (a, b) in enumerate(PAIRS)
    )
    file.write_text("clinic,item,Kim,Lee\n" + rows, encoding="utf-8")
    call = ("agree", file, "--by", "clinic", "--limits-of-agreement", "--json", "-")
    records = json.loads(masrel(*call).out)["limits_of_agreement"]
    assert [record["clinic"] for record in records] == ["North", "South"]


def test_estimates_in_units_have_rows_and_sentences(
    masrel: Caller, pairs: Path
) -> None:
    call = ("agree", pairs, "--coefficients", "lin_ccc,sem,mdc_consistency")
    out = masrel(*call).out
    for title in ("Lin's concordance", "SEM", "MDC95, consistency"):
        assert title in out
    said = masrel(*call, "--sentence").out
    assert "SEM = 0." in said  # a number in units keeps its zero
    assert "Lin's concordance = ." in said


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
