"""The published study: Table V and what the paper says of it, worked by hand.

Table V (raters R1 to R8 across):

    HM1, built as grade 1:   1  1  1  1+ 1  1  1  1      7 x 1, 1 x 1+
    HM2, built as grade 1+:  1+ 1+ 1+ 1+ 1+ 1  1+ 1      6 x 1+, 2 x 1
    HM3, built as grade 2:   2  2  2  2  2  2  2  2      8 x 2
    HM4, built as grade 3:   3  2  3  3  3  2  3  3      6 x 3, 2 x 2
"""

import math
from fractions import Fraction

import pytest

from masrel.lab.analysis import Analysis, analyze
from tests.lab.analysis.studies import (
    in_person,
    plan,
    protocol_with,
    table_v,
)

KAPPA = 0.626083678854127


def published(*lines: object, sections: tuple[str, ...] = ()) -> Analysis:
    return analyze(
        protocol_with(*lines, sections=sections), table_v(), in_person=in_person()
    )


def test_the_kappa_is_the_papers() -> None:
    # Pairs of 28 that agree: 21 + (15 + 1) + 28 + (15 + 1) = 81, of 112. Shares of the
    # 32 grades: 9 (1), 7 (1+), 10 (2), 6 (3): by chance (81 + 49 + 100 + 36) / 1024.
    observed, chance = Fraction(81, 112), Fraction(266, 1024)
    by_hand = (observed - chance) / (1 - chance)
    (found,) = published(plan()).estimates
    assert found.estimate is not None
    assert found.estimate.value == pytest.approx(float(by_hand), abs=1e-14)
    assert found.estimate.value == pytest.approx(KAPPA, abs=1e-15)
    assert round(found.estimate.value, 3) == 0.626  # section IV.A of the paper
    assert (found.estimate.observed, found.estimate.chance) == (
        float(observed),
        float(chance),
    )
    assert found.estimate.n_categories == 6  # 0 and 4 are of the scale, though unused
    assert found.items == ("HM1", "HM2", "HM3", "HM4")
    assert found.raters == tuple(f"R{n}" for n in range(1, 9))
    assert (found.n_missing, found.reason) == (0, None)


def test_the_intended_grade_was_given_as_the_paper_says() -> None:
    # 7, 6, 8 and 6 of 8 raters. Mean (87.5 + 75 + 100 + 75) / 4 = 84.375; deviations
    # 3.125, -9.375, 15.625, -9.375; squares 9.765625 + 87.890625 + 244.140625 +
    # 87.890625 = 429.6875; over n - 1 = 3 that is 143.2292, its root 11.9678.
    found = published(sections=("intended",)).intended
    assert found is not None
    assert [row.percent for row in found.models] == [87.5, 75.0, 100.0, 75.0]
    assert [row.n_agree for row in found.models] == [7, 6, 8, 6]
    assert {row.n_ratings for row in found.models} == {8}
    assert found.mean == 84.375
    assert found.sd == pytest.approx(math.sqrt(429.6875 / 3), abs=1e-12)
    assert round(found.sd, 2) == 11.97
    assert (found.session, found.reason) == ("test", None)
