"""What the page of training says of its test, measured on simulated trainees.

``python -m docs.make.training [TRAINEES]`` writes the tables of
``docs/evidence/training.md``, and prints what its text says; 4 000 trainees of each
kind take some ten minutes.
"""

import sys
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from docs.make.evidence import EVIDENCE, table, write_part
from masrel.lab.protocol import Training
from masrel.lab.training._criterion import Criterion, calibrate
from masrel.lab.training._trainees import (
    SKILLS,
    adaptive_weights,
    confusion,
    confusion_with_kappa,
    draw_blocks,
    draw_grades,
    draw_training,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Drawn = tuple[Integers, Integers, Floats | None]
"""Intended grades, those of trainees, and what each counts: (n, n_presentations)."""

RULES = Training()
GRADES = ("0", "1", "1+", "2", "3", "4")
INTENDED = (1, 2, 3, 4)  # of HM1 to HM4
SEED = 2012
WORDS = {
    "noise": "confuses neighbours",
    "range": "and gives only grades that models have",
    "lapses": "and lapses in a tenth",
    "shift": "and grades too high",
    "pair": "confuses two models",
}
NAMES = {
    "insufficient": "insufficient κ",
    "sufficient": "sufficient κ",
    "max_presentations": "at most",
    "window": "window",
    "order": "order",
    "weights": "weights",
}
SETTINGS: list[dict[str, object]] = [
    {"max_presentations": 60},
    {"max_presentations": 80},
    {},
    {"max_presentations": 200},
    {"window": 32},
    {"window": 120},
    {"order": "adaptive"},
    {"sufficient": 0.85},
    {"insufficient": 0.7, "sufficient": 0.9},
    {"weights": "quadratic", "insufficient": 0.7, "sufficient": 0.9},
    {"weights": "identity", "insufficient": 0.4, "sufficient": 0.7},
]
GROUPS = (24, 40, 60)  # presentations


def criterion(**changes: object) -> Criterion:
    """Return the test of a protocol that says nothing about it."""
    default = Criterion(
        grades=GRADES,
        weights=RULES.weights,
        intended=INTENDED,
        insufficient=RULES.kappa_insufficient,
        sufficient=RULES.kappa_sufficient,
        window=RULES.window,
        max_presentations=RULES.max_presentations,
    )
    return replace(default, **changes)  # type: ignore[arg-type]


def boundary_of(rule: Criterion) -> float:
    """Return the boundary that `masrel train` would find."""
    return calibrate(rule, false_pass=RULES.false_pass, rng=RULES.seed).boundary


def tables_with(rule: Criterion, kappa: float) -> dict[str, Floats]:
    """Return the confusions of every kind that can have a kappa."""
    tables = {
        skill: confusion_with_kappa(
            skill, kappa, rule.kappa, len(rule.grades), rule.intended
        )
        for skill in SKILLS
    }
    return {skill: table for skill, table in tables.items() if table is not None}


def drawn_with(
    rule: Criterion, kappa: float, n: int, length: int, rng: np.random.Generator
) -> dict[str, Drawn]:
    """Return trainings of every kind of trainee that can have a kappa."""
    return {
        skill: draw_training(of, rule.intended, rule.order, (n, length), rng)
        for skill, of in tables_with(rule, kappa).items()
    }


def first_looks(passes: NDArray[np.bool_], size: int) -> tuple[Floats, Floats]:
    """Return whether trainees pass, and their presentations, with a look after each."""
    has_passed = passes.any(axis=1)
    looks = np.where(has_passed, passes.argmax(axis=1) + 1, passes.shape[1])
    return has_passed.astype(np.float64), looks * float(size)


def lengths(rule: Criterion, drawn: Drawn, boundary: float) -> tuple[Floats, Floats]:
    """Return whether trainees pass the test, and their presentations: both (n,)."""
    return first_looks(rule.evidence(*drawn) >= boundary, rule.n_models)


def in_words(outcome: tuple[Floats, Floats]) -> str:
    """Return the share that passes, and the mean number of presentations."""
    passed, length = outcome
    return f"{percent(float(passed.mean()))}, {length.mean():.1f}"


def sequential(
    rule: Criterion, boundary: float, kappa: float, n: int, rng: np.random.Generator
) -> dict[str, tuple[Floats, Floats]]:
    """Return who passes and their presentations, by kind."""
    drawn = drawn_with(rule, kappa, n, rule.max_presentations, rng)
    return {skill: lengths(rule, of, boundary) for skill, of in drawn.items()}


def worst(outcomes: dict[str, tuple[Floats, Floats]]) -> tuple[float, float, float]:
    """Return the highest share that passes and that fails, and the longest mean."""
    means = [
        (of.mean(), 1.0 - of.mean(), long.mean()) for of, long in outcomes.values()
    ]
    passes, fails, length = np.max(means, axis=0)
    return float(passes), float(fails), float(length)


def fixed_number(rule: Criterion, false_pass: float, false_fail: float, n: int) -> int:
    """Return the fewest presentations with both errors."""
    sets = range(3, 400 // rule.n_models)

    def is_enough(n_sets: int) -> bool:
        fails, _ = fixed_errors(rule, n_sets * rule.n_models, false_pass, n)
        return fails <= false_fail

    return (3 + bisect_left(sets, True, key=is_enough)) * rule.n_models


def fixed_errors(
    rule: Criterion, length: int, false_pass: float, n: int
) -> tuple[float, float]:
    """Return the largest false fail of a fixed number, and the kappa to reach.

    Every trainee has as many presentations, and passes if kappa of all is that high.
    """
    rng = np.random.default_rng(SEED)
    bad, good = (
        [kappa_of_all(rule, *of) for of in drawn_with(rule, k, n, length, rng).values()]
        for k in (rule.insufficient, rule.sufficient)
    )
    limit = max(np.quantile(k, 1.0 - false_pass, method="higher") for k in bad)
    return max(float((k <= limit).mean()) for k in good), float(limit)


def kappa_of_all(
    rule: Criterion,
    intended: Integers,
    codes: Integers,
    weights: Floats | None = None,
) -> Floats:
    """Return kappa of all presentations of each trainee: (n,)."""
    n_presentations = intended.shape[1]
    whole = replace(
        rule,
        intended=tuple(intended[0].tolist()),  # a set as large as the training
        insufficient=-1.0,
        sufficient=1.0,  # the evidence is n times (kappa - 0)
        window=n_presentations,
    )
    return whole.evidence(intended, codes, weights)[:, 0] / n_presentations


def percent(share: float) -> str:
    """Return a share of trainees, in percent."""
    return f"{100.0 * share:.1f} %"


def constant_skill(n: int) -> str:
    """Return errors and lengths at constant skill."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary = boundary_of(rule)
    by_kappa = {
        kappa: sequential(rule, boundary, kappa, n, rng)
        for kappa in (0.5, rule.insufficient, 0.7, rule.sufficient, 0.9)
    }
    false_pass, _, _ = worst(by_kappa[rule.insufficient])
    _, false_fail, mean = worst(by_kappa[rule.sufficient])
    number = fixed_number(rule, false_pass, false_fail, n)
    limit = fixed_errors(rule, number, false_pass, n)[1]
    print(
        f"boundary {boundary:.3f}; fixed number with false pass {percent(false_pass)} "
        f"and false fail {percent(false_fail)}: {number}, κ above {limit:.3f}; the "
        f"test needs {mean:.1f} at most on average at κ = {rule.sufficient:g}: "
        f"{percent(1.0 - mean / number)} fewer"
    )
    lines = [
        [
            word,
            *(in_words(of[skill]) if skill in of else "–" for of in by_kappa.values()),
        ]
        for skill, word in WORDS.items()
    ]
    return table(["trainee", *(f"κ = {kappa:g}" for kappa in by_kappa)], lines)


def other_settings(n: int) -> str:
    """Return what comes of settings other than the defaults."""
    head = [
        "settings",
        "boundary",
        "false fail",
        "mean length",
        "fixed number",
        "fewer",
    ]
    lines = []
    for change in SETTINGS:
        rule, rng = criterion(**change), np.random.default_rng(SEED)
        boundary = boundary_of(rule)
        passes, _, _ = worst(sequential(rule, boundary, rule.insufficient, n, rng))
        _, fails, mean = worst(sequential(rule, boundary, rule.sufficient, n, rng))
        number = fixed_number(replace(rule, order="blocked"), passes, fails, n)
        words = ", ".join(f"{NAMES[k]} {v}" for k, v in change.items()) or "defaults"
        numbers = f"{boundary:.2f}", percent(fails), f"{mean:.1f}", number
        lines.append([words, *numbers, percent(1.0 - mean / number)])
    return table(head, lines)


def blocks(n: int, n_presentations: int, rng: np.random.Generator) -> Integers:
    """Return intended grades in random order: (n, n_presentations)."""
    models = draw_blocks(len(INTENDED), (n, n_presentations), rng)
    return np.asarray(INTENDED)[models]


def noise(amount: float) -> Floats:
    """Return the confusion of trainees who confuse neighbours."""
    return confusion("noise", amount, len(GRADES), INTENDED)


def noise_with_kappa(rule: Criterion, kappa: float) -> float:
    """Return the noise of trainees who confuse neighbours, with a kappa."""
    return float(brentq(lambda x: rule.kappa(noise(x)) - kappa, 1e-3, 50.0, xtol=1e-14))


def less_noise(
    rule: Criterion, first: float, last: float, learnt: Floats
) -> list[Floats]:
    """Return confusions from one kappa, where nothing is learnt, towards another."""
    of_first, of_last = (noise_with_kappa(rule, kappa) for kappa in (first, last))
    return [noise(of_last + (of_first - of_last) * left) for left in learnt]


def learners(n: int) -> str:
    """Return what comes of trainees who learn, from kappa 0.3 to some at some pace."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary, at = boundary_of(rule), np.arange(rule.max_presentations)
    groups = {size: grouped_test(rule, size, n) for size in GROUPS}
    head = ["κ in the end", "pace", "passes", "mean", "passes below 0.6"]
    head += ["κ when passing: 10 %", "median"]
    head += [f"groups of {size}: passes, mean" for size in GROUPS]
    lines = []
    for kappa, pace in np.ndindex(4, 3):
        end, pace = 0.6 + 0.1 * kappa, 8 * 2**pace
        tables = np.array(less_noise(rule, 0.3, end, np.exp(-at / pace)))
        now = np.array([rule.kappa(of) for of in tables])
        intended = blocks(n, rule.max_presentations, rng)
        codes = draw_grades(tables[at, intended], rng)
        passed, length = lengths(rule, (intended, codes, None), boundary)
        reached = now[length[passed > 0].astype(int) - 1]
        early = float((reached < rule.insufficient).sum() / n)
        quantiles = np.quantile(reached, [0.1, 0.5]) if reached.size else [np.nan] * 2
        cells = [f"{end:g}", pace, *in_words((passed, length)).split(", ")]
        cells += [percent(early), *(f"{x:.2f}" for x in quantiles)]
        for size, limit in groups.items():
            passes = group_kappas(rule, size, intended, codes) > limit
            cells.append(in_words(first_looks(passes, size)))
        lines.append(cells)
    return table(head, lines)


def grouped_test(rule: Criterion, size: int, n: int) -> float:
    """Return the kappa to reach in any group of fixed size, at the same false pass."""
    rng = np.random.default_rng(SEED)
    drawn = drawn_with(rule, rule.insufficient, n, rule.max_presentations, rng)
    best = [np.max(group_kappas(rule, size, *of[:2]), axis=1) for of in drawn.values()]
    quantile = 1.0 - RULES.false_pass
    return max(float(np.quantile(of, quantile, method="higher")) for of in best)


def group_kappas(
    rule: Criterion, size: int, intended: Integers, codes: Integers
) -> Floats:
    """Return kappa of each group of so many presentations: (n, n_groups)."""
    groups = [
        kappa_of_all(
            rule, intended[:, start : start + size], codes[:, start : start + size]
        )
        for start in range(0, intended.shape[1] - size + 1, size)
    ]
    return np.nan_to_num(np.column_stack(groups), nan=-1.0)


def beyond(n: int) -> str:
    """Return how many pass on whom the test is not calibrated."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary, shape = boundary_of(rule), (n, rule.max_presentations)
    guess = np.full((6, 6), 1.0 / 6.0) / 3.0 + 2.0 * np.eye(6) / 3.0
    lines = []
    for name, drawn in (
        (
            "gives any grade in a third, else right",
            draw_training(guess, INTENDED, rule.order, shape, rng),
        ),
        ("gives only grades that models have", counting(rule, None, n, rng)),
        ("the same, and counts", counting(rule, _likely, n, rng)),
        ("the same, were blocks of each model twice", counting(rule, _left, n, rng)),
    ):
        passed, _ = lengths(rule, drawn, boundary)
        lines.append([name, percent(float(passed.mean()))])
    good, bad = (noise(noise_with_kappa(rule, kappa)) for kappa in (0.8, 0.4))
    intended, at = blocks(*shape, rng), np.arange(shape[1])
    tables = np.where(at[:, None, None] < 16, good, bad)
    codes = draw_grades(tables[at, intended], rng)
    passed, length = lengths(rule, (intended, codes, None), boundary)
    early = float((length[passed > 0] <= 16).sum() / n)
    print(
        f"κ 0.8 for 16 presentations, then 0.4: {percent(early)} pass in the first 16, "
        f"{percent(float(passed.mean()) - early)} later"
    )
    return table(["trainee, κ = 0.6", "passes"], lines)


def counting(
    rule: Criterion,
    likely: Callable[[Integers, int], Floats] | None,
    n: int,
    rng: np.random.Generator,
) -> Drawn:
    """Draw trainees who know how likely each model is by what its block has had so far.

    Blocks have each model at least once, or, if they know what is left, twice.
    """
    table = tables_with(rule, rule.insufficient)["range"]
    size = 8 if likely is _left else 12
    n_blocks = rule.max_presentations // size
    if likely is _left:
        block = np.tile(np.repeat(INTENDED, 2), (n * n_blocks, 1))
        intended = rng.permuted(block, axis=1)
    else:
        intended = blocks(n, n_blocks * size, rng).reshape(-1, size)
    codes = np.empty_like(intended)
    for at in range(size):
        rows = table[intended[:, at]] * (likely(intended, at) if likely else 1.0)
        codes[:, at] = draw_grades(rows / rows.sum(axis=1, keepdims=True), rng)
    return intended.reshape(n, -1), codes.reshape(n, -1), None


def _left(intended: Integers, at: int) -> Floats:
    # how often each grade still comes in blocks that have each twice: (n_blocks, 6)
    return (intended[:, at:, None] == np.arange(6)).sum(axis=1).astype(np.float64)


def _likely(intended: Integers, at: int) -> Floats:
    # chances of each grade in blocks that have each at least once: (n_blocks, 6)
    n_models, after = len(INTENDED), intended.shape[1] - at - 1
    # in how many ways the rest of a block has the models that it still has to have
    ways = np.array([
        sum((-1) ** j * comb(k, j) * (n_models - j) ** after for j in range(k + 1))
        for k in range(n_models + 1)
    ], dtype=np.float64)  # fmt: skip
    is_seen = (intended[:, :at, None] == np.arange(6)).any(axis=1)
    n_unseen = n_models - is_seen.sum(axis=1, keepdims=True)
    return np.where(is_seen, ways[n_unseen], ways[np.maximum(n_unseen - 1, 0)])


def orders(n: int) -> str:
    """Return both orders, for trainees who learn each model by meeting it."""
    rules = [criterion(order=order) for order in ("blocked", "adaptive")]
    boundaries = [boundary_of(rule) for rule in rules]
    lines = []
    for hardest in (4.0, 8.0, 16.0):
        paces = np.array([4.0, 4.0, hardest, 4.0])
        outcomes = (
            in_words(lengths(rule, learnt_by_meeting(rule, paces, n), boundary))
            for rule, boundary in zip(rules, boundaries, strict=True)
        )
        lines.append([f"{hardest:g}", *outcomes])
    head = ["pace of the hardest model", "blocked: passes, mean", "adaptive"]
    return table(head, lines)


def learnt_by_meeting(rule: Criterion, paces: Floats, n: int) -> Drawn:
    """Draw trainees whose noise falls, for each model, as they meet that model."""
    rng, codes, trainees = np.random.default_rng(SEED), np.array(INTENDED), np.arange(n)
    meetings = np.arange(rule.max_presentations)
    # chances of grades by meetings and model
    by_model = [less_noise(rule, 0.3, 0.9, np.exp(-meetings / pace)) for pace in paces]
    rows = np.stack(
        [np.array(of)[:, grade] for of, grade in zip(by_model, codes, strict=True)],
        axis=1,
    )
    met, wrong = np.zeros((2, n, len(codes)), dtype=np.int64)
    models = draw_blocks(len(codes), (n, rule.max_presentations), rng)
    grades = np.empty_like(models)
    for at in meetings:
        if rule.order == "adaptive":
            shares = (1 + wrong).cumsum(axis=1)
            drawn = rng.integers(0, shares[:, -1])[:, None]
            models[:, at] = (drawn >= shares).sum(axis=1)
        model = models[:, at]
        grades[:, at] = draw_grades(rows[met[trainees, model], model], rng)
        met[trainees, model] += 1
        wrong[trainees, model] = grades[:, at] != codes[model]
    intended = codes[models]
    if rule.order == "blocked":
        return intended, grades, None
    return intended, grades, adaptive_weights(models, grades != intended, len(codes))


def tables(n: int) -> Iterator[tuple[str, str]]:
    """Yield the parts of the page."""
    for of in (constant_skill, other_settings, learners, beyond, orders):
        yield of.__name__.replace("_", " "), of(n)


if __name__ == "__main__":
    for name, text in tables(int(sys.argv[1]) if len(sys.argv) > 1 else 4_000):
        write_part(EVIDENCE / "training.md", name, text)
