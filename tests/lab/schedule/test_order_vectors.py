"""Test vectors of docs/reference/orders.md, some derived from its rules alone."""

import hmac
import itertools
import re
from collections.abc import Iterator
from math import comb, factorial
from pathlib import Path
from typing import Any

import pytest

from masrel.lab.schedule.presentation import draw_schedule
from tests.lab.schedule.studies import SECRET, protocol_of, words_from

PAGE = (Path(__file__).parents[3] / "docs/reference/orders.md").read_text("utf-8")
MODELS = ("HM1", "HM2", "HM3", "HM4", "D01", "D02", "D03", "D04")

RULES: dict[str, dict[str, Any]] = {
    "`williams`, row 1": {"scheme": "williams"},
    "`williams`, row 2": {"scheme": "williams"},
    "`latin-square`, row 1": {"scheme": "latin-square"},
    "`blocks` by repeat, twice each": {"scheme": "blocks", "repeats": 2},
    "`blocks` by role": {"scheme": "blocks", "blocks_by": "role"},
    "`no-immediate-repeat`, twice each": {
        "scheme": "no-immediate-repeat",
        "repeats": 2,
    },
    "`restricted`, `standards_apart`": {
        "scheme": "restricted",
        "standards_apart": True,
    },
    "`restricted`, `max_same_grade = 1`, twice each": {
        "scheme": "restricted",
        "max_same_grade": 1,
        "repeats": 2,
    },
}


def drawn(name: str) -> str:
    protocol = protocol_of(
        models=MODELS,
        dummies=MODELS[4:],
        grades={"HM1": "1", "HM2": "1", "HM3": "2", "HM4": "3"},
        seed=2012,
        **RULES[name],
    )
    row = re.search(r"row (\d)", name)
    schedule = draw_schedule(
        protocol, "R1", "test", secret=SECRET, row=int(row[1]) if row else None
    )
    return " ".join(shown.model for shown in schedule.presentations)


@pytest.mark.parametrize("name", RULES)
def test_the_page_has_what_is_drawn(name: str) -> None:
    rows = re.findall(rf"^\| {re.escape(name)} \| \d* ?\| (.*) \|$", PAGE, re.MULTILINE)
    assert rows == [drawn(name)]


def words(*purpose: str) -> Iterator[int]:
    names = ",".join(f'"{part}"' for part in purpose)
    digest = hmac.new(SECRET, f'["masrel",2012,{names}]'.encode(), "sha256")
    return words_from(digest.hexdigest())


def shuffled(items: list[Any], stream: Iterator[int]) -> list[Any]:
    """The documented shuffle; no word is rejected, with chances below 1e-17."""
    for i in range(len(items) - 1, 0, -1):
        j = next(stream) % (i + 1)
        items[i], items[j] = items[j], items[i]
    return items


def test_a_williams_design_is_what_its_rule_gives_by_hand() -> None:
    stream = words("design", "test", "", "1")
    models = shuffled(list(MODELS), stream)
    first = [0, 1, 7, 2, 6, 3, 5, 4]
    lines = shuffled([[(i + s) % 8 for s in first] for i in range(8)], stream)
    for row in (1, 2):
        by_hand = " ".join(models[symbol] for symbol in lines[row - 1])
        assert drawn(f"`williams`, row {row}") == by_hand


def test_standards_apart_are_what_the_rule_gives_by_hand() -> None:
    n_orders = comb(5, 4) * factorial(4) * factorial(4)
    assert n_orders == 2880
    x = next(words("schedule", "test", "R1")) % n_orders

    def arranged(models: tuple[str, ...], x: int) -> tuple[list[str], int]:
        order, left = [""] * 4, [0, 1, 2, 3]
        for model in reversed(models):
            x, place = divmod(x, len(left))
            order[left.pop(place)] = model
        return order, x

    standards, x = arranged(MODELS[:4], x)
    dummies, x = arranged(MODELS[4:], x)
    gaps = list(itertools.combinations(range(5), 4))[x]
    by_hand = []
    for gap in range(5):
        by_hand += [standards.pop(0)] if gap in gaps else []
        by_hand += [dummies.pop(0)] if dummies else []
    assert drawn("`restricted`, `standards_apart`") == " ".join(by_hand)
