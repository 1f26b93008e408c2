"""Tests of preferences: bias by hand, strengths in closed form and by logit."""

import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from scipy.special import expit

from masrel.errors import SmallSampleWarning, UndefinedStatisticWarning
from masrel.judges import bradley_terry, position_bias, score_test

Rows = list[tuple[int, str, str, str]]

# verdicts with a first, and with b first, and how many pairs have them
PAIRS = {
    ("a", "a"): 8,
    ("a", "tie"): 3,
    ("a", "b"): 4,  # the first position gains
    ("tie", "tie"): 2,
    ("b", "a"): 1,  # the second
    ("tie", "a"): 1,
    ("b", "b"): 6,
}


def both_orders() -> Rows:
    rows: Rows = []
    for (one, other), often in PAIRS.items():
        for _ in range(often):
            item = len(rows)
            rows += [(item, "a", "b", one), (item, "b", "a", other)]
    return rows


def test_position_bias_by_hand() -> None:
    bias = position_bias(both_orders())
    assert bias.table.tolist() == [[8, 3, 4], [1, 2, 0], [1, 0, 6]]
    assert bias.value == pytest.approx((7 - 2) / 25)
    assert bias.agreement == pytest.approx(16 / 25)
    assert bias.agreement_without_ties == pytest.approx(14 / 19)
    assert (bias.n_pairs, bias.n_ties, bias.n_unpaired) == (25, 6, 0)
    # 2 of 9 changes: 2 (1 + 9 + 36)/2⁹
    assert bias.mcnemar.p_value == pytest.approx(92 / 512)
    interval = score_test(7, 2, 25)
    assert (bias.low, bias.high) == (interval.low, interval.high)


def test_names_and_the_order_of_rows_do_not_move_the_bias() -> None:
    rows = both_orders()
    name = {"a": "z", "b": "y", "tie": "both"}
    renamed = [(i, name[a], name[b], name[w]) for i, a, b, w in reversed(rows)]
    frame = pd.DataFrame(renamed, columns=["item", "first", "second", "winner"])
    other = position_bias(frame, tie="both")
    bias = position_bias(rows)
    assert (other.value, other.low, other.high) == (bias.value, bias.low, bias.high)
    assert other.mcnemar == bias.mcnemar


def test_whoever_always_takes_the_first_has_a_bias_of_one() -> None:
    rows = [(i, a, b, a) for i in range(20) for a, b in (("x", "y"), ("y", "x"))]
    rows.append((20, "x", "y", "y"))
    bias = position_bias(rows)
    assert bias.value == 1.0
    assert bias.n_unpaired == 1


def test_pairs_that_share_items_are_said() -> None:
    rows = [(1, *pair) for pair in ("abb", "baa", "acc", "caa")]
    with pytest.warns(UndefinedStatisticWarning):
        assert position_bias([*rows[:1], (1, "b", "a", "b")]).notes == ()
    assert "independent" in position_bias(rows).notes[0]


# -- Bradley-Terry ---------------------------------------------------------------------


def tournament(seed: int, strengths: list[float], n_items: int) -> Rows:
    rng = np.random.default_rng(seed)
    rows: Rows = []
    for item in range(n_items):
        a, b = rng.choice(len(strengths), 2, replace=False)
        wins = rng.random() < expit(strengths[a] - strengths[b])
        rows.append((item, f"m{a}", f"m{b}", f"m{a if wins else b}"))
    return rows


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
@pytest.mark.parametrize(
    ("wins", "losses", "ties"), [(3, 1, 0), (20, 10, 6), (1, 1, 4)]
)
def test_two_models_have_a_closed_form(wins: int, losses: int, ties: int) -> None:
    winners = ["a"] * wins + ["b"] * losses + ["tie"] * ties
    rows = [(i, "a", "b", winner) for i, winner in enumerate(winners)]
    result = bradley_terry(rows)
    log_odds = math.log((wins + ties / 2) / (losses + ties / 2))
    assert result.strengths == pytest.approx([log_odds / 2, -log_odds / 2])
    assert result.n_comparisons == wins + losses + ties
    assert result.n_ties == ties


def test_strengths_and_errors_are_those_of_a_logit() -> None:
    rows = tournament(1, [0.0, 0.5, 1.0, -0.5], 300)
    result = bradley_terry(rows)
    columns = list(result.models)
    design = np.zeros((len(rows), len(columns)))
    for place, (_, a, b, _) in enumerate(rows):
        design[place, columns.index(a)], design[place, columns.index(b)] = 1, -1
    won = [float(a == winner) for _, a, _, winner in rows]
    fit = sm.Logit(won, design[:, 1:]).fit(disp=0, cov_type="HC0")  # the first is 0
    contrasts = result.strengths[1:] - result.strengths[0]
    assert contrasts == pytest.approx(fit.params, abs=1e-7)
    apart = np.hstack([-np.ones((3, 1)), np.eye(3)])
    variance = apart @ result.covariance @ apart.T
    expected = fit.cov_params() * len(rows) / (len(rows) - 1)
    assert variance == pytest.approx(expected, abs=1e-8)


def test_both_orders_of_a_pair_are_one_item() -> None:
    rows = tournament(2, [0.0, 0.4, 0.8], 60)
    swapped = [(i, b, a, w) for i, a, b, w in rows]
    once, twice = bradley_terry(rows), bradley_terry(rows + swapped)
    assert twice.strengths == pytest.approx(once.strengths)
    assert twice.low == pytest.approx(once.low)
    assert twice.n_items == once.n_items


def test_strengths_are_recovered() -> None:
    # 2000 comparisons of 5 models: a standard error of some .06; one of five is off by
    # more than 5 of them in 3e-6 of such tests
    truth = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    result = bradley_terry(tournament(3, truth.tolist(), 2000))
    order = np.argsort(np.array(result.models))
    assert np.abs(result.strengths[order] - truth).max() < 0.3
    assert result.strengths.sum() == pytest.approx(0.0, abs=1e-9)


def test_a_model_that_never_loses_has_no_finite_strength() -> None:
    rows = [*tournament(4, [0.0, 0.3, 0.6], 60), (99, "m0", "best", "best")]
    with pytest.warns(UndefinedStatisticWarning, match="'best'"):
        result = bradley_terry(rows)
    assert result.reason is not None
    assert np.isnan(result.strengths).all()
    assert np.isnan(result.covariance).all()


def test_models_that_never_meet_cannot_be_compared() -> None:
    pairs = ["abb", "baa", "xyx", "yxy"]
    rows = [(i, *pair) for i, pair in enumerate(pairs)]
    with (
        pytest.warns(UndefinedStatisticWarning, match=r"'a', 'b'|'b', 'a'"),
        pytest.warns(SmallSampleWarning),
    ):
        bradley_terry(rows)


@pytest.mark.slow
def test_intervals_of_strengths_cover() -> None:
    # of 300 studies, if all intervals of one moved together: .91 is 3.2 standard
    # errors below .95, passed in 7e-4 of such tests
    truth = np.array([-0.4, 0.0, 0.4])
    covered = []
    for seed in range(300):
        result = bradley_terry(tournament(seed + 10, truth.tolist(), 60))
        order = np.argsort(np.array(result.models))
        low, high = result.low[order], result.high[order]
        covered += ((low <= truth) & (truth <= high)).tolist()
    assert np.mean(covered) > 0.91
