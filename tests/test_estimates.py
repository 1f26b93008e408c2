"""Results are plain values."""

import copy
import dataclasses
import math
import pickle

import pytest

from masrel.agreement import COEFFICIENTS, count_ratings, fleiss_kappa
from masrel.estimates import Estimate, as_document

RATINGS = [["a", "a", "b"], ["b", "b", "b"], ["a", "b", None]]


@pytest.mark.parametrize(
    "name",
    [n for n, c in COEFFICIENTS.items() if c.shape == "ratings" and not c.n_raters[1]],
)
def test_an_estimate_can_be_copied_sent_and_replaced(name: str) -> None:
    ratings = [[1, 1, 2], [2, 2, 2], [1, 2, 1], [3, 3, 3]]
    found: Estimate = COEFFICIENTS[name](ratings, categories=[1, 2, 3])
    for other in (
        pickle.loads(pickle.dumps(found)),
        copy.deepcopy(found),
        dataclasses.replace(found, reason=None),
    ):
        assert other.value == found.value
        assert same(other.standard_error, found.standard_error)


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
