"""Intervals by formula, by leaving out and by bootstrap, side by side.

The package has no bootstrap for limits of agreement, g studies and spans. This study
shows why, and what happens if teeth of one patient are taken for independent.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import product
from typing import get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from docs.make.coverage.gstudies import simulated
from docs.make.coverage.limits import Z
from docs.make.coverage.study import (
    Answer,
    Cell,
    Floats,
    answer,
    crossed,
    one_by_one,
    percent,
)
from docs.make.evidence import DOCS, write_part
from masrel.agreement import (
    RepeatedLimits,
    d_study,
    g_study,
    limits_by_clusters,
    limits_with_repeats,
    span_f1,
    unitizing_alpha,
)
from masrel.agreement.spans import SpanMatch

Integers = NDArray[np.int64]

SEED, N_RESAMPLES = 20261130, 999
N_STUDIES = {
    "limits": 300,
    "Φ of 3 raters": 600,
    "Φ of a rating of a tooth": 400,
    "spans": 300,
}
# spans that an observer misses, and ends that he or she moves, of documents on average
OBSERVERS = {"few errors": (0.05, 0.1), "many errors": (0.4, 0.6)}
SLOT, N_FOR_TRUTH = 60, 10_000  # places for a span; documents
PATIENTS, TEETH, RATERS = 20, 4, 3
# of patients, their teeth, raters, raters for a patient, and what is left
VARIANCES = (1.0, 0.05, 0.2, 0.2, 0.5)


def cells() -> list[Cell]:
    """Return the cells: what is estimated, from how many units."""
    studies: Mapping[tuple[str, int], Callable[..., Iterator[Answer]]] = {
        **{("limits, normal", n): partial(limits, n, None) for n in (10, 50, 100)},
        ("limits, t(5)", 100): partial(limits, 100, 5),
        **{("Φ of 3 raters", n): partial(dependability, n) for n in (10, 50)},
        ("Φ of a rating of a tooth", PATIENTS): teeth,
        **{
            (f"spans, {name}", n): partial(spans, name, n)
            for name, n in product(OBSERVERS, (5, 10, 20, 50))
        },
    }
    return [
        Cell(
            at={"what": what, "n": n},
            ask=partial(one_by_one, study),
            seed=(SEED, place),
            n_studies=N_STUDIES[what.partition(",")[0]],
        )
        for place, ((what, n), study) in enumerate(studies.items())
    ]


def _bootstrap(
    value: Callable[[Integers], Floats], n: int, truth: float, rng: np.random.Generator
) -> Iterator[Answer]:
    """Yield two intervals of the value of some of n units, drawn with replacement."""
    found = None
    for method in ("percentile", "BCa"):
        found = stats.bootstrap(
            (np.arange(n),),
            lambda units, axis: value(units),  # noqa: ARG005
            vectorized=True,
            n_resamples=0 if found else N_RESAMPLES,
            bootstrap_result=found,
            method=method,
            rng=rng,
        )
        yield Answer(f"bootstrap, {method}", *found.confidence_interval, truth)


def limits(n: int, df: int | None, rng: np.random.Generator) -> Iterator[Answer]:
    """Draw differences, normal or t(df); yield intervals of the upper limit."""
    d = rng.standard_t(df, n) if df else rng.normal(size=n)
    truth = Z * (df / (df - 2)) ** 0.5 if df else Z
    frame = pd.DataFrame({"item": range(n), "x": d, "y": 0.0})
    found = limits_with_repeats(frame, item="item", first="x", second="y")
    yield answer("formula", found.high_interval, truth)

    def without(rows: pd.DataFrame) -> RepeatedLimits:
        # with one pair of an item there is nothing else that changes
        return replace(found, bias=rows["x"].mean(), sd=rows["x"].std())

    left_out = limits_by_clusters(frame, without, clusters="item")
    yield answer("left out", left_out.high_interval, truth)

    def upper(items: Integers) -> Floats:
        return d[items].mean(axis=-1) + Z * d[items].std(axis=-1, ddof=1)

    yield from _bootstrap(upper, n, truth, rng)


def dependability(n: int, rng: np.random.Generator) -> Iterator[Answer]:
    """Draw ratings of persons; yield intervals of Φ of the raters' mean."""
    ratings, parts = simulated(({"rater": RATERS}, 0.0, n), rng)
    error = (parts["rater"] + parts["person × rater"]) / RATERS
    truth = parts["person"] / (parts["person"] + error)
    design = g_study(ratings, of="person", facets=["rater"]).d_study(rater=RATERS)
    yield answer("formula", design.dependability_interval, truth)
    table = ratings["grade"].to_numpy().reshape(n, RATERS)
    yield from _bootstrap(lambda persons: _phi(table[persons]), n, truth, rng)


def _phi(y: Floats) -> Floats:
    # ratings (..., n, k) -> Φ of the mean of k raters, from mean squares
    n, k = y.shape[-2:]
    of_persons, of_raters = y.mean(axis=-1), y.mean(axis=-2)
    middle = of_raters.mean(axis=-1)[..., None, None]
    rest = y - of_persons[..., None] - of_raters[..., None, :] + middle
    residual = (rest**2).sum(axis=(-2, -1)) / ((n - 1) * (k - 1))
    persons = np.maximum(of_persons.var(axis=-1, ddof=1) - residual / k, 0.0)
    raters = np.maximum(of_raters.var(axis=-1, ddof=1) - residual / n, 0.0)
    return np.asarray(persons / (persons + (raters + residual) / k))


def teeth(rng: np.random.Generator) -> Iterator[Answer]:
    """Draw teeth of patients; yield intervals of Φ of one rating of a tooth."""
    tooth, rater = np.indices((PATIENTS * TEETH, RATERS)).reshape(2, -1)
    patient = tooth // TEETH
    numbers = (patient, tooth, rater, patient * RATERS + rater, np.arange(len(tooth)))
    grade = sum(
        rng.normal(0.0, variance**0.5, of.max() + 1)[of]
        for of, variance in zip(numbers, VARIANCES, strict=True)
    )
    truth = sum(VARIANCES[:2]) / sum(VARIANCES)
    frame = pd.DataFrame(
        {"patient": patient, "tooth": tooth, "rater": rater, "grade": grade}
    )
    nested = g_study(
        frame, of="patient", facets=["tooth", "rater"], nested={"tooth": "patient"}
    )
    design = d_study(nested, {"tooth": 1, "rater": 1}, fixed=["tooth"])
    yield answer("teeth within patients", design.dependability_interval, truth)
    alone = g_study(frame, of="tooth", facets=["rater"]).d_study(rater=1)
    yield answer("teeth as persons", alone.dependability_interval, truth)


def spans(name: str, n: int, rng: np.random.Generator) -> Iterator[Answer]:
    """Draw documents; yield intervals of α and F1, and of strict F1 by bootstrap."""
    rows, lengths, counts = _annotated(name, n, rng)
    true_alpha, true_f1 = _truth(name)
    alpha = unitizing_alpha(rows, length=lengths).estimates[None]
    yield answer("α", alpha.interval, true_alpha)
    for match, truth in true_f1.items():
        f1 = span_f1(rows, match=match)[0, 1]
        yield answer(match, f1.interval, truth)
    yield from _bootstrap(
        lambda documents: np.divide(*counts[:, documents].sum(axis=-1)),
        n,
        true_f1["strict"],
        rng,
    )


@cache
def _truth(name: str) -> tuple[float, dict[SpanMatch, float]]:
    """Return α, and F1 by match, of very many documents."""
    rng = np.random.default_rng([SEED, len(name)])
    rows, lengths, _ = _annotated(name, N_FOR_TRUTH, rng)
    matches = get_args(SpanMatch)
    f1 = {match: span_f1(rows, match=match)[0, 1].value for match in matches}
    return unitizing_alpha(rows, length=lengths).value, f1


def _annotated(
    name: str, n: int, rng: np.random.Generator
) -> tuple[pd.DataFrame, dict[int, int], Integers]:
    """Return spans of three observers, lengths of documents, and matches in each.

    Matches are those of the first two, (2, n): strictly matched spans, and all spans.
    """
    lengths = rng.integers(300, 1201, n)
    document = np.arange(n).repeat(lengths // SLOT)
    slot = np.concatenate([np.arange(k) for k in lengths // SLOT])
    size = (3, len(document))
    # some texts are harder than others
    misses, moves = np.outer(OBSERVERS[name], rng.uniform(0.0, 2.0, n)).clip(max=1.0)
    is_there = rng.random(size) >= misses[document]
    is_moved = rng.random((2, *size)) < moves[document]
    begin = SLOT * slot + rng.integers(5, 25, len(slot))
    begin = begin + is_moved[0] * rng.integers(-4, 5, size)
    length = rng.integers(5, 25, len(slot)) + is_moved[1] * rng.integers(-3, 8, size)
    observer, of = np.nonzero(is_there)
    ends = {"begin": begin[is_there], "length": length[is_there]}
    looks = pd.DataFrame(np.ndindex(n, 3), columns=["document", "observer"])
    marks = pd.DataFrame({"document": document[of], "observer": observer, **ends})
    rows = pd.concat([looks, marks.assign(category=1)])
    is_alike = (begin[0] == begin[1]) & (length[0] == length[1])
    same = is_alike & is_there[:2].all(axis=0)
    matched = [np.bincount(document, of, n) for of in (2 * same, is_there[:2].sum(0))]
    return rows, dict(enumerate(lengths.tolist())), np.array(matched)


def write_pages(rows: pd.DataFrame) -> None:
    """Write the tables of three pages."""
    shown = rows.assign(shown=percent(rows).map("{:.0f}".format))
    for page, part, what, units in (
        ("limits_with_repeats", "resampling", "limits", "items"),
        ("generalizability", "resampling", "Φ of 3 raters", "persons"),
        ("generalizability", "teeth", "Φ of a rating of a tooth", "patients"),
        ("spans", "resampling", "spans", "documents"),
    ):
        of = shown[shown["what"].str.startswith(what)]
        text = crossed(of, {"what": "coverage in % of", "n": units})
        write_part(DOCS / "reference" / "coefficients" / f"{page}.md", part, text)
