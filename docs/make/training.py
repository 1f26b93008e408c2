"""What the page of training says of its test, measured on simulated trainees.

``python -m docs.make.training [TRAINEES]`` prints the tables; 4 000 trainees of each
kind take some ten minutes.
"""

import sys
from dataclasses import replace
from math import comb

import numpy as np
from numpy.typing import NDArray

from masrel.intervals import estimate
from masrel.lab.protocol import Training
from masrel.lab.training import Criterion, calibrate, confusion
from masrel.lab.training._criterion import Calibration
from masrel.lab.training._trainees import (
    SKILLS,
    adaptive_weights,
    confusion_with_kappa,
    draw_blocks,
    draw_grades,
    draw_training,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

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


def criterion(**changes: object) -> Criterion:
    """The test as a protocol has it that says nothing."""
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


def calibrated(rule: Criterion, false_pass: float = RULES.false_pass) -> Calibration:
    """The boundary that `masrel train` would find."""
    return calibrate(rule, false_pass=false_pass, rng=RULES.seed)


def grades_of(
    rule: Criterion, table: Floats, shape: tuple[int, int], rng: np.random.Generator
) -> tuple[Integers, Integers, Floats | None]:
    """Intended grades, those of trainees of one confusion, and what each counts."""
    return draw_training(table, rule.intended, rule.order, shape, rng)


def tables_with(rule: Criterion, kappa: float) -> dict[str, Floats]:
    """The confusions of every kind that can have a kappa."""
    tables = {
        skill: confusion_with_kappa(
            skill, kappa, rule.kappa, len(rule.grades), rule.intended
        )
        for skill in SKILLS
    }
    return {skill: table for skill, table in tables.items() if table is not None}


def lengths(
    rule: Criterion, evidence: Floats, boundary: float
) -> tuple[Floats, Floats]:
    """Whether trainees pass, and their presentations: both (n,)."""
    passes = evidence >= boundary
    has_passed = passes.any(axis=1)
    looks = np.where(has_passed, passes.argmax(axis=1) + 1, evidence.shape[1])
    return has_passed.astype(np.float64), looks * float(rule.n_models)


def sequential(
    rule: Criterion, boundary: float, kappa: float, n: int, rng: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Share that passes and mean presentations, by kind."""
    result = {}
    for skill, table in tables_with(rule, kappa).items():
        drawn = grades_of(rule, table, (n, rule.max_presentations), rng)
        passed, length = lengths(rule, rule.evidence(*drawn), boundary)
        result[skill] = float(passed.mean()), float(length.mean())
    return result


def fixed_number(
    rule: Criterion, false_pass: float, false_fail: float, n: int
) -> tuple[int, float]:
    """The fewest presentations with both errors, and the kappa to reach."""
    few, enough = 2, 400 // rule.n_models  # in sets
    limit = np.nan
    while enough - few > 1:
        middle = (few + enough) // 2
        fails, of_middle = fixed_errors(rule, middle * rule.n_models, false_pass, n)
        if fails <= false_fail:
            enough, limit = middle, of_middle
        else:
            few = middle
    return enough * rule.n_models, limit


def fixed_errors(
    rule: Criterion, n_presentations: int, false_pass: float, n: int
) -> tuple[float, float]:
    """The largest false fail of a fixed number of presentations, and kappa to reach.

    Every trainee has as many, and passes if kappa of all of them is that high.
    """
    rng = np.random.default_rng(SEED)

    def kappas(kappa: float) -> list[Floats]:
        shape = n, n_presentations
        drawn = (
            grades_of(rule, t, shape, rng) for t in tables_with(rule, kappa).values()
        )
        return [kappa_of_all(rule, *grades) for grades in drawn]

    limit = max(
        np.quantile(k, 1.0 - false_pass, method="higher")
        for k in kappas(rule.insufficient)
    )
    fails = max(float((k <= limit).mean()) for k in kappas(rule.sufficient))
    return fails, float(limit)


def kappa_of_all(
    rule: Criterion,
    intended: Integers,
    codes: Integers,
    weights: Floats | None = None,
) -> Floats:
    """Kappa of all presentations of each trainee: (n,)."""
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
    """A share of trainees, in percent."""
    return f"{100.0 * share:.1f} %"


def constant_skill(n: int) -> None:
    """Errors and lengths at constant skill, and the fixed number of equal error."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary = calibrated(rule).boundary
    by_kappa = {
        kappa: sequential(rule, boundary, kappa, n, rng)
        for kappa in (0.5, rule.insufficient, 0.7, rule.sufficient, 0.9)
    }
    print(f"boundary {boundary:.3f}\n")
    print("| trainee | " + " | ".join(f"κ = {k:g}" for k in by_kappa) + " |")
    print("|---|" + "---|" * len(by_kappa))
    for skill in SKILLS:
        cells = [
            f"{percent(of[skill][0])}, {of[skill][1]:.1f}" if skill in of else "–"
            for of in by_kappa.values()
        ]
        print(f"| {WORDS[skill]} | " + " | ".join(cells) + " |")
    false_pass = max(p for p, _ in by_kappa[rule.insufficient].values())
    false_fail = max(1.0 - p for p, _ in by_kappa[rule.sufficient].values())
    number, limit = fixed_number(rule, false_pass, false_fail, n)
    mean = max(m for _, m in by_kappa[rule.sufficient].values())
    print(
        f"\nfixed number with false pass {percent(false_pass)} and false fail "
        f"{percent(false_fail)}: {number}, κ above {limit:.3f}; the test needs at most "
        f"{mean:.1f} in the mean at κ = {rule.sufficient:g}: "
        f"{percent(1.0 - mean / number)} fewer\n"
    )


def other_settings(n: int) -> None:
    """Settings other than the defaults."""
    print("| settings | boundary | false fail | mean length | fixed number | fewer |")
    print("|---|---|---|---|---|---|")
    changes: list[dict[str, object]] = [
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
    for change in changes:
        rule = criterion(**change)
        boundary = calibrated(rule).boundary
        rng = np.random.default_rng(SEED)
        bad = sequential(rule, boundary, rule.insufficient, n, rng)
        good = sequential(rule, boundary, rule.sufficient, n, rng)
        fails = max(1.0 - p for p, _ in good.values())
        mean = max(m for _, m in good.values())
        blocked = replace(rule, order="blocked")
        number, _ = fixed_number(blocked, max(p for p, _ in bad.values()), fails, n)
        words = ", ".join(f"{NAMES[k]} {v}" for k, v in change.items()) or "defaults"
        print(
            f"| {words} | {boundary:.2f} | {percent(fails)} | {mean:.1f} | {number} | "
            f"{percent(1.0 - mean / number)} |"
        )
    print()


def blocks(n: int, n_presentations: int, rng: np.random.Generator) -> Integers:
    """Intended grades in random order: (n, n_presentations)."""
    models = draw_blocks(len(INTENDED), (n, n_presentations), rng)
    return np.asarray(INTENDED)[models]


def learning_tables(
    rule: Criterion, first: float, last: float, pace: float
) -> tuple[Floats, Floats]:
    """Confusion, (n_presentations, n_grades, n_grades), and kappa at each of them."""
    learnt = np.exp(-np.arange(rule.max_presentations) / pace)
    tables = np.array(
        [
            confusion("noise", last + (first - last) * one, len(GRADES), INTENDED)
            for one in learnt
        ]
    )
    return tables, np.array([rule.kappa(table) for table in tables])


def noise_with_kappa(rule: Criterion, kappa: float) -> float:
    """Noise of trainees who confuse neighbours, with a kappa."""
    low, high = 1e-3, 50.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        of_middle = rule.kappa(confusion("noise", middle, len(GRADES), INTENDED))
        low, high = (middle, high) if of_middle > kappa else (low, middle)
    return low


def learners(n: int) -> None:
    """Trainees who begin at kappa 0.3 and come to some kappa at some pace."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary = calibrated(rule).boundary
    groups = [(size, grouped_test(rule, size, n)) for size in (24, 40, 60)]
    heads = ["κ in the end", "pace", "passes", "mean", "passes below 0.6"]
    heads += ["κ when passing: 10 %", "median"]
    heads += [f"groups of {size}: passes, mean" for size, _ in groups]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    first = noise_with_kappa(rule, 0.3)
    for kappa in (0.6, 0.7, 0.8, 0.9):
        for pace in (8, 16, 32):
            tables, now = learning_tables(
                rule, first, noise_with_kappa(rule, kappa), float(pace)
            )
            intended = blocks(n, rule.max_presentations, rng)
            at = np.arange(rule.max_presentations)
            codes = draw_grades(tables[at, intended], rng)
            passed, length = lengths(rule, rule.evidence(intended, codes), boundary)
            reached = now[length[passed > 0].astype(int) - 1]
            early = float((reached < rule.insufficient).sum() / n)
            tenth, median = (
                np.quantile(reached, [0.1, 0.5]) if reached.size else (np.nan, np.nan)
            )
            others = [
                group_outcome(rule, size, limit, intended, codes)
                for size, limit in groups
            ]
            cells = [f"{kappa:g}", str(pace), percent(float(passed.mean()))]
            cells += [f"{length.mean():.1f}", percent(early)]
            cells += [f"{tenth:.2f}", f"{median:.2f}"]
            cells += [f"{percent(p)}, {m:.1f}" for p, m in others]
            print(f"| {' | '.join(cells)} |")
    print()


def grouped_test(rule: Criterion, size: int, n: int) -> float:
    """The kappa to reach in any group of fixed size, at the same false pass."""
    rng = np.random.default_rng(SEED)
    limits = []
    for table in tables_with(rule, rule.insufficient).values():
        drawn = grades_of(rule, table, (n, rule.max_presentations), rng)
        best = np.max(group_kappas(rule, size, *drawn[:2]), axis=1)
        limits.append(np.quantile(best, 1.0 - RULES.false_pass, method="higher"))
    return float(max(limits))


def group_kappas(
    rule: Criterion, size: int, intended: Integers, codes: Integers
) -> Floats:
    """Kappa of each group of so many presentations: (n, n_groups)."""
    starts = range(0, intended.shape[1] - size + 1, size)
    return np.column_stack(
        [
            np.nan_to_num(
                kappa_of_all(rule, intended[:, s : s + size], codes[:, s : s + size]),
                nan=-1.0,
            )
            for s in starts
        ]
    )


def group_outcome(
    rule: Criterion, size: int, limit: float, intended: Integers, codes: Integers
) -> tuple[float, float]:
    """Share that passes and mean presentations, tested after every group."""
    passes = group_kappas(rule, size, intended, codes) > limit
    has_passed = passes.any(axis=1)
    groups = np.where(has_passed, passes.argmax(axis=1) + 1, passes.shape[1])
    return float(has_passed.mean()), float((groups * size).mean())


def beyond(n: int) -> None:
    """Trainees on whom the test is not calibrated."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary = calibrated(rule).boundary
    shape = n, rule.max_presentations

    def show(
        name: str, intended: Integers, codes: Integers, weights: Floats | None = None
    ) -> None:
        passed, _ = lengths(rule, rule.evidence(intended, codes, weights), boundary)
        print(f"| {name} | {percent(float(passed.mean()))} |")

    print("| trainee, κ = 0.6 | passes |\n|---|---|")
    guess = np.full((6, 6), 1.0 / 6.0) / 3.0 + 2.0 * np.eye(6) / 3.0
    show("gives any grade in a third, else right", *grades_of(rule, guess, shape, rng))
    show("gives only grades that models have", *counting(rule, None, n, rng))
    show("the same, and counts", *counting(rule, False, n, rng))
    show("the same, were blocks of each model twice", *counting(rule, True, n, rng))
    good = confusion("noise", noise_with_kappa(rule, 0.8), 6, INTENDED)
    bad = confusion("noise", noise_with_kappa(rule, 0.4), 6, INTENDED)
    intended = blocks(*shape, rng)
    tables = np.where(np.arange(shape[1])[:, None, None] < 16, good, bad)
    codes = draw_grades(tables[np.arange(shape[1]), intended], rng)
    passed, length = lengths(rule, rule.evidence(intended, codes), boundary)
    early = float((length[passed > 0] <= 16).sum() / n)
    later = float(passed.mean()) - early
    print(
        f"\nκ 0.8 for 16 presentations, then 0.4: {percent(early)} pass in the first "
        f"16, {percent(later)} later\n"
    )


def counting(
    rule: Criterion, is_even: bool | None, n: int, rng: np.random.Generator
) -> tuple[Integers, Integers]:
    """Trainees who know how likely each model is by what its block has had so far.

    Blocks have each model at least once, or twice if even; None is who counts nothing.
    """
    table = tables_with(rule, rule.insufficient)["range"]
    size = 8 if is_even else 12
    n_blocks = rule.max_presentations // size
    if is_even:
        block = np.tile(np.repeat(INTENDED, 2), (n * n_blocks, 1))
        intended = rng.permuted(block, axis=1)
    else:
        intended = blocks(n, n_blocks * size, rng).reshape(-1, size)
    codes = np.empty_like(intended)
    for at in range(size):
        rows = table[intended[:, at]]
        if is_even is not None:
            rows = rows * (_left if is_even else _likely)(intended, at)
        codes[:, at] = draw_grades(rows / rows.sum(axis=1, keepdims=True), rng)
    return intended.reshape(n, -1), codes.reshape(n, -1)


def _left(intended: Integers, at: int) -> Floats:
    # how often each grade still comes in blocks that have each twice: (n_blocks, 6)
    return (intended[:, at:, None] == np.arange(6)).sum(axis=1).astype(np.float64)


def _likely(intended: Integers, at: int) -> Floats:
    # chances of each grade in blocks that have each at least once: (n_blocks, 6)
    n_models, size = len(INTENDED), intended.shape[1]

    def ways(n_unseen: int, n_places: int) -> float:
        return float(
            sum(
                (-1) ** j * comb(n_unseen, j) * (n_models - j) ** n_places
                for j in range(n_unseen + 1)
            )
        )

    is_seen = (intended[:, :at, None] == np.arange(6)).any(axis=1)
    n_unseen = n_models - is_seen.sum(axis=1)
    after = size - at - 1
    of_seen = np.array([ways(u, after) for u in range(n_models + 1)])
    of_unseen = np.array([ways(max(u - 1, 0), after) for u in range(n_models + 1)])
    return np.where(is_seen, of_seen[n_unseen, None], of_unseen[n_unseen, None])


def orders(n: int) -> None:
    """Blocked and adaptive, for trainees who learn each model by meeting it."""
    print("| pace of the hardest model | blocked: passes, mean | adaptive |")
    print("|---|---|---|")
    for hardest in (4.0, 8.0, 16.0):
        paces = np.array([4.0, 4.0, hardest, 4.0])
        cells = []
        for order in ("blocked", "adaptive"):
            rule = criterion(order=order)
            drawn = learnt_by_meeting(rule, paces, n)
            passed, length = lengths(
                rule, rule.evidence(*drawn), calibrated(rule).boundary
            )
            cells.append(f"{percent(float(passed.mean()))}, {length.mean():.1f}")
        print(f"| {hardest:g} | {' | '.join(cells)} |")
    print()


def learnt_by_meeting(
    rule: Criterion, paces: Floats, n: int
) -> tuple[Integers, Integers, Floats | None]:
    """Grades of trainees whose noise falls, of each model, as they meet that model."""
    rng = np.random.default_rng(SEED)
    first, last = noise_with_kappa(rule, 0.3), noise_with_kappa(rule, 0.9)
    learnt = np.exp(-np.arange(rule.max_presentations)[:, None] / paces)  # by meetings
    rows = np.array(
        [
            [
                confusion("noise", last + (first - last) * share, 6, INTENDED)[grade]
                for share, grade in zip(shares, INTENDED, strict=True)
            ]
            for shares in learnt
        ]
    )
    trainees, codes = np.arange(n), np.asarray(INTENDED)
    met, wrong = np.zeros((2, n, len(INTENDED)), dtype=np.int64)
    fixed = draw_blocks(len(INTENDED), (n, rule.max_presentations), rng)
    drawn = fixed.copy()
    intended, grades = np.empty((2, n, rule.max_presentations), dtype=np.int64)
    for at in range(rule.max_presentations):
        models = fixed[:, at]
        if rule.order == "adaptive":
            shares = (1 + wrong).cumsum(axis=1)
            models = (rng.integers(0, shares[:, -1])[:, None] >= shares).sum(axis=1)
        drawn[:, at], intended[:, at] = models, codes[models]
        grades[:, at] = draw_grades(rows[met[trainees, models], models], rng)
        met[trainees, models] += 1
        wrong[trainees, models] = grades[:, at] != intended[:, at]
    if rule.order == "blocked":
        return intended, grades, None
    return intended, grades, adaptive_weights(drawn, grades != intended, len(codes))


def coverage(n: int) -> None:
    """How often the interval of one point of the curve has the kappa."""
    rule, rng = criterion(), np.random.default_rng(SEED)
    print("| κ | 8 presentations | 16 |\n|---|---|---|")
    for kappa in (0.4, 0.6, 0.8, 0.9):
        table = tables_with(rule, kappa)["range"]
        cells = []
        for size in (8, 16):
            drawn = grades_of(rule, table, (n, size), rng)
            cells.append(percent(_covered(rule, kappa, *drawn[:2])))
        print(f"| {kappa:g} | " + " | ".join(cells) + " |")
    print()


def _covered(
    rule: Criterion, kappa: float, intended: Integers, codes: Integers
) -> float:
    import warnings

    known: dict[bytes, bool] = {}
    covers = []
    for one, other in zip(intended, codes, strict=True):
        freq = np.bincount(one * 6 + other, minlength=36)
        key = freq.tobytes()
        if key not in known:
            pairs = [(GRADES[i], GRADES[j]) for i, j in zip(one, other, strict=True)]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                interval = estimate(
                    "cohen_kappa",
                    pairs,
                    target="items",
                    categories=GRADES,
                    weights=rule.weights,
                ).interval
            known[key] = interval is not None and interval.low <= kappa <= interval.high
        covers.append(known[key])
    return float(np.mean(covers))


def main(n: int) -> None:
    """Print every table."""
    print(f"{n} trainees of each kind, seed {SEED}\n")
    constant_skill(n)
    other_settings(n)
    learners(n)
    beyond(n)
    orders(n)
    coverage(n // 4)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4_000)
