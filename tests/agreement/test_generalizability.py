"""Generalizability studies: components, intervals, decision studies, large designs."""

import json
import math
from fractions import Fraction
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import (
    cheapest_design,
    d_study,
    g_study,
    icc,
    single_ratings,
)
from masrel.errors import UndefinedStatisticWarning

ORACLE = Path(__file__).parents[1] / "oracles" / "generalizability.json"
DATASETS = json.loads(ORACLE.read_text(encoding="utf-8"))["datasets"]
LME4 = json.loads(ORACLE.with_name("lme4.json").read_text(encoding="utf-8"))

# Sizes by column, the first measured, and what is nested; "again": several of a cell
DESIGNS = [
    ({"p": 6, "r": 3}, {}),
    ({"p": 4, "r": 2, "again": 3}, {}),
    ({"p": 5, "r": 4}, {"r": "p"}),
    ({"p": 3, "r": 2, "again": 2}, {"r": "p"}),
    ({"p": 5, "r": 3, "o": 2}, {}),
    ({"p": 4, "t": 3, "r": 2}, {"r": "t"}),
    ({"p": 4, "t": 2, "r": 3, "again": 2}, {"r": "t"}),
    ({"p": 3, "t": 3, "r": 2}, {"r": "p"}),
    ({"p": 4, "t": 2, "r": 3, "o": 2}, {}),
    ({"p": 3, "c": 2, "t": 3, "r": 2}, {"r": "t", "t": "c"}),
]


def frame(scores: object, columns: list[str]) -> pd.DataFrame:
    """One row a score, by its place in an array."""
    rows = [(*place, score) for place, score in np.ndenumerate(np.array(scores))]
    return pd.DataFrame(rows, columns=[*columns, "grade"])


def exact_components(
    scores: np.ndarray, columns: list[str], nested: dict[str, str]
) -> dict[frozenset[str], Fraction]:
    """Components by sums of squares of the crossed design, in fractions."""
    # the sum of squares of an effect that is nested is that of several crossed ones
    values = np.array([Fraction(int(x)) for x in scores.ravel()], dtype=object)
    values = values.reshape(scores.shape)
    axes = range(scores.ndim)
    part, squares, df = {}, {}, {}
    for kept in chain.from_iterable(
        combinations(axes, k) for k in range(len(axes) + 1)
    ):
        others = tuple(axis for axis in axes if axis not in kept)
        mean = values
        for axis in others:
            mean = mean.sum(axis=axis, keepdims=True) / scores.shape[axis]
        below = (part[b] for b in part if set(b) < set(kept))
        part[kept] = mean - sum(below, start=Fraction(0))
        n_below = math.prod(scores.shape[axis] for axis in others)
        effect = {columns[axis] for axis in kept}
        for _ in columns:
            effect |= {nested[name] for name in effect if name in nested}
        if "again" in effect:  # is within all
            effect = set(columns)
        key = frozenset(effect)
        squares[key] = squares.get(key, 0) + n_below * (part[kept] ** 2).sum()
        own = math.prod(scores.shape[axis] - 1 for axis in kept)
        df[key] = df.get(key, 0) + own
    sizes = dict(zip(columns, scores.shape, strict=True))
    components: dict[frozenset[str], Fraction] = {}
    for key in sorted(filter(None, squares), key=len, reverse=True):
        above = [other for other in components if key < other]
        n = {of: math.prod(sizes[c] for c in columns if c not in of) for of in squares}
        rest = sum(n[other] * components[other] for other in above)
        components[key] = (squares[key] / df[key] - rest) / n[key]
    return components


class TestBalanced:
    @pytest.mark.parametrize("dataset", DATASETS, ids=lambda of: of["name"])
    def test_published_data(self, dataset):
        facets = dataset["facets"]
        table = frame(dataset["scores"], ["p", *facets])
        study = g_study(table, of="p", facets=facets, nested=dataset["nested"])
        assert study.method == "ANOVA"
        assert study.components == pytest.approx(dataset["components"], rel=1e-9)
        assert study.mean_squares == pytest.approx(dataset["mean_squares"], rel=1e-9)
        for expected in dataset["d_studies"]:
            design = study.d_study(**expected.pop("sizes"))
            printed = {name: getattr(design, name) for name in expected}
            assert printed == pytest.approx(expected, rel=1e-9)

    @pytest.mark.parametrize(("sizes", "nested"), DESIGNS)
    def test_ten_designs_as_by_exact_analysis_of_variance(self, sizes, nested):
        rng = np.random.default_rng(20)
        columns = list(sizes)
        scores = rng.integers(0, 9, tuple(sizes.values()))
        expected = exact_components(scores, columns, nested)
        table = frame(scores, columns)
        facets = [name for name in columns[1:] if name != "again"]
        study = g_study(table, of="p", facets=facets, nested=nested)
        assert study.method == "ANOVA"
        assert len(study.components) == len(expected)
        for source, part in study.components.items():
            effect = study.effects[source]
            key = frozenset(columns) if "residual" in effect else effect
            assert part == pytest.approx(float(expected[key]), rel=1e-9, abs=1e-9)

    def test_single_ratings_of_persons_and_raters_are_icc(self):
        ratings = [
            [9, 2, 5, 8],
            [6, 1, 3, 2],
            [8, 4, 6, 8],
            [7, 1, 2, 6],
            [10, 5, 6, 9],
        ]
        study = g_study(frame(ratings, ["p", "r"]), of="p", facets=["r"])
        assert list(single_ratings(study)) == ["another of each"]
        for k, absolute, relative in ((1, "A,1", "C,1"), (4, "A,k", "C,k")):
            design = study.d_study(r=k)
            expected = icc(ratings, form=f"ICC({absolute})").value
            assert design.dependability == pytest.approx(expected, rel=1e-12)
            expected = icc(ratings, form=f"ICC({relative})").value
            assert design.generalizability == pytest.approx(expected, rel=1e-12)

    def test_no_digit_depends_on_what_columns_are_called(self):
        # sets of names have an order that differs from run to run, as sums in it do
        scores = np.random.default_rng(3).normal(size=(12, 4, 3))
        components = set()
        for names in ("prt", "abc", "xyz", "tpr", "qwe", "cab", "zyx", "mno"):
            study = g_study(frame(scores, [*names]), of=names[0], facets=[*names[1:]])
            components.add(tuple(study.components.values()))
        assert len(components) == 1

    def test_negative_components_are_said_and_taken_for_none(self):
        # by hand: mean squares of persons 9/2, of raters 2/3, of the rest 7/6
        table = frame([[4, 5], [2, 1], [2, 4]], ["p", "r"])
        study = g_study(table, of="p", facets=["r"])
        assert list(study.components.values()) == pytest.approx([5 / 3, -1 / 6, 7 / 6])
        assert any("negative" in note for note in study.notes)
        assert study.intervals["r"].low == 0.0
        design = study.d_study(r=2)
        assert design.absolute_error == pytest.approx(7 / 12)

    def test_nothing_that_varies_is_undefined(self):
        for rows in (slice(None), slice(1, None)):  # with a gap, too
            table = frame(np.full((4, 3), 2.0), ["p", "r"])[rows]
            study = g_study(table, of="p", facets=["r"])
            with pytest.warns(UndefinedStatisticWarning):
                design = study.d_study(r=2)
            assert math.isnan(design.dependability)
            assert design.reason == design.dependability_interval.reason is not None


class TestDecisions:
    @pytest.fixture
    def study(self):
        facets, scores = ["t", "r"], DATASETS[0]["scores"]
        table = frame(scores, ["p", *facets])
        return g_study(table, of="p", facets=facets, nested={"r": "t"})

    def test_a_cut_by_hand(self, study):
        # the mean is 4.75; it varies by p/10 + t/3 + r:t/12 + pt/30 + prt/120
        p, t, pt, rt, prt = study.components.values()
        spread = p / 10 + t / 3 + rt / 12 + pt / 30 + prt / 120
        design = d_study(study, {"t": 3, "r": 4}, cut=3.0)
        signal = p + (4.75 - 3.0) ** 2 - spread
        expected = signal / (signal + design.absolute_error)
        assert design.cut_dependability == pytest.approx(expected, rel=1e-12)
        assert design.cut_interval.low < expected < design.cut_interval.high
        # at the mean itself nothing is added
        at_mean = d_study(study, {"t": 3, "r": 4}, cut=4.75)
        assert at_mean.cut_dependability == at_mean.dependability

    def test_a_fixed_facet_is_of_the_universe(self, study):
        p, _, pt, rt, prt = study.components.values()
        design = d_study(study, {"t": 3, "r": 4}, fixed=["t"])
        assert design.universe == pytest.approx(p + pt / 3)
        assert design.relative_error == pytest.approx(prt / 12)
        assert design.absolute_error == pytest.approx((rt + prt) / 12)

    def test_single_ratings_say_what_two_of_them_share(self, study):
        p, _, pt, rt, prt = study.components.values()
        same = single_ratings(study)["the same t"]
        assert same.dependability == pytest.approx((p + pt) / (p + pt + rt + prt))

    @pytest.mark.parametrize(
        ("of", "prices"), [("dependability", None), ("generalizability", (9, 2, 0.5))]
    )
    def test_the_cheapest_design_is_that_of_a_search_by_d_study(
        self, study, of, prices
    ):
        aim, n_most = 0.55, 12
        found = cheapest_design(study, aim, prices=prices, of=of)
        per_t, per_r, per_rating = prices or (0.0, 0.0, 1.0)
        costs = {
            (t, r): per_t * t + per_r * t * r + per_rating * 10 * t * r
            for t in range(1, n_most)
            for r in range(1, n_most)
            if getattr(study.d_study(t=t, r=r), of) >= aim
        }
        assert getattr(found, of) >= aim
        assert found.cost == pytest.approx(min(costs.values()))
        assert costs[tuple(found.sizes.values())] == pytest.approx(found.cost)

    def test_more_levels_are_more_reliable_and_seeds_repeat(self, study):
        few, many = study.d_study(t=2, r=2), study.d_study(t=4, r=2)
        assert few.dependability < many.dependability
        assert few.generalizability >= few.dependability
        low, high = few.dependability_interval.low, few.dependability_interval.high
        assert 0.0 <= low < few.dependability < high <= 1.0
        table = frame(DATASETS[0]["scores"], ["p", "t", "r"])
        keywords = {"of": "p", "facets": ["t", "r"], "nested": {"r": "t"}}
        assert g_study(table, **keywords, rng=0).intervals == study.intervals
        assert g_study(table, **keywords, rng=1).intervals != study.intervals


def normal_frame(sizes: dict[str, int], rng: np.random.Generator) -> pd.DataFrame:
    """Crossed ratings with an effect of each column, and of each two, and a rest."""
    places = np.indices(tuple(sizes.values())).reshape(len(sizes), -1)
    table = pd.DataFrame(dict(zip(sizes, places, strict=True)))
    grade = rng.normal(size=len(table))
    for k in (1, 2):
        for names in combinations(sizes, k):
            draws = rng.normal(size=[sizes[name] for name in names])
            grade += draws[tuple(table[name] for name in names)]
    return table.assign(grade=grade)


class TestGaps:
    def test_reml_is_that_of_statsmodels(self):
        from statsmodels.regression.mixed_linear_model import MixedLM

        rng = np.random.default_rng(3)
        table = pd.concat([normal_frame({"p": 8, "r": 4}, rng)] * 2, ignore_index=True)
        table["grade"] += rng.normal(size=len(table))
        table = table[rng.random(len(table)) < 0.7].copy()
        study = g_study(table, of="p", facets=["r"])
        assert study.method == "REML"
        table["both"] = table["p"] * 10 + table["r"]
        columns = {"p": "p", "r": "r", "both": "p × r"}
        model = MixedLM.from_formula(
            "grade ~ 1",
            groups=np.ones(len(table)),
            re_formula="0",
            vc_formula={name: f"0 + C({name})" for name in columns},
            data=table,
        )
        fit = model.fit(reml=True, method=["bfgs"], gtol=1e-9)
        expected = dict(zip(model.exog_vc.names, fit.vcomp, strict=True))
        expected = {columns[name]: part for name, part in expected.items()}
        expected["residual"] = fit.scale
        assert study.components == pytest.approx(expected, rel=1e-5)

    @pytest.mark.parametrize("design", LME4["designs"], ids=lambda of: of["name"])
    def test_reml_is_that_of_lme4(self, design: dict[str, Any]):
        frame = pd.DataFrame(design["rows"], columns=design["columns"])
        study = g_study(
            frame, of="person", facets=design["facets"], nested=design["nested"]
        )
        assert study.method == "REML"
        assert study.components == pytest.approx(design["components"], rel=1e-5)
        # what lme4 has at 0 is 0, and no number near it that differs from run to run
        zeros = [source for source, part in design["components"].items() if not part]
        assert all(study.components[source] == 0.0 for source in zeros)

    def test_one_gap_changes_little(self):
        # of a balanced design REML is its mean squares, components being above 0
        table = normal_frame({"p": 30, "r": 8}, np.random.default_rng(1))
        whole = g_study(table, of="p", facets=["r"])
        gap = g_study(table.drop(index=17), of="p", facets=["r"])
        assert (whole.method, gap.method) == ("ANOVA", "REML")
        assert gap.components == pytest.approx(whole.components, rel=0.03)
        for source, interval in whole.intervals.items():
            assert gap.intervals[source].low == pytest.approx(interval.low, rel=0.05)
            assert gap.intervals[source].high == pytest.approx(interval.high, rel=0.05)

    def test_neither_names_nor_units_nor_order_matter(self):
        rng = np.random.default_rng(4)
        table = normal_frame({"p": 9, "r": 3, "o": 3}, rng)
        table = table[rng.random(len(table)) < 0.8]
        study = g_study(table, of="p", facets=["r", "o"])
        other = table.sample(frac=1.0, random_state=1)
        other = other.assign(
            p="P" + other["p"].astype(str), grade=10 * other["grade"] + 7
        )
        again = g_study(other, of="p", facets=["r", "o"])
        expected = {source: 100 * part for source, part in study.components.items()}
        assert again.components == pytest.approx(expected, rel=1e-5, abs=1e-5)

    def test_without_residual_moments_take_the_place_of_reml(self):
        table = frame(np.add.outer([0, 3, 1, 5], [0, 2, 1]), ["p", "r"]).drop(index=0)
        study = g_study(table, of="p", facets=["r"])
        assert study.method == "moments"
        assert any("moments" in note for note in study.notes)


def sparse_frame(n_p: int, n_r: int, n: int, seed: int) -> pd.DataFrame:
    """Persons and raters of whom few meet; variances are 1, 0.5 and 1."""
    rng = np.random.default_rng(seed)
    p, r = np.divmod(np.unique(rng.integers(0, n_p * n_r, n)), n_r)
    grade = rng.normal(size=n_p)[p] + math.sqrt(0.5) * rng.normal(size=n_r)[r]
    return pd.DataFrame({"p": p, "r": r, "grade": grade + rng.normal(size=len(p))})


class TestLarge:
    @pytest.mark.slow
    def test_moments_of_a_very_large_design(self):
        # six standard errors of each component: fails once in 10⁸ times
        study = g_study(sparse_frame(36_000, 11_000, 130_000, 0), of="p", facets=["r"])
        assert study.method == "moments"
        for part, true in zip(study.components.values(), (1.0, 0.5, 1.0), strict=True):
            assert part == pytest.approx(true, abs=0.07)
        for source, true in zip(study.intervals, (1.0, 0.5, 1.0), strict=True):
            interval = study.intervals[source]
            assert abs(true - interval.low) < 0.1
            assert 0.01 < interval.high - interval.low < 0.12

    @pytest.mark.slow
    def test_reml_of_a_large_design_is_near_the_truth(self):
        study = g_study(sparse_frame(2000, 600, 14_000, 0), of="p", facets=["r"])
        assert study.method == "REML"
        for part, true in zip(study.components.values(), (1.0, 0.5, 1.0), strict=True):
            assert part == pytest.approx(true, abs=0.2)


def test_intervals_hold_the_truth():
    # 200 studies, of which 95 % hold it: fewer than 175 do once in 10⁵ times
    rng, held = np.random.default_rng(11), np.zeros(4)
    for _ in range(200):
        table = normal_frame({"p": 10, "r": 4}, rng)
        table["grade"] = table["grade"] * math.sqrt(0.5)  # pr and rest: 1 together
        study = g_study(table, of="p", facets=["r"])
        truth = (0.5, 0.5, 1.0, 0.5 / (0.5 + 1.5 / 4))
        intervals = *study.intervals.values(), study.d_study(r=4).dependability_interval
        held += [of.low <= x <= of.high for of, x in zip(intervals, truth, strict=True)]
    assert held.min() >= 175
