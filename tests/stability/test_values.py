"""Values and standard errors against exact ones, where floating point loses digits."""

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.errors import ParameterError
from tests.stability import drawn
from tests.stability.cases import CASES, METRICS, Case
from tests.stability.exactness import checked
from tests.stability.scenes import estimate, prepared


def parts(case: Case) -> list[tuple[str, str]]:
    """Pair the coefficients of a case with its weights."""
    return [
        (name, weights)
        for weights in case.weights
        for name in case.coefficients
        if weights not in METRICS or name == "krippendorff_alpha"
    ]


@pytest.mark.parametrize(
    ("case", "name", "weights"),
    [
        pytest.param(
            case,
            name,
            weights,
            id=f"{case.name}-{name}-{weights}",
            marks=[pytest.mark.slow] if case.slow else [],
        )
        for case in CASES
        for name, weights in parts(case)
    ],
)
def test_estimates_of_hard_tables_are_exact(
    case: Case, name: str, weights: str
) -> None:
    found = estimate(case, name, weights, prepared(case))
    assert checked(case, name, weights, found) == []


def wrong_with(case: Case, weights: Sequence[str]) -> list[str]:
    """Say what is wrong with any coefficient of a case."""
    ratings, wrong = prepared(case), []
    for name in case.coefficients:
        for of_name in weights:
            if of_name in METRICS and name != "krippendorff_alpha":
                continue
            try:
                found = estimate(case, name, of_name, ratings)
            except ParameterError:  # a scale on which a metric divides by 0
                assert of_name == "ratio metric"
                assert any(-x in case.scale for x in case.scale)
                continue
            for fault in checked(case, name, of_name, found):
                wrong.append(f"{name}, {of_name}: {fault}")
    return wrong


KINDS: dict[str, Callable[[], st.SearchStrategy[Case]]] = {
    "tables": drawn.tables,
    "tables near 0": drawn.tables_near_zero,
    "tables near 1": drawn.tables_near_one,
    "counts": drawn.counted,
    "ratings": drawn.rated,
}
kinds = pytest.mark.parametrize("kind", KINDS)


@kinds
@given(data=st.data())
def test_estimates_of_drawn_tables_are_exact(kind: str, data: st.DataObject) -> None:
    case = data.draw(KINDS[kind]())
    assert wrong_with(case, ["identity", data.draw(drawn.weights)]) == []


@pytest.mark.slow
@kinds
@settings(max_examples=1000)
@given(data=st.data())
def test_estimates_of_a_thousand_drawn_tables_are_exact(
    kind: str, data: st.DataObject
) -> None:
    case = data.draw(KINDS[kind]())
    assert wrong_with(case, ["identity", data.draw(drawn.weights)]) == []
