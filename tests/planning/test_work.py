"""Work is counted: kernels once a block of studies, an interval once a distinct one."""

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

import masrel.planning._studies as studies
from masrel.planning._item_models import ItemModel


def maker(**options: Any) -> studies.StudyMaker:
    design = {
        "coefficient": "fleiss_kappa",
        "weights": "identity",
        "model": ItemModel(name="mixture", prevalences=(0.7, 0.3), kappa=0.5),
        "n_items": 30,
        "n_raters": 5,
        "target": "items",
        "level": 0.95,
        "interval": "t",
        "value": 0.5,
        **options,
    }
    return studies.StudyMaker(studies.StudyDesign(**design))


def test_a_thousand_times_the_studies_call_the_kernel_as_often_a_block(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: Counter[int] = Counter()
    values = studies.StudyMaker._values

    def counted(self: studies.StudyMaker, sums: studies.Floats) -> studies.Floats:
        calls["kernel"] += 1
        return values(self, sums)

    monkeypatch.setattr(studies.StudyMaker, "_values", counted)
    of_size = []
    for n_studies in (10, 10_000):
        calls.clear()
        maker().simulate(np.random.default_rng(1), n_studies)
        of_size.append(calls["kernel"])
    assert of_size == [1, 1]


def test_an_interval_is_chosen_once_for_each_distinct_study(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: Counter[bytes] = Counter()
    interval = studies.StudyMaker._interval

    def counted(self: studies.StudyMaker, rows: Any, freq: Any) -> Any:
        calls[rows.tobytes() + freq.tobytes()] += 1
        return interval(self, rows, freq)

    monkeypatch.setattr(studies.StudyMaker, "_interval", counted)
    of_two = maker(n_items=6, n_raters=2, interval="auto")
    sums = of_two.simulate(np.random.default_rng(1), 2_000)
    assert sums.weight == 2_000
    assert len(calls) <= 28  # ways in which six items fall into three cells
    assert set(calls.values()) == {1}


@pytest.mark.parametrize("n_cells", [1, 2, 3, 4])
def test_all_tables_are_listed_once(n_cells: int) -> None:

    tables = np.concatenate(list(studies._tables(7, n_cells)))
    assert len(np.unique(tables, axis=0)) == len(tables)
    assert len(tables) == math.comb(7 + n_cells - 1, n_cells - 1)
    assert (tables.sum(axis=1) == 7).all()


def test_memory_is_that_of_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []
    of_freq = studies.StudyMaker._of_freq

    def seen(self: studies.StudyMaker, freq: Any) -> Any:
        sizes.append(freq.size)
        return of_freq(self, freq)

    monkeypatch.setattr(studies.StudyMaker, "_of_freq", seen)
    monkeypatch.setattr(studies, "_PLACES", 1 << 12)
    maker().simulate(np.random.default_rng(1), 5_000)
    assert max(sizes) <= 1 << 13
    assert sum(sizes) == 5_000 * 6
