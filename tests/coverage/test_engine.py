"""What is computed for thousands of studies at once is what the package computes."""

import warnings
from typing import Literal

import numpy as np
import pytest

from docs.make.coverage import peers
from docs.make.coverage.bounds import Bounds, around
from docs.make.coverage.case import Case
from docs.make.coverage.latent import LatentTrait
from docs.make.coverage.methods import delta, of_items, of_raters, two_way
from docs.make.coverage.multinomial import DirichletMultinomial
from docs.make.coverage.simulate import TARGETS
from docs.make.coverage.studies import Design, Model, Target
from masrel.agreement import fleiss_kappa, fleiss_null
from masrel.intervals import analytic, jackknife, posterior

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


def test_delta_method_on_two_scales(case: Case) -> None:
    scale = range(case.studies.n_categories)
    asked: dict[Literal["t", "normal", "logit", "fisher"], Bounds] = {
        "t": delta(case),
        "fisher": delta(case, "Fisher z"),
    }
    for distribution, ours in asked.items():
        for table, low, high in zip(tables(case), ours.low, ours.high, strict=True):
            found = analytic(
                "fleiss_kappa",
                table,
                target="items",
                categories=scale,
                distribution=distribution,
            )
            if found.reason is None:
                assert (found.low, found.high) == pytest.approx((low, high), abs=1e-12)


def test_intraclass_scale_by_hand() -> None:
    # r = 3: from -1/2 to 1. kappa 1/4 is in the middle: odds 1. Its logit has slope
    # 1/(1.5 × 1/4) = 8/3, so a half of (3/8) ln 2 multiplies odds by 2: shares 1/3, 2/3
    half = np.array([0.375 * np.log(2.0)])
    found = around(np.array([0.25]), half, "intraclass", 3)
    assert found.low == pytest.approx([0.0])
    assert found.high == pytest.approx([0.5])
    at_the_end = around(np.array([-0.5]), np.array([0.1]), "intraclass", 3)
    assert at_the_end.low == pytest.approx([-0.6])
    for_two = around(np.array([0.3]), half, "intraclass", 2)
    fisher = around(np.array([0.3]), half, "Fisher z", 9)
    middle = np.arctanh(0.3)
    by_hand = np.tanh([middle - half[0] / 0.91, middle + half[0] / 0.91])
    for bounds in (for_two, fisher):
        assert [bounds.low[0], bounds.high[0]] == pytest.approx(by_hand)


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


def test_null_standard_error_is_that_of_the_test(case: Case) -> None:
    errors = peers.null_standard_error(case)
    for s, table in enumerate(tables(case)):
        if np.isfinite(case.value[s]):
            test = fleiss_null(table)
            assert case.value[s] / errors[s] == pytest.approx(test.statistic)


def test_irrcac_prints_what_is_judged(case: Case) -> None:
    raw = pytest.importorskip("irrCAC.raw")
    import pandas as pd

    ours = peers.irrcac(case)
    for s, table in enumerate(tables(case)[:10]):
        if not np.isfinite(case.value[s]):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = raw.CAC(pd.DataFrame(table), digits=12).fleiss()
        interval = found["est"]["confidence_interval"]
        assert interval == pytest.approx((ours.low[s], ours.high[s]), abs=1e-9)
