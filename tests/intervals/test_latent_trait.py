"""The latent-trait model as its users meet it."""

import re
from collections.abc import Iterator

import numpy as np
import pandas as pd
import pytest

from masrel.errors import ConvergenceError, ParameterError
from masrel.intervals import LatentPrior, LatentTrait, latent_trait
from tests.intervals.data import SCALE
from tests.intervals.latent_studies import drawn

SMALL = [[1, 1, 2], [2, 2, 2], [3, 4, 3], [4, 4, 3]]

SAMPLER = "masrel.intervals.latent._sampler"


@pytest.fixture(scope="module", autouse=True)
def brief() -> Iterator[None]:
    """Let a second of sampling pass as converged."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{SAMPLER}.MIN_ESS", 100.0)
        patch.setattr(f"{SAMPLER}.MAX_R_HAT", 1.2)
        patch.setattr(f"{SAMPLER}._WARM_UP", (25, 25, 25))
        patch.setattr("masrel.intervals.latent._sampler._N_CHAINS", 24)
        patch.setattr("masrel.intervals.latent._trait._MAX_KAPPAS", 500)
        yield


def fitted(ratings: object = SMALL, **options: object) -> LatentTrait:
    given: dict[str, object] = {
        "items": "fixed",
        "n_steps": 40,
        "rng": 1,
        "compare": False,
        **({} if "categories" in options else {"categories": [1, 2, 3, 4, 5]}),
        **options,
    }
    return latent_trait(ratings, **given)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def result(brief: None) -> LatentTrait:  # noqa: ARG001 - it has to come first
    return fitted(keep_chains=True)


def test_everything_has_a_name_and_an_interval(result: LatentTrait) -> None:
    assert [one.name for one in result.items] == [f"item {i}" for i in (1, 2, 3, 4)]
    raters = ["rater 1", "rater 2", "rater 3"]
    assert [one.name for one in result.raters] == raters
    assert [one.name for one in result.noises] == raters
    assert [one.name for one in result.thresholds] == [
        "1 | 2",
        "2 | 3",
        "3 | 4",
        "4 | 5",
    ]
    for one in (*result.items, *result.raters, *result.noises, *result.shares):
        assert one.interval.low < one.value < one.interval.high
        assert (one.interval.kind, one.interval.level) == ("credible", 0.95)
    assert np.array(result.grades).sum(axis=1) == pytest.approx(np.ones(4))


def test_a_seed_repeats_every_byte(result: LatentTrait) -> None:
    again = fitted(keep_chains=True)
    assert again == result
    assert again.chains is not None
    assert result.chains is not None
    for name in ("kappa", "severity", "bias", "noise", "thresholds", "shares"):
        one, two = (getattr(of.chains, name) for of in (again, result))
        assert one.tobytes() == two.tobytes()


def test_labels_give_the_names_and_what_has_no_rating_is_left_out() -> None:
    table = pd.DataFrame(
        [
            ["1", "1+", None, "1"],
            [None] * 4,
            ["2", "2", None, None],
            ["3", "2", None, "3"],
        ],
        index=["HM1", "HM2", "HM3", "HM4"],
        columns=["A", "B", "C", "D"],
    )
    result = fitted(table, categories=SCALE)
    assert [one.name for one in result.items] == ["HM1", "HM3", "HM4"]
    assert [one.name for one in result.raters] == ["A", "B", "D"]
    assert (result.kappa.n_items, result.kappa.n_raters) == (3, 3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"item_share": (0.0, 1.0)},
        {"noise_fraction": (1.0, float("nan"))},
        {"noise_spread": -0.5},
        {"concentration": float("inf")},
    ],
)
def test_a_prior_has_to_be_one(wrong: dict[str, object]) -> None:
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        LatentPrior(**wrong)  # type: ignore[arg-type]


def test_what_has_not_converged_is_no_interval_but_says_how_many_more_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(f"{SAMPLER}.MIN_ESS", 4_000.0)
    with pytest.raises(ConvergenceError, match="more steps are needed") as raised:
        fitted(n_steps=20, max_steps=40)
    message = str(raised.value)
    assert "after 40 steps" in message
    more = re.search(r"about (\d+) more steps", message)
    assert more is not None
    # 24 chains of 40 steps are at most 960 draws, of which 4000 are wanted
    assert int(more[1]) > 120


def extreme(result: LatentTrait) -> dict[str, float]:
    return {
        check.name: check.p_value
        for check in result.checks
        if not 0.005 <= check.p_value <= 0.995
    }


def test_the_predictive_check_sees_a_rater_who_turns_the_scale_round() -> None:
    rng = np.random.default_rng(2)
    codes, _ = drawn(
        rng, 14, 6, [-1.2, -0.4, 0.4, 1.2], share=0.95, fraction=0.7, spread=0.1
    )
    codes[:, 4] = 4 - codes[:, 4]
    tight = LatentPrior(noise_spread=0.1)  # raters who are alike
    result = fitted(codes, categories=[0, 1, 2, 3, 4], prior=tight)
    name = "widest distance of a rater from items' means"
    assert extreme(result)[name] < 0.005
