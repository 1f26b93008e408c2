"""Values and standard errors against exact ones, where floating point loses digits."""

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.errors import ParameterError
from tests.accuracy import drawn
from tests.accuracy.cases import CASES, METRICS, Case
from tests.accuracy.exactness import checked
from tests.accuracy.scenes import estimate, prepared


def wrong_with(case: Case, weights: Sequence[str]) -> list[str]:
    """Say what is wrong with any coefficient of a case."""
    ratings, wrong = prepared(case), []
    for name in case.coefficients:
        for of_name in weights:
            if of_name in METRICS and name != "krippendorff_alpha":
                continue
            try:
                found = estimate(name, of_name, ratings)
            except ParameterError:  # a scale on which a metric divides by 0
                assert of_name == "ratio metric"
                assert any(-x in case.scale for x in case.scale)
                continue
            for fault in checked(case, name, of_name, found):
                wrong.append(f"{name}, {of_name}: {fault}")
    return wrong


@pytest.mark.parametrize(
    ("case", "weights"),
    [
        pytest.param(
            case,
            weights,
            id=f"{case.name}-{weights}",
            marks=pytest.mark.long if case.long else pytest.mark.slow,
        )
        for case in CASES
        for weights in case.weights
    ],
)
def test_estimates_of_hard_tables_are_exact(case: Case, weights: str) -> None:
    assert wrong_with(case, [weights]) == []


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


@pytest.mark.long  # the test before draws 50
@kinds
@settings(max_examples=1000)
@given(data=st.data())
def test_estimates_of_a_thousand_drawn_tables_are_exact(
    kind: str, data: st.DataObject
) -> None:
    case = data.draw(KINDS[kind]())
    assert wrong_with(case, ["identity", data.draw(drawn.weights)]) == []
