"""Stratified kappa: agreement of raters with themselves, over several raters."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import CodedRatings, Label, code_ratings
from masrel.agreement.cohen import pair_features, pair_table
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.undefined import defined, kappa, ratio
from masrel.errors import RatingsError
from masrel.estimates import Estimate

__all__ = ["STRATIFIED_KERNEL", "code_strata", "stratified_kappa"]


def stratified_kappa(
    pairs: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate one kappa over raters who each rated the same items twice.

    Each rater is a stratum with margins of its own. The estimate is
    Σ(p_o - p_e) / Σ(1 - p_e) over strata, so it stays defined when the kappa of one
    rater is not.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        The coefficient; `observed` and `chance` are means over the raters used. The
        standard error takes items as the sample, each with all its raters.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.

    Warns
    -----
    UndefinedStatisticWarning
        If no rater has a pair, or every rater used one category throughout.

    Notes
    -----
    A rater without any pair of grades is left out. Pooling the pairs of all raters
    into one Cohen's kappa is another estimand, and not this one.

    References
    ----------
    .. [1] Barlow, W., Lai, M.-Y., Azen, S. P. (1991). A comparison of methods for
       calculating a stratified kappa. Statistics in Medicine, 10(9), 1465-1472.
       https://doi.org/10.1002/sim.4780100913

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"]]
    >>> second = [["a", "a"], ["a", "a"], ["a", "a"]]  # kappa alone would be 0/0
    >>> round(stratified_kappa([first, second]).value, 3)
    0.4
    """
    coded = code_strata(pairs, categories)
    strata = [
        agreements
        for codes in _strata(coded)
        if (agreements := _agreements(pair_table(codes, coded.n_categories)))
    ]
    observed = chance = None
    if strata:
        observed = sum((o for o, _ in strata), Fraction(0)) / len(strata)
        chance = sum((e for _, e in strata), Fraction(0)) / len(strata)
    value = kappa(observed, chance)
    return Estimate(
        coefficient="stratified_kappa",
        weights="identity",
        value=ratio(value),
        standard_error=_standard_error(coded, chance, value),
        observed=ratio(observed),
        chance=ratio(chance),
        n_items=coded.n_items,
        n_raters=len(strata),
        n_categories=coded.n_categories,
        reason=defined("stratified kappa", observed, chance),
    )


def code_strata(
    pairs: object, categories: Sequence[Label] | None = None
) -> CodedRatings:
    """Check pairs of ratings per rater and lay them side by side as codes.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions.
    categories : sequence of str, int or float, optional
        The declared scale in order.

    Returns
    -------
    CodedRatings
        Codes of shape (n_items, 2 n_raters), the two of a rater beside each other.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    """
    if isinstance(pairs, CodedRatings):
        return pairs
    if isinstance(pairs, str) or not isinstance(pairs, Iterable):
        raise RatingsError(
            f"pairs: needs one table (items, 2) per rater, got {type(pairs).__name__}"
        )
    tables = [_plain(table, rater) for rater, table in enumerate(pairs)]
    if not tables:
        raise RatingsError("pairs: needs the pairs of at least one rater, got none")
    if len({len(table) for table in tables}) > 1:
        raise RatingsError(
            "pairs: every rater needs the same items, got "
            f"{', '.join(str(len(table)) for table in tables)} items"
        )
    rows = [
        [grade for pair in of_item for grade in pair]
        for of_item in zip(*tables, strict=True)
    ]
    return code_ratings(rows, categories)


def _plain(table: object, rater: int) -> list[list[object]]:
    # one rater's table -> n_items lists of 2 labels
    if not isinstance(table, Iterable) or isinstance(table, str):
        raise RatingsError(f"pairs: rater {rater} needs a table, got {table!r}")
    rows = [list(pair) for pair in table]
    for item, pair in enumerate(rows):
        if len(pair) != 2:
            raise RatingsError(
                f"pairs: rater {rater}, item {item}: needs two grades, got {len(pair)}"
            )
    return rows


def _strata(coded: CodedRatings) -> list[NDArray[np.int64]]:
    # (n_items, 2 n_raters) -> n_raters times (n_items, 2)
    width = coded.codes.shape[1]
    return [coded.codes[:, start : start + 2] for start in range(0, width, 2)]


def _agreements(table: NDArray[np.int64]) -> tuple[Fraction, Fraction] | None:
    # table (n_categories, n_categories) -> p_o, p_e; None without a pair
    cells: list[list[int]] = table.tolist()
    n = sum(map(sum, cells))
    if n == 0:
        return None
    margins = zip(map(sum, cells), map(sum, zip(*cells, strict=True)), strict=True)
    expected = sum(first * second for first, second in margins)
    agree = sum(cells[k][k] for k in range(len(cells)))
    return Fraction(agree, n), Fraction(expected, n * n)


def _standard_error(
    coded: CodedRatings, chance: Fraction | None, value: Fraction | None
) -> float:
    n_items = coded.n_items
    if n_items < 2 or chance is None or value is None:
        return math.nan
    q = coded.n_categories
    influence = np.zeros(coded.codes.shape[0])
    n_strata = 0
    for codes in _strata(coded):
        features = pair_features(codes, q)
        n = features[:, 1].sum()
        if n == 0:
            continue
        n_strata += 1
        means = features.sum(axis=0) / n
        first, second = means[2 : 2 + q], means[2 + q :]
        # An item's pull on p_o and on p_e of this stratum (see cohen.py).
        on_chance = features[:, 2 : 2 + q] @ second + features[:, 2 + q :] @ first
        on_chance -= 2 * (first @ second) * features[:, 1]
        on_observed = features[:, 0] - means[0] * features[:, 1]
        influence += (on_observed - float(1 - value) * on_chance) * n_items / n
    influence /= n_strata * float(1 - chance)
    return float(np.sqrt((influence**2).sum() / (n_items * (n_items - 1))))


def _features(coded: CodedRatings) -> Floats:
    # (n_items, n_raters (2 + 2 n_categories)): each rater's pair features in turn
    q = coded.n_categories
    return np.hstack([pair_features(codes, q) for codes in _strata(coded)])


def _value(sums: Floats, n_categories: int) -> Floats:
    # sums (..., n_raters (2 + 2 n_categories)) -> (...)
    width = 2 + 2 * n_categories
    parts = sums.reshape(*sums.shape[:-1], -1, width)
    agree, n = parts[..., 0], parts[..., 1]
    first = parts[..., 2 : 2 + n_categories]
    second = parts[..., 2 + n_categories :]
    expected = (first * second).sum(axis=-1)
    scale = np.where(n > 0, n * n, 1.0)  # a stratum without pairs adds 0 to both sums
    above = ((n * agree - expected) / scale).sum(axis=-1)
    return divide(above, ((n * n - expected) / scale).sum(axis=-1))


STRATIFIED_KERNEL = Kernel(features=_features, value=_value)
