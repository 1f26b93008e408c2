"""The sampler on laws whose answer is known."""

from typing import Any

import emcee
import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.errors import ConvergenceError
from masrel.intervals._mcmc import MAX_R_HAT, N_ENSEMBLES, sample

Floats = NDArray[np.float64]


def correlated_normal(position: Floats) -> Floats:
    # variance 1 each, correlation .8
    x, y = position[:, 0], position[:, 1]
    density: Floats = -(x * x - 1.6 * x * y + y * y) / (2 * (1 - 0.64))
    return density


def first(position: Floats) -> Floats:
    return position[:, 0]


def test_quantiles_of_a_normal_are_within_their_errors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("masrel.intervals._mcmc.MIN_ESS", 4_000.0)
    draws = sample(
        correlated_normal, 2, first,
        generator=np.random.default_rng(2), n_steps=1500, max_steps=16_000,
    )  # fmt: skip
    for share, exact in ((0.025, -1.959964), (0.5, 0.0), (0.975, 1.959964)):
        # 4.5 errors, three times: once in 49 000 runs of other seeds
        off = abs(draws.quantile(share) - exact)
        assert off < 4.5 * draws.quantile_error(share)
        assert draws.quantile_error(share) < 0.05
    assert draws.r_hat < MAX_R_HAT
    assert draws.ess >= 4_000


def test_two_far_modes_are_not_called_converged() -> None:
    def two_modes(position: Floats) -> Floats:
        x = position[:, 0]
        far: Floats = np.logaddexp(-0.5 * (x - 60) ** 2, -0.5 * (x + 60) ** 2)
        return far

    with pytest.raises(ConvergenceError, match="R-hat"):
        sample(
            two_modes, 1, first,
            generator=np.random.default_rng(2), n_steps=200, max_steps=400,
        )  # fmt: skip


def test_the_generator_decides_every_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    # Randomness needs no convergence.
    monkeypatch.setattr("masrel.intervals._mcmc.MIN_ESS", 1.0)
    monkeypatch.setattr("masrel.intervals._mcmc.MAX_R_HAT", 2.0)

    def drawn(seed: int) -> Floats:
        return sample(
            correlated_normal, 2, first,
            generator=np.random.default_rng(seed), n_steps=100, max_steps=100,
        ).values  # fmt: skip

    one = drawn(2)
    np.random.seed(99)  # noqa: NPY002 - the global state must not matter
    assert one.tobytes() == drawn(2).tobytes()
    assert not np.array_equal(one, drawn(3))


def test_every_ensemble_moves_by_differential_evolution_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # and never by the snooker move, which in emcee 3.1.6 does not keep the density
    monkeypatch.setattr("masrel.intervals._mcmc.MIN_ESS", 1.0)
    monkeypatch.setattr("masrel.intervals._mcmc.MAX_R_HAT", 2.0)
    moves: list[object] = []
    plain = emcee.EnsembleSampler.__init__

    def spied(self: object, *args: object, **options: Any) -> None:
        moves.extend(move for move, _ in options["moves"])
        plain(self, *args, **options)

    monkeypatch.setattr(emcee.EnsembleSampler, "__init__", spied)
    sample(
        correlated_normal, 2, first,
        generator=np.random.default_rng(1), n_steps=100, max_steps=100,
    )  # fmt: skip
    assert len(moves) == 2 * N_ENSEMBLES
    assert {type(move) for move in moves} == {emcee.moves.DEMove}
