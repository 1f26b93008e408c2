"""Twenty designs: what was planned comes true in studies that are drawn anew."""

import math
from typing import Any

import pytest

from docs.make.planning import DESIGNS, came_true, number_of, planned
from masrel.planning import sample_size


def holds(design: dict[str, Any], n_studies: int) -> None:
    """Compare within 2 %, or four Monte Carlo errors of both sides."""
    plan = sample_size(**design)
    sums = came_true(design, plan, n_studies)
    number, wanted = number_of(design, sums), planned(design, plan)
    error = (
        math.sqrt(number * (1.0 - number) / n_studies)
        if plan.power > 0.0 or "assurance" in design
        else sums.mean(0)[1]
    )
    both = math.hypot(error, plan.monte_carlo_error)
    assert number == pytest.approx(wanted, abs=max(4.0 * both, 0.02 * wanted))


@pytest.mark.long
@pytest.mark.parametrize("design", DESIGNS)
def test_what_was_planned_comes_true_in_a_hundred_thousand_studies(
    design: dict[str, Any],
) -> None:
    holds(design, 100_000)


@pytest.mark.slow
@pytest.mark.parametrize("design", [DESIGNS[k] for k in (0, 5, 8, 14)])
def test_what_was_planned_comes_true(design: dict[str, Any]) -> None:
    holds(design, 10_000)
