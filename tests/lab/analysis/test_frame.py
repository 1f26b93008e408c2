"""Several estimates as a DataFrame: their fields by name, every digit kept."""

import dataclasses
import math
import subprocess
import sys

import pytest

from masrel.agreement import cohen_kappa, fleiss_kappa, icc
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval
from masrel.intervals import estimate
from masrel.lab.analysis import to_frame

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


def test_what_is_undefined_keeps_its_reason() -> None:
    with pytest.warns(match="undefined"):
        nothing = cohen_kappa([["a", "a"], ["a", "a"]])
    frame = to_frame(iter([nothing, icc([[1, 2], [3, 3], [5, 6]])]))
    assert math.isnan(frame["value"][0])
    assert frame["reason"][0].startswith("0/0")
    assert frame["target"][1] == "both"


def test_what_is_no_estimate_is_refused() -> None:
    kappa = fleiss_kappa(RATINGS)
    with pytest.raises(ParameterError, match="place 1: needs an Estimate, got float"):
        to_frame([kappa, kappa.value])  # type: ignore[list-item]


def test_pandas_is_loaded_only_when_asked_for() -> None:
    code = (
        "import sys\nfrom masrel.lab.analysis import to_frame\n"
        "before = 'pandas' in sys.modules\nto_frame([])\n"
        "print(before, 'pandas' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", "True"]
