"""Results are plain values, though some are computed when they are read."""

import copy
import dataclasses
import math
import pickle

import pytest

from masrel.agreement import COEFFICIENTS, count_ratings, fleiss_kappa
from masrel.estimates import Estimate, OnDemand, as_document

RATINGS = [["a", "a", "b"], ["b", "b", "b"], ["a", "b", None]]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shown:
    """A field that takes a value or a call."""

    name: str
    number: OnDemand[float] = OnDemand()


def test_a_field_is_a_value_or_a_call_that_is_made_once() -> None:
    made = []

    def compute() -> float:
        made.append(1)
        return 0.5

    shown = Shown(name="late", number=compute)
    assert made == []
    assert (shown.number, shown.number, made) == (0.5, 0.5, [1])
    assert Shown(name="late", number=0.5) == shown
    assert repr(shown).endswith("Shown(name='late', number=0.5)")


def test_a_field_on_demand_has_no_default_and_stays_frozen() -> None:
    with pytest.raises(TypeError, match="number"):
        Shown(name="none")  # type: ignore[call-arg]
    with pytest.raises(dataclasses.FrozenInstanceError):
        Shown(name="late", number=0.5).number = 1.0  # type: ignore[misc]


def test_a_call_that_fails_is_made_again() -> None:
    shown = Shown(name="late", number=lambda: math.sqrt(-1))
    for _ in range(2):
        with pytest.raises(ValueError, match=r"domain|nonnegative"):
            assert shown.number


@pytest.mark.parametrize("read_first", [False, True])
@pytest.mark.parametrize(
    "name",
    [n for n, c in COEFFICIENTS.items() if c.shape == "ratings" and not c.n_raters[1]],
)
def test_an_estimate_can_be_copied_sent_and_replaced(
    name: str, read_first: bool
) -> None:
    ratings = [[1, 1, 2], [2, 2, 2], [1, 2, 1], [3, 3, 3]]
    found: Estimate = COEFFICIENTS[name](ratings, categories=[1, 2, 3])
    error = COEFFICIENTS[name](ratings, categories=[1, 2, 3]).standard_error
    if read_first:
        assert same(found.standard_error, error)
    for other in (
        pickle.loads(pickle.dumps(found)),
        copy.deepcopy(found),
        dataclasses.replace(found, reason=None),
    ):
        assert other.value == found.value
        assert same(other.standard_error, error)


def test_a_document_has_every_field_in_order() -> None:
    found = fleiss_kappa(RATINGS)
    document = as_document(found)
    assert list(document) == [field.name for field in dataclasses.fields(Estimate)]
    assert document["standard_error"] == found.standard_error


def test_counted_ratings_can_be_sent() -> None:
    counted = count_ratings([["a", "b"], ["b", "b"]])
    sent = pickle.loads(pickle.dumps(counted))
    assert fleiss_kappa(sent) == fleiss_kappa(counted)
    assert (sent.coded.codes == counted.coded.codes).all()


def same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))
