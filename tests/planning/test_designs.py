"""Twenty designs: what was planned comes true in studies that are drawn anew."""

import math
from typing import Any

import pytest

from docs.make.planning import DESIGNS, came_true, number_of
from masrel.planning import Study, sample_size


def holds(design: dict[str, Any], n_studies: int) -> None:
    """Compare within 2 %, or four Monte Carlo errors of both sides."""
    plan, name = sample_size(Study(**design)), number_of(design)
    numbers, errors = came_true(design, plan, n_studies)
    wanted = getattr(plan, name)
    both = math.hypot(errors[name], plan.monte_carlo_error)
    assert numbers[name] == pytest.approx(wanted, abs=max(4.0 * both, 0.02 * wanted))


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
