"""Judges beside people: whether a model rates as well as the humans it would replace.

In: grades of humans and of a judge, which may be a language model. Out: whether the
judge may stand for a human, rates corrected for its errors, and who is probably right.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

if TYPE_CHECKING:
    from masrel.judges._paired import ScoreTest, score_test
    from masrel.judges.rates import (
        RateEstimate,
        RateEstimates,
        corrected_rate,
        label_allocation,
        labels_needed,
        prediction_powered_mean,
        rate_estimates,
    )

__all__ = [
    "RateEstimate",
    "RateEstimates",
    "ScoreTest",
    "corrected_rate",
    "label_allocation",
    "labels_needed",
    "prediction_powered_mean",
    "rate_estimates",
    "score_test",
]

_HOMES = {
    "RateEstimate": "rates",
    "RateEstimates": "rates",
    "ScoreTest": "_paired",
    "corrected_rate": "rates",
    "label_allocation": "rates",
    "labels_needed": "rates",
    "prediction_powered_mean": "rates",
    "rate_estimates": "rates",
    "score_test": "_paired",
}


# these load numpy and the coefficients
__getattr__ = loaded_from(__name__, _HOMES)
