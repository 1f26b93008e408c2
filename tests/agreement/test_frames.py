"""Frames that a coefficient would misread are refused with the call that is right."""

import re
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest

import masrel
from masrel.agreement import code_long, fleiss_kappa, icc
from masrel.errors import RatingsError

KIM, LEE, ANN = [1, 1, 2, 2, 3, 3], [1, 1, 2, 3, 3, 3], [1, 2, 2, 2, 3, 3]
RATERS = {"Kim": KIM, "Lee": LEE}
SIX, TEXTS = [*range(1, 7)], ["p1", "p2", "p3", "p4", "p5", "p6"]
PAIRS = np.repeat(["d1", "d2", "d3"], 2)
TWO = ["Kim", "Lee"] * 3

ITEMS = {
    "item": {"item": SIX, **RATERS},
    "text": {"item": TEXTS, **RATERS},
    "spelling": {"Subject ID": SIX, **RATERS},
    "last": {**RATERS, "id": SIX},
    "of floats": {"item": [float(n) for n in SIX], **RATERS},
    "another name": {"code": TEXTS, **RATERS},
    "one rater": {"item": TEXTS, "Kim": KIM},
    "grades of text": {"patient": TEXTS, "Kim": list("xxyyzz"), "Lee": list("xxyzzz")},
}
LONG = {
    "names": ({"item": PAIRS, "rater": TWO, "grade": KIM}, "item rater grade"),
    "other names": (
        {"subject": PAIRS, "annotator": TWO, "score": KIM},
        "subject annotator score",
    ),
    "numbers": (
        {"grade": KIM, "rater": [1, 2] * 3, "item": np.repeat([1, 2, 3], 2)},
        "item rater grade",
    ),
    "one unknown": (
        {"doc": PAIRS, "rater": TWO, "label": list("xyxxyy")},
        "… rater label",
    ),
    "one unknown number": (
        {"subject": np.repeat([1, 2, 3], 2), "coder": [1, 2] * 3, "verdict": KIM},
        "subject coder …",
    ),
    "unknown": ({"doc": PAIRS, "who": TWO, "verdict": KIM}, "… … …"),
    "unknown text": ({"doc": PAIRS, "who": TWO, "verdict": list("xyxxyy")}, "… … …"),
    "more columns": (
        {"site": list("NNNSSS"), "item": PAIRS, "rater": TWO, "score": KIM},
        "item rater score",
    ),
}  # fmt: skip


@pytest.mark.parametrize("library", [pd.DataFrame, pl.DataFrame])
@pytest.mark.parametrize("case", ITEMS)
def test_a_column_of_items_is_refused(case: str, library: Any) -> None:
    frame, (name, *_) = pd.DataFrame(ITEMS[case]), ITEMS[case]
    name = "id" if case == "last" else name
    with pytest.raises(RatingsError, match=re.escape(f"agree(frame, item={name!r})")):
        fleiss_kappa(library(ITEMS[case]))
    if len(frame.columns) > 2:  # and what it suggests is right
        kappa = fleiss_kappa(frame.set_index(name)).value
        assert masrel.agree(frame, item=name).estimates[1].value == kappa


@pytest.mark.parametrize("library", [pd.DataFrame, pl.DataFrame])
@pytest.mark.parametrize("case", LONG)
def test_a_row_a_rating_is_refused(case: str, library: Any) -> None:
    data, names = LONG[case]
    roles = dict(zip(("item", "rater", "grade"), names.split(), strict=True))
    call = ", ".join(f"{k}={v if v == '…' else repr(v)}" for k, v in roles.items())
    with pytest.raises(RatingsError) as refused:
        fleiss_kappa(library(data))
    assert f"masrel.agree(frame, {call})" in str(refused.value)
    assert f"code_long(frame, {call})" in str(refused.value)
    if "…" not in names:  # and what it suggests is right
        frame = pd.DataFrame(data)
        kappa = fleiss_kappa(code_long(frame, **roles)).value  # type: ignore[arg-type]
        assert masrel.agree(frame, **roles).estimates[1].value == kappa  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "data",
    [
        RATERS,
        {1: KIM, 2: LEE, 3: ANN},
        {"rater": KIM, "rater 2": LEE},
        {"rater 1": list("xxyyzz"), "rater 2": list("xxyzzz")},
        {"label": KIM, "judge": LEE},
        {"model": KIM, "judge": LEE, "human": ANN},
        {"model": list("xxyyxy"), "reviewer": list("xxyxxy"), "author": list("xyyyxy")},
        {"item": KIM, "Kim": LEE},  # the items of no table
        {"model": SIX, "human": [2, 1, 3, 4, 6, 5]},
        {"model": [0.11, 0.52, 0.33, 0.74, 0.95, 0.16], "human": KIM},
        {"subject": [0.5, 1.5, 2.5], "observer": [0.6, 1.4, 2.5], "lab": [0.5, 1.6, 2]},
        {"Kim": ["a", None, "b"], "Lee": [None, "a", "b"]},
        {"one": ["a"], "two": ["b"], "three": ["c"]},
    ],
)  # fmt: skip
def test_frames_of_raters_rate_as_before(data: dict[Any, Any]) -> None:
    coefficient: Any = icc if isinstance(next(iter(data.values()))[0], float) else None
    coefficient = coefficient or fleiss_kappa
    frame = pd.DataFrame(data)
    assert coefficient(frame) == coefficient(frame.to_numpy().tolist())
    assert coefficient(pl.DataFrame({str(k): v for k, v in data.items()})).n_items


def test_names_may_be_overruled() -> None:
    frame = pd.DataFrame(LONG["numbers"][0])
    assert fleiss_kappa(frame.to_numpy()).n_raters == 3
