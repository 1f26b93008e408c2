"""masrel agree by its options: what is estimated, how it is shown, what is refused."""

import csv
import io
import json
from pathlib import Path
from typing import Any, get_args

import pytest
from scipy import stats

from masrel.agreement import (
    COEFFICIENTS,
    Metric,
    WeightName,
    fleiss_kappa,
    krippendorff_alpha,
)
from masrel.intervals import analytic
from tests.cli.process import Caller, Done

# Four patients by three raters, one gap.
WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
SCALE = ("1", "1+", "2", "3")
ROWS = [["1", "1+", "1"], ["2", None, "2"], ["1", "1", "2"], ["3", "3", "3"]]


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    path = tmp_path / "wide.csv"
    path.write_text(WIDE, encoding="utf-8")
    return path


def estimates(done: Done) -> list[dict[str, Any]]:
    """Read the document on stdout; it must be JSON to the letter, without nan."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    assert done.code == 0, done.err
    found: list[dict[str, Any]] = json.loads(done.out, parse_constant=refuse)[
        "estimates"
    ]
    return found


def refused(done: Done) -> str:
    """Check that a call was refused in words, and return them."""
    assert done.code == 2
    assert done.out == ""
    assert "Traceback" not in done.err
    return done.err


# What is estimated.


@pytest.mark.parametrize("weights", get_args(WeightName))
def test_weights_are_those_of_the_declared_scale(
    masrel: Caller, wide: Path, weights: WeightName
) -> None:
    names = ("fleiss_kappa", "gwet_ac", "krippendorff_alpha")
    call = ("--categories", ",".join(SCALE), "--weights", weights, "--json", "-")
    found = estimates(masrel("agree", wide, "--coefficients", ",".join(names), *call))
    for name, document in zip(names, found, strict=True):
        ours = COEFFICIENTS[name](ROWS, categories=SCALE, weights=weights)
        assert document["value"] == ours.value
        assert document["standard_error"] == ours.standard_error
        assert document["weights"] == weights


# How it is shown.


@pytest.mark.parametrize("more", [(), ("--target", "items"), ("--target", "raters")])
def test_csv_has_every_digit_of_the_json(
    masrel: Caller, wide: Path, more: tuple[str, ...]
) -> None:
    call = ("agree", wide, "--coefficients", "all", *more)
    rows = list(csv.DictReader(io.StringIO(masrel(*call, "--csv").out)))
    found = estimates(masrel(*call, "--json", "-"))
    assert len(rows) == len(found) > 12
    for row, document in zip(rows, found, strict=True):
        interval = document["interval"] or {"low": None, "high": None}
        for key, number in (
            ("value", document["value"]),
            ("standard_error", document["standard_error"]),
            ("low", interval["low"]),
            ("high", interval["high"]),
        ):
            assert row[key] == "" if number is None else float(row[key]) == number
        assert int(row["n_items"]) == document["n_items"]
        assert int(row["n_raters"]) == document["n_raters"]
        assert row["coefficient"].isprintable()


def test_json_in_a_file_leaves_the_table_on_stdout(
    masrel: Caller, wide: Path, tmp_path: Path
) -> None:
    path = tmp_path / "out.json"
    done = masrel("agree", wide, "--json", path, "--csv")
    assert done.out.startswith("coefficient,")
    both = masrel("agree", wide, "--json", "-")
    assert json.loads(path.read_text(encoding="utf-8")) == json.loads(both.out)


@pytest.mark.parametrize(
    ("convention", "law"), [("irrcac", "t"), ("spss", "normal"), ("over_n", "normal")]
)
def test_a_convention_has_the_error_and_the_interval_of_its_program(
    masrel: Caller, tmp_path: Path, convention: Any, law: Any
) -> None:
    pairs = [("a", "a")] * 10 + [("b", "b")] * 4 + [("a", "b")] * 6
    path = tmp_path / "pairs.csv"
    rows = "".join(f"{k},{a},{b}\n" for k, (a, b) in enumerate(pairs))
    path.write_text(f"item,Kim,Lee\n{rows}", encoding="utf-8")
    names = ("--coefficients", "cohen_kappa,fleiss_kappa", "--level", "0.8")
    done = masrel("agree", path, *names, "--convention", convention, "--json", "-")
    for row in estimates(done):
        expected = analytic(
            row["coefficient"],
            pairs,
            target="items",
            level=0.8,
            convention=convention,
            distribution=law,
        )
        half = 0.5 * (expected.high - expected.low)
        assert row["interval"]["low"] == expected.low
        quantile = stats.t.ppf(0.9, 19 if law == "t" else 1e12)
        assert row["standard_error"] == pytest.approx(half / quantile, rel=1e-9)
        assert row["interval"]["method"] == expected.method
    assert json.loads(done.out)["options"]["convention"] == convention


# Metrics of alpha.


def test_a_metric_is_of_alpha(masrel: Caller, tmp_path: Path) -> None:
    path = tmp_path / "two.csv"
    path.write_text("item,A,B\nx,1,1\ny,2,1\nz,4,4\nu,2,3\n", encoding="utf-8")
    rows = [[1, 1], [2, 1], [4, 4], [2, 3]]
    metrics: list[Metric] = ["nominal", "ordinal", "interval", "ratio"]
    for metric in metrics:
        call = ("agree", path, "--metric", metric, "--json", "-")
        done = masrel(*call)
        (of_alpha,) = estimates(done)
        alpha = krippendorff_alpha(rows, metric=metric)
        assert (of_alpha["value"], of_alpha["weights"]) == (alpha.value, alpha.weights)
        assert json.loads(done.out)["options"]["metric"] == metric
    done = masrel("agree", path, "--metric", "interval", "--target", "items")
    assert "Krippendorff's α, interval metric" in done.out
    said = refused(masrel(*call[:4], "--coefficients", "fleiss_kappa,gwet_ac"))
    assert "--metric ratio: is of krippendorff_alpha, which is not among" in said


@pytest.mark.parametrize(
    "text",
    [
        "1,.75,.25,0\n.75,1,.5,0\n.25,.5,1,.5\n0,0,.5,1\n",
        # in another order, with commas as decimal marks
        "grade;2;1;3;1+\n1;0,25;1;0;0,75\n3;0,5;0;1;0\n1+;0,5;0,75;0;1\n"
        "2;1;0,25;0,5;0,5\n",
    ],
)
def test_weights_of_a_file_are_those_of_a_matrix(
    masrel: Caller, wide: Path, tmp_path: Path, text: str
) -> None:
    (tmp_path / "w.csv").write_text(text, encoding="utf-8")
    options = ("--categories", ",".join(SCALE), "--weights", tmp_path / "w.csv")
    done = masrel("agree", wide, *options, "--json", "-")
    matrix = [
        [1, 0.75, 0.25, 0],
        [0.75, 1, 0.5, 0],
        [0.25, 0.5, 1, 0.5],
        [0, 0, 0.5, 1],
    ]
    kappa = fleiss_kappa(ROWS, categories=SCALE, weights=matrix)
    (_, of_kappa) = estimates(done)
    assert of_kappa["value"] == pytest.approx(kappa.value, abs=1e-14)
    assert of_kappa["standard_error"] == pytest.approx(kappa.standard_error, abs=1e-14)
    assert of_kappa["weights"] == "w.csv"
    assert json.loads(done.out)["options"]["weight_matrix"] == matrix
