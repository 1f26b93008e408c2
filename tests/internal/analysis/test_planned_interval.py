"""The interval of a line of the plan: one of five kinds, or none."""

from typing import Any

import pytest

from masrel.analysis import _plan, analyze
from masrel.analysis._planned_interval import planned_interval
from masrel.errors import ParameterError
from tests.analysis.studies import plan, protocol_with, table_v


def test_an_unknown_interval_is_refused() -> None:
    with pytest.raises(ParameterError, match="'guess'"):
        planned_interval(
            "guess",
            "fleiss_kappa",
            [["1", "1"]],
            target="items",
            categories=("1", "2"),
            level=0.95,
            n_resamples=10,
            seed=1,
        )


def test_every_line_has_a_seed_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = []

    def record(*_: Any, seed: int, **__: Any) -> None:
        seeds.append(seed)

    monkeypatch.setattr(_plan, "planned_interval", record)
    first, second = plan(id="a"), plan(id="b")
    analyze(protocol_with(first, second), table_v())
    analyze(protocol_with(second), table_v())
    assert seeds[0] != seeds[1]
    assert seeds[1] == seeds[2]
    # fits a signed integer of 64 bits, as other readers of the JSON have them
    assert all(0 <= seed < 2**63 for seed in seeds)
