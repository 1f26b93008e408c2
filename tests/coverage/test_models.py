"""Generated studies have the moments and the kappa they claim.

Random comparisons allow 5 standard errors: a false alarm in 1.7 million each; the
generator is fixed.
"""

import numpy as np
import pytest

from docs.make.coverage.latent import STEP, LatentTrait, fixed
from docs.make.coverage.multinomial import DirichletMultinomial, urn
from docs.make.coverage.spread import spread_of
from docs.make.coverage.studies import Design, Floats, drawn, kappa_of_items

MODELS = (DirichletMultinomial, LatentTrait)
KAPPAS = (0.2, 0.6, 0.9)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(7))


def near(values: Floats, expected: Floats | float) -> bool:
    """Whether the mean over the first axis is within 5 of its standard errors."""
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    return bool((np.abs(values.mean(axis=0) - expected) <= 5.0 * error).all())


def test_ratings_are_drawn_with_their_shares(rng: np.random.Generator) -> None:
    shares = np.array([0.5, 0.2, 0.3])
    codes = drawn(np.tile(shares, (50_000, 1)), 2, rng)
    for category, share in enumerate(shares):
        assert near((codes == category).astype(float), share)
    assert near((codes[:, 0] == codes[:, 1]).astype(float), 0.25 + 0.04 + 0.09)


def test_kappa_of_fixed_items_by_hand() -> None:
    # Raters differ on the second item only: with probability 1/2, so on 1/4 of all
    # pairs. Shares are 3/4 and 1/4: by chance on 6/16. kappa = 1 - (1/4)/(6/16) = 1/3
    apart = np.array([[1.0, 0.0], [0.5, 0.5]])
    assert kappa_of_items(apart) == pytest.approx(1 / 3)
    assert kappa_of_items(np.eye(3)) == 1.0
    assert kappa_of_items(np.full((4, 2), 0.5)) == 0.0


@pytest.mark.parametrize("kappa", KAPPAS)
def test_dirichlet_vectors_have_their_moments(
    kappa: float, rng: np.random.Generator
) -> None:
    # E p_k = π_k; var p_k = π_k (1 - π_k) / (1 + A), and 1/(1 + A) is kappa
    model = DirichletMultinomial(kappa=kappa)
    shares = np.array(model.shares)
    vectors = model.probabilities(40_000, 1, rng)[:, 0]
    assert np.isfinite(vectors).all()
    assert near(vectors, shares)
    assert near((vectors - shares) ** 2, shares * (1 - shares) * kappa)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_an_urn_gives_the_same_law_as_dirichlet_vectors(
    kappa: float, rng: np.random.Generator
) -> None:
    # Agreeing pairs: Σ π_k (π_k + kappa (1 - π_k)) of 6; all four alike, too
    model = DirichletMultinomial(kappa=kappa)
    shares = np.array(model.shares)
    from_urn = urn(model, 40_000, 4, rng)
    one = Design(n_items=1, n_raters=4)
    ours = model.draw(40_000, one, "items", rng).counts[:, 0].astype(float)
    pairs = 6 * float((shares * (shares + kappa * (1 - shares))).sum())
    a = (1.0 / kappa - 1.0) * shares
    whole = a.sum()
    alike = np.prod([(a + j) / (whole + j) for j in range(4)], axis=0)
    for counts in (from_urn, ours):
        assert (counts.sum(axis=1) == 4).all()
        assert near((counts * (counts - 1) / 2).sum(axis=1), pairs)
        assert near((counts == 4).astype(float), alike)


@pytest.mark.parametrize("kappa", KAPPAS)
@pytest.mark.parametrize("model", MODELS)
def test_large_studies_have_the_kappa_of_the_population(
    model: type[DirichletMultinomial | LatentTrait],
    kappa: float,
    rng: np.random.Generator,
) -> None:
    design = Design(n_items=1_000, n_raters=12)
    for target in ("items", "both"):
        studies = model(kappa=kappa).draw(60, design, target, rng)
        off = spread_of(studies).value - studies.truth
        assert near(off, 0.0) or abs(off.mean()) < 0.003  # bias of the order of 1/n
        assert np.mean(studies.truth) == pytest.approx(kappa, abs=0.02)


@pytest.mark.parametrize("kappa", KAPPAS)
@pytest.mark.parametrize("model", MODELS)
def test_many_raters_find_the_kappa_of_fixed_items(
    model: type[DirichletMultinomial | LatentTrait],
    kappa: float,
    rng: np.random.Generator,
) -> None:
    design = Design(n_items=6, n_raters=1_000)
    studies = model(kappa=kappa).draw(60, design, "raters", rng)
    off = spread_of(studies).value - studies.truth
    assert near(off, 0.0) or abs(off.mean()) < 0.003  # bias of the order of 1/r
    if model is LatentTrait:
        assert studies.truth == pytest.approx(kappa, abs=1e-10)


def test_quadratures_do_not_depend_on_their_step(rng: np.random.Generator) -> None:
    for kappa in KAPPAS:
        model = LatentTrait(kappa=kappa, bias=1.0)
        scale = model.scale()
        assert model.of_all(scale, step=STEP / 3) == pytest.approx(kappa, abs=1e-9)
        biases = rng.normal(0.0, scale, (5, 8))
        finer = model.of_raters(scale, biases, step=STEP / 3)
        assert model.of_raters(scale, biases) == pytest.approx(finer, abs=1e-9)


def test_kappa_of_named_raters_by_simulation(rng: np.random.Generator) -> None:
    model = LatentTrait(kappa=0.6, bias=1.0)
    scale = model.scale()
    biases = np.array([[-0.4, 0.1, 0.5]])
    n = 200_000
    seen = rng.normal(size=(n, 1)) + biases + rng.normal(0.0, scale, (n, 3))
    codes = np.searchsorted(model.thresholds, seen)
    pairs = [codes[:, i] == codes[:, j] for i, j in ((0, 1), (0, 2), (1, 2))]
    own = np.mean(pairs, axis=0)
    shares = np.bincount(codes.ravel(), minlength=4) / codes.size
    chance = float((shares**2).sum())
    found = (own.mean() - chance) / (1.0 - chance)
    error = own.std() / np.sqrt(n) / (1.0 - chance)
    assert abs(found - model.of_raters(scale, biases)[0]) < 5.0 * error


def test_fixed_items_span_the_scale() -> None:
    # Φ(z) = 1/8, 3/8, 5/8, 7/8
    assert fixed(4) == pytest.approx([-1.1503494, -0.3186394, 0.3186394, 1.1503494])
