"""Disagreement of categories so many that no table has a place for every two of them.

In: the values of the categories. Out: an operator that gives what a matrix of
disagreement would, product by product, in a time that hardly grows faster than the
categories do.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Codes = NDArray[np.signedinteger[Any]]

_BLOCK = 1 << 13  # categories at once
_ITEMS = 1 << 14  # items at once
MAX_EXPONENT = 400  # of two, of numbers whose squares and sums of them are floats
_NODES, _WIDTH = 12, 0.5  # per bin of logarithms: the error is below 25^-12


def centred(values: Floats) -> tuple[Floats, float]:
    """Return values from the middle of their range, in a unit that can be squared."""
    exponent = int(np.frexp(np.abs(values).max(initial=0.0))[1])
    if abs(exponent) > MAX_EXPONENT:
        values = np.ldexp(values, -exponent)
    low, high = float(values.min()), float(values.max())
    # a difference of floats is rounded by its own last digit, and no other
    return values - (low + 0.5 * (high - low)), high - low


class Distances(ABC):
    """v as an operator: (n_categories, n_categories), symmetric, 0 on its diagonal."""

    __array_ufunc__ = None  # `counts @ v` is left to `__rmatmul__`

    def __init__(self, n_categories: int) -> None:
        self.n = n_categories

    def __len__(self) -> int:
        return self.n

    @abstractmethod
    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""

    def between(self, first: Floats, second: Floats) -> float:
        """Return Σ_kl v_kl m_k m'_l."""
        return float(first @ self.dot(second))

    @abstractmethod
    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""

    def of_items(self, codes: Codes) -> Floats:
        """Return Σ_kl v_kl n_ik n_il of each row of codes; -1 is no rating."""
        # codes (n_items, n_raters) -> (n_items,)
        total = np.zeros(len(codes))
        has_gaps = bool((codes < 0).any())
        for g in range(codes.shape[1]):
            for h in range(g):
                of_two = self.pair(codes[:, g], codes[:, h])
                if has_gaps:
                    of_two = np.where(
                        (codes[:, g] < 0) | (codes[:, h] < 0), 0.0, of_two
                    )
                total += of_two
        return 2.0 * total

    def moments(self, codes: Codes) -> Floats:
        """Return what `between_moments` needs of items: counts of the categories."""
        # -> (n_items, n_categories)
        counts = np.zeros((len(codes), self.n + 1))  # missing, -1, is the last
        for column in codes.T:
            counts[np.arange(len(codes)), column] += 1.0
        return counts[:, :-1]

    def between_moments(self, moments: Floats, mass: Any = 1.0) -> Floats:  # noqa: ARG002 - it is in the counts
        """Return Σ_kl v_kl m_k m_l of sums of moments, of which the mass is known."""
        # (..., n_categories) -> (...)
        return np.asarray(np.einsum("...k,...k->...", moments @ self, moments))

    def sum(self) -> float:
        """Return Σ_kl v_kl."""
        ones = np.ones(self.n)
        return self.between(ones, ones)

    def any(self) -> bool:
        """Return whether any two categories disagree."""
        return self.n > 1

    def __rmatmul__(self, masses: Floats) -> Floats:
        if np.iscomplexobj(masses):  # with a derivative by a complex step
            return np.asarray(masses.real @ self + 1j * (masses.imag @ self))
        rows = masses.reshape(-1, self.n)
        return np.asarray([self.dot(row) for row in rows]).reshape(masses.shape)


class Differing(Distances):
    """1 for any two categories."""

    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""
        return np.asarray(masses.sum(axis=-1, keepdims=True) - masses)

    def between(self, first: Floats, second: Floats) -> float:
        """Return Σ_kl v_kl m_k m'_l."""
        # few of the pairs are alike, so that the rounding of these does not matter
        return float(first.sum() * second.sum() - first @ second)

    def __rmatmul__(self, masses: Floats) -> Floats:
        return self.dot(masses)

    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""
        return np.asarray(first != second, dtype=np.float64)


class Squared(Distances):
    """The squares of distances between points."""

    def __init__(self, points: Floats) -> None:
        super().__init__(len(points))
        self.points = points  # (n_categories, n_dimensions): v = |e_k - e_l|²

    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""
        # Σ_l m_l |e_k - e_l|² by moments about the mean, so that no digits cancel
        mass = masses.sum()
        mean = masses @ self.points / (mass if mass else 1.0)
        e = self.points - mean
        squares = np.einsum("km,km->k", e, e)
        return np.asarray(mass * squares + masses @ squares - 2.0 * (e @ (masses @ e)))

    def between(self, first: Floats, second: Floats) -> float:
        """Return Σ_kl v_kl m_k m'_l."""
        of_first, of_second = float(first.sum()), float(second.sum())
        total = 0.0
        for x in self.points.T:
            e = x - float(first @ x) / (of_first if of_first else 1.0)
            offset, squares = float(second @ e), e * e  # of the first there is none
            total += of_second * float(first @ squares)
            total += of_first * float(second @ squares) - 2.0 * offset * float(
                first @ e
            )
        return total

    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""
        total = np.zeros(len(first))
        for x in self.points.T:
            total += (x[first] - x[second]) ** 2
        return total

    def of_items(self, codes: Codes) -> Floats:
        """Return Σ_kl v_kl n_ik n_il of each row of codes; -1 is no rating."""
        # 2 n_i Σ_a |e_a - mean_i|², for as many raters as there are
        total = np.empty(len(codes))
        for start in range(0, len(codes), _ITEMS):
            block = slice(start, start + _ITEMS)
            total[block] = self._of_block(codes[block])
        return total

    def _of_block(self, codes: Codes) -> Floats:
        is_rated = codes >= 0
        size = is_rated.sum(axis=1)
        total = np.zeros(len(codes))
        for x in self.points.T:
            values = x[codes]
            if not is_rated.all():
                values[~is_rated] = 0.0
            values -= (values.sum(axis=1) / np.maximum(size, 1))[:, None]
            if not is_rated.all():
                values[~is_rated] = 0.0
            total += np.einsum("ij,ij->i", values, values)
        return np.asarray(2.0 * size * total)

    def moments(self, codes: Codes) -> Floats:
        """Return sums over the ratings of items: of points and of their squares."""
        # -> (n_items, n_dimensions + 1)
        squares = np.einsum("km,km->k", self.points, self.points)
        padded = np.column_stack([self.points, squares])
        padded = np.vstack([padded, np.zeros(padded.shape[1])])
        return np.asarray(sum(padded[column] for column in codes.T))

    def between_moments(self, moments: Floats, mass: Any = 1.0) -> Floats:
        """Return Σ_kl v_kl m_k m_l of sums of moments, of which the mass is known."""
        # (..., n_dimensions + 1) -> (...): 2 (M Σ m |e|² - |Σ m e|²)
        e = moments[..., :-1]
        return np.asarray(2.0 * (mass * moments[..., -1] - (e * e).sum(axis=-1)))


class Linear(Distances):
    """Distances on a line, times a factor."""

    def __init__(self, values: Floats, factor: float) -> None:
        super().__init__(len(values))
        self.values, self.factor = values, factor
        self._order = np.argsort(values)

    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""
        # Σ_l m_l |x_k - x_l| = x_k (2 M_k - M) + S - 2 S_k of sums up to x_k
        x, m = self.values[self._order], masses[self._order]
        up_to, moment = _running_sums(m), _running_sums(m * x)
        between = np.empty(self.n)
        between[self._order] = x * (2.0 * up_to - up_to[-1]) + moment[-1] - 2.0 * moment
        return between * self.factor

    def between(self, first: Floats, second: Floats) -> float:
        """Return Σ_kl v_kl m_k m'_l."""
        # each gap is crossed by the masses on its sides
        gaps = np.diff(self.values[self._order])
        below = other = _running_sums(first[self._order])
        if second is not first:
            other = _running_sums(second[self._order])
        crossing = below * (other[-1] - other) + (below[-1] - below) * other
        return float(gaps @ crossing[:-1]) * self.factor

    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""
        return np.abs(self.values[first] - self.values[second]) * self.factor


def _running_sums(x: Floats) -> Floats:
    # in blocks, so that few roundings add up
    width = math.isqrt(len(x)) + 1
    blocks = np.zeros((width, width))
    blocks.ravel()[: len(x)] = x
    np.cumsum(blocks, axis=1, out=blocks)
    blocks[1:] += np.cumsum(blocks[:-1, -1])[:, None]
    return blocks.ravel()[: len(x)]


class Both(Distances):
    """The sum of two."""

    def __init__(self, first: Distances, second: Distances) -> None:
        super().__init__(len(first))
        self.parts = (first, second)

    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""
        first, second = self.parts
        return first.dot(masses) + second.dot(masses)

    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""
        a, b = self.parts
        return a.pair(first, second) + b.pair(first, second)


class Ratio(Distances):
    """[(x - y)/(x + y)]², of values of one sign, times a factor."""

    # With u = ln x it is tanh²((u - u')/2), whose nearest poles are π away from the
    # line: in a bin of logarithms a polynomial through a few Chebyshev nodes is that
    # function to the last digit, and masses can be moved to the nodes.

    def __init__(self, values: Floats, factor: float = 1.0) -> None:
        super().__init__(len(values))
        self.values, self.factor = np.abs(values), factor
        self._positive = np.flatnonzero(self.values)
        u = np.log(self.values[self._positive])
        low, high = float(u.min()), float(u.max())
        width = max((high - low) / max(1.0, np.ceil((high - low) / _WIDTH)), 1e-300)
        bins = (u - low) // width
        used = np.unique(bins)
        self._bin = np.searchsorted(used, bins)  # faster than the inverse of `unique`
        centres = low + (used + 0.5) * width
        self._u = (u - centres[self._bin]) * (2.0 / width)  # within [-1, 1]
        angles = (2 * np.arange(_NODES) + 1) * np.pi / (2 * _NODES)
        self._places = (centres[:, None] + 0.5 * width * np.cos(angles)).ravel()
        # Σ_l m_l f(u_l) is Σ_a f(node_a) of what the polynomials of degree j have there
        self._to_nodes = np.cos(np.outer(np.arange(_NODES), angles)) * (2.0 / _NODES)
        self._to_nodes[0] /= 2.0

    def _moments(self, masses: Floats) -> Floats:
        # of the positive values: Σ m T_j(u) of each bin, (n_bins, _NODES)
        n = len(self._places) // _NODES
        moments = np.zeros((n, _NODES))
        m = masses[self._positive]
        for start in range(0, len(m), _BLOCK):
            block = slice(start, start + _BLOCK)
            bins = self._bin[block]
            for j, weighed in enumerate(_chebyshev(self._u[block], m[block])):
                moments[:, j] += np.bincount(bins, weighed, minlength=n)
        return moments

    def _potential(self, moments: Floats) -> Floats:
        # Σ_l m_l tanh²((u - u_l)/2) of positive ones: its polynomial in each bin
        at_nodes = (moments @ self._to_nodes).ravel()
        places = self._places
        there = [
            np.tanh(0.5 * (places[at : at + _NODES, None] - places)) ** 2 @ at_nodes
            for at in range(0, len(places), _NODES)
        ]
        return np.asarray(np.array(there) @ self._to_nodes.T)

    def between(self, first: Floats, second: Floats) -> float:
        """Return Σ_kl v_kl m_k m'_l."""
        moments = others = self._moments(first)
        if second is not first:
            others = self._moments(second)
        of_positive = float((moments * self._potential(others)).sum())
        x, y = (float(m[self._positive].sum()) for m in (first, second))
        zeros = (float(first.sum()) - x) * y + x * (float(second.sum()) - y)
        return (of_positive + zeros) * self.factor

    def dot(self, masses: Floats) -> Floats:
        """Return Σ_l v_kl m_l, (n_categories,)."""
        potential = self._potential(self._moments(masses)).T
        positive = masses[self._positive].sum()
        of_zero = masses.sum() - positive  # 1 from all others
        between = np.full(self.n, positive)
        for start in range(0, len(self._u), _BLOCK):
            block = slice(start, start + _BLOCK)
            here = potential.take(self._bin[block], axis=1)
            parts = _chebyshev(self._u[block], np.ones(here.shape[1]))
            of_others = sum(c * t for c, t in zip(here, parts, strict=True))
            between[self._positive[block]] = of_zero + of_others
        return between * self.factor

    def pair(self, first: Codes, second: Codes) -> Floats:
        """Return v of pairs of categories."""
        x, y = self.values[first], self.values[second]
        total = x + y
        return ((x - y) / np.where(total == 0.0, 1.0, total)) ** 2 * self.factor


def _chebyshev(u: Floats, masses: Floats) -> Iterator[Floats]:
    # m T_j(u) of the first polynomials
    before, this, twice = masses * u, masses, 2.0 * u
    for _ in range(_NODES):
        yield this
        before, this = this, twice * this - before


def on_a_circle(values: Floats) -> Squared:
    """Return sin²(π (x - y) / (R + 1)) over the largest, as distances on a circle."""
    turn = float(values.max() - values.min()) + 1.0
    ordered = np.sort((values - values.min()) / turn)
    # the largest is of two that are next to half a turn from each other
    at = np.searchsorted(ordered, (ordered + 0.5) % 1.0)
    near = np.concatenate([ordered[at % len(at)], ordered[at - 1]])
    largest = (np.sin(np.pi * (near - np.tile(ordered, 2))) ** 2).max()
    angles = 2.0 * np.pi * (values - values.min()) / turn
    points = np.column_stack([np.cos(angles), np.sin(angles)])
    return Squared(points * (0.5 / np.sqrt(largest)))
