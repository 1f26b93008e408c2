"""The models, and the engine that judges their studies."""

import numpy as np
import pytest

from docs.make.coverage.case import Case
from docs.make.coverage.latent import LatentTrait
from docs.make.coverage.methods import of_items, of_raters, two_way
from docs.make.coverage.multinomial import DirichletMultinomial, urn
from docs.make.coverage.simulate import TARGETS
from docs.make.coverage.spread import spread_of
from docs.make.coverage.studies import (
    Design,
    Floats,
    Model,
    Target,
    drawn,
    kappa_of_items,
)
from masrel.agreement import fleiss_kappa
from masrel.intervals import jackknife, posterior

POPULATIONS = (DirichletMultinomial, LatentTrait)
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
@pytest.mark.parametrize("model", POPULATIONS)
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


pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
SIZE = 40
MODELS = (DirichletMultinomial(kappa=0.5), LatentTrait(kappa=0.5))
DESIGNS = (
    Design(n_items=4, n_raters=3),
    Design(n_items=6, n_raters=5),
    Design(n_items=15, n_raters=8),
)


@pytest.fixture(
    params=[(m, d) for m in MODELS for d in DESIGNS],
    ids=lambda param: f"{type(param[0]).__name__}, {param[1]}",
)
def case(request: pytest.FixtureRequest) -> Case:
    model: Model
    model, design = request.param
    rng = np.random.Generator(np.random.PCG64(11))
    return Case.of(model.draw(SIZE, design, "both", rng))


def tables(case: Case) -> list[list[list[int]]]:
    return [table.tolist() for table in case.studies.codes]


def test_values_and_errors(case: Case) -> None:
    scale = range(case.studies.n_categories)
    found = [fleiss_kappa(table, categories=scale) for table in tables(case)]
    values = [estimate.value for estimate in found]
    errors = [estimate.standard_error for estimate in found]
    assert case.value == pytest.approx(values, abs=1e-13, nan_ok=True)
    assert case.spread.error == pytest.approx(errors, abs=1e-13, nan_ok=True)


def test_kappa_without_an_item_and_a_rater(case: Case) -> None:
    # the interaction of both, from kappas of tables with the row and column deleted
    n, r = case.n, case.r
    for s, codes in enumerate(case.studies.codes[:5]):
        own = np.empty((n, r))
        for i in range(n):
            for j in range(r):
                left = [
                    codes,
                    np.delete(codes, i, axis=0),
                    np.delete(codes, j, axis=1),
                    np.delete(np.delete(codes, i, axis=0), j, axis=1),
                ]
                k = [fleiss_kappa(t.tolist(), categories=range(5)).value for t in left]
                own[i, j] = k[3] - k[1] - k[2] + k[0]
        expected = (n - 1) * (r - 1) / (n * r) * float((own**2).sum())
        assert case.spread.of_cells[s] == pytest.approx(
            expected, abs=1e-13, nan_ok=True
        )


@pytest.mark.parametrize("target", TARGETS)
def test_jackknives(case: Case, target: Target) -> None:
    ours = {
        "items": of_items(case, "plain", stopgap=False),
        "raters": of_raters(case, "plain", stopgap=False),
        "both": two_way(case, "plain", stopgap=False),
    }[target]
    scale = range(case.studies.n_categories)
    n_defined = 0
    for table, low, high in zip(tables(case), ours.low, ours.high, strict=True):
        found = jackknife("fleiss_kappa", table, target=target, categories=scale)
        if found.reason is None:
            n_defined += 1
            assert (found.low, found.high) == pytest.approx((low, high), abs=1e-12)
    assert n_defined > SIZE / 3


def test_posteriors(case: Case) -> None:
    scale = range(case.studies.n_categories)
    for s, table in enumerate(tables(case)[:15]):
        found = posterior("fleiss_kappa", table, target="items", categories=scale)
        ours = case.posterior.p025[s], case.posterior.p975[s]
        assert (found.low, found.high) == pytest.approx(ours, abs=2e-5)
        wide = posterior(
            "fleiss_kappa", table, target="items", categories=scale, level=0.9
        )
        assert wide.low == pytest.approx(case.posterior.p05[s], abs=2e-5)
