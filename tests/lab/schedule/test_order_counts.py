"""The counts of docs/orders.md are those of 200 schedules of every scheme."""

import itertools
import re
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from masrel.lab.schedule import draw_schedule
from tests.lab.schedule.studies import SECRET, protocol_of

PAGE = (Path(__file__).parents[3] / "docs" / "orders.md").read_text(encoding="utf-8")
MODELS = tuple(f"M{number:02d}" for number in range(16))
STANDARDS = MODELS[:4]
RATERS = tuple(f"R{number}" for number in range(200))

SCHEMES: dict[str, dict[str, Any]] = {
    "`random-order`": {},
    "`williams`": {"scheme": "williams"},
    "`latin-square`": {"scheme": "latin-square"},
    "`blocks`, by repeat": {"scheme": "blocks"},
    "`blocks`, by role": {"scheme": "blocks", "blocks_by": "role"},
    "`no-immediate-repeat`": {"scheme": "no-immediate-repeat"},
    "`restricted`, `standards_apart = true`": {
        "scheme": "restricted",
        "standards_apart": True,
    },
    "`restricted`, `max_same_grade = 1`": {
        "scheme": "restricted",
        "max_same_grade": 1,
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCHEMES)
def test_a_row_of_the_page_is_counted(name: str) -> None:
    protocol = protocol_of(
        models=MODELS,
        dummies=MODELS[4:],
        grades=dict(zip(STANDARDS, ("1", "1+", "2", "3"), strict=True)),
        raters=RATERS,
        repeats=5,
        **SCHEMES[name],
    )
    has_rows = name in ("`williams`", "`latin-square`")
    twice = standards = 0
    places: Counter[tuple[int, str]] = Counter()
    pairs: Counter[tuple[str, str]] = Counter()
    for row, rater in enumerate(RATERS, start=1):
        drawn = draw_schedule(
            protocol, rater, "test", secret=SECRET, row=row if has_rows else None
        )
        order = [shown.model for shown in drawn.presentations]
        neighbours = list(itertools.pairwise(order))
        twice += any(a == b for a, b in neighbours)
        standards += any({a, b} <= set(STANDARDS) for a, b in neighbours)
        places.update(enumerate(order))
        pairs.update(neighbours)
    in_place = [places[place, model] for place in range(80) for model in MODELS]
    of_pair = [pairs[pair] for pair in itertools.permutations(MODELS, 2)]
    counted = (
        f"| {name} | {twice} | {standards} | {min(in_place)} to {max(in_place)} | "
        f"{min(of_pair)} to {max(of_pair)} |"
    )
    assert re.findall(rf"^\| {re.escape(name)} \| \d.*$", PAGE, re.M) == [counted]
