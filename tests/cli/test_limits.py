"""masrel limits: repeats, lines, ratios and several observers of any file."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel import agree
from masrel.agreement import (
    limits_by_clusters,
    limits_with_mean,
    limits_with_repeats,
)
from masrel.errors import ParameterError
from masrel.ratings import Reading
from tests.cli.process import Caller

FILE = Path(__file__).parents[1] / "oracles" / "repeated_limits.json"
ZOU = pd.DataFrame(
    json.loads(FILE.read_text("utf-8"))["rows"], columns=["person", "x", "y"]
)
METHODS: Any = {"item": "person", "first": "x", "second": "y"}
# a row a measurement, in any order; those of y that were not made have no row
LONG = (
    ZOU.assign(time=ZOU.groupby("person").cumcount())
    .melt(["person", "time"], var_name="method", value_name="ml")
    .dropna()
    .sample(frac=1.0, random_state=1)
)
ROLES = ("--item", "person", "--rater", "method", "--grade", "ml", "--session", "time")


@pytest.fixture
def zou(tmp_path: Path) -> Path:
    file = tmp_path / "zou.csv"
    ZOU.to_csv(file, index=False)
    return file


def answers(masrel: Caller, name: str, *call: object) -> list[dict[str, Any]]:
    done = masrel("limits", *call, "--json", "-")
    assert done.code == 0, done.err
    return list(json.loads(done.out)[name])


@pytest.mark.parametrize("truth", ["constant", "varying"])
def test_a_wide_file_and_a_long_one_have_the_same_limits(
    masrel: Caller, tmp_path: Path, zou: Path, truth: Any
) -> None:
    LONG.to_csv(tmp_path / "long.csv", index=False)
    known = limits_with_repeats(ZOU, **METHODS, truth=truth)
    for call in ((zou,), (tmp_path / "long.csv", *ROLES)):
        (found,) = answers(masrel, "limits_with_repeats", *call, "--truth", truth)
        # of the long one either may come first
        bias = found["bias"] if found["first"] == "x" else -found["bias"]
        assert (bias, found["sd"]) == pytest.approx((known.bias, known.sd), rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "name", "sentence"),
    [
        ("proportional", "that_follow", "changes by 0.652 for each unit"),
        ("ratio", "of_ratios", "x is 1.119 times y on average"),
    ],
)
def test_kinds_of_limits_in_record_sentence_page_and_figure(
    masrel: Caller, tmp_path: Path, zou: Path, kind: Any, name: str, sentence: str
) -> None:
    page, figure = tmp_path / "m.html", tmp_path / "m.png"
    call = (zou, "--truth", "constant", "--kind", kind)
    known = limits_with_repeats(ZOU, **METHODS, kind=kind)
    (found,) = answers(masrel, f"limits_{name}", *call, "--html", page)
    assert (found["low"], found["slope"]) == (known.low, known.slope)
    assert found["high_interval"]["high"] == known.high_interval.high
    assert sentence in masrel("limits", *call, "--figure", figure).out
    assert "10.1177/0962280211402548" in page.read_text("utf-8")
    drawn = figure.read_bytes()
    masrel("limits", *call, "--figure", figure)
    assert figure.read_bytes() == drawn


def test_several_observers_and_groups(masrel: Caller, tmp_path: Path) -> None:
    values = np.random.default_rng(5).normal(50.0, 9.0, (12, 3)).round(1)
    frame = pd.DataFrame(values, columns=list("abc"))
    frame["item"], frame["site"] = [f"i{k}" for k in range(6)] * 2, "north"
    file, options = tmp_path / "three.csv", ("--item", "item", "--raters", "a,b,c")
    pd.concat([frame, frame.assign(site="south")]).to_csv(file, index=False)
    call = (file, *options, "--by", "site", "--truth", "constant")
    north, south = answers(masrel, "limits_with_mean", *call)
    known = limits_with_mean(frame, item="item", observers=["a", "b", "c"])
    assert north["limit"]["value"] == known.limit.value
    assert (south["site"], south["n_measurements"]) == ("south", 36)
    # without repeats ICC and Lin's concordance stand beside
    frame.head(6).to_csv(file, index=False)
    once = masrel("limits", file, *options, "--unit", "cm").out
    assert "ICC(A,1)" in once
    assert "cm of the mean of all raters" in once


def test_repeats_are_kept_for_limits_alone() -> None:
    with pytest.raises(ParameterError, match="--repeated each"):
        agree(ZOU, item="person", reading=Reading(repeated="each"))


def test_what_is_undefined_says_so(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "u.csv"
    file.write_text("item,a,b\nx,1,3\nx,2,\ny,,1\n")
    done = masrel("limits", file, "--truth", "constant", "--html", tmp_path / "u.html")
    assert (done.code, "The limits of agreement are undefined." in done.out) == (
        0,
        True,
    )


@pytest.mark.parametrize("kind", ["difference", "ratio"])
def test_clusters_are_left_out(masrel: Caller, tmp_path: Path, kind: Any) -> None:
    rng, file = np.random.default_rng(3), tmp_path / "eyes.csv"
    patient, level = np.arange(24) // 2, rng.normal(50.0, 9.0, 24)
    x = level + rng.normal(0.0, 2.0, 12)[patient] + rng.normal(size=24)
    frame = pd.DataFrame({"patient": patient, "x": x, "y": level + rng.normal(size=24)})
    frame["eye"] = [f"{p}{'LR'[k % 2]}" for k, p in enumerate(patient)]
    frame.to_csv(file, index=False)
    columns = ("--item", "eye", "--raters", "x,y", "--clusters", "patient")
    name = {"difference": "limits_with_repeats", "ratio": "limits_of_ratios"}[kind]
    of_kind = () if kind == "difference" else ("--kind", kind)
    (found,) = answers(masrel, name, file, *columns, *of_kind)
    measure = partial(limits_with_repeats, item="eye", first="x", second="y", kind=kind)
    known = limits_by_clusters(frame, measure, clusters="patient")
    for of in ("bias", "low", "high"):
        assert found[of] == pytest.approx(getattr(known, of))
        interval = getattr(known, f"{of}_interval")
        ends = found[f"{of}_interval"]
        assert (ends["low"], ends["high"]) == pytest.approx(
            (interval.low, interval.high)
        )
    # without clusters Lin's concordance has an error, which knows of none
    _, concordance = answers(masrel, "estimates", file, *columns)
    assert concordance["standard_error"] is None
    shown = masrel("limits", file, *columns, *of_kind, "--explain").out
    assert "leaving out one cluster at a time" in shown
    assert "MOVER" not in shown
