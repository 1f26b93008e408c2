"""Orders with limits on what may follow what: counted exactly, and numbered.

In: what is to be ordered, and its limits. Out: how many orders there are, and the order
of each number below that, so that an order drawn by a number drawn uniformly is one of
all that keep the limits, each equally likely.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain, pairwise
from math import comb, prod
from operator import mul
from typing import TypeVar

_T = TypeVar("_T")

FREE = -1
"""Stands in a word for what belongs to no group."""


@dataclass(frozen=True, slots=True)
class LimitedRuns:
    """Words of groups in which no group has more than `longest` letters in a row."""

    sizes: tuple[int, ...]  # letters of each group, from 1
    n_free: int  # letters of no group, of which any number may stand in a row
    longest: int

    def count(self) -> int:
        """Return how many such words there are."""
        return _of_words(_open(self.sizes, self.longest), self.n_free)

    def word(self, number: int) -> list[int]:
        """Return the word of a number below `count`: a group or `FREE` a letter."""
        runs: list[int] = []
        factor = 1  # ways to part each group so far into its runs
        for size in self.sizes:
            if self.longest == 1:  # the only one that is possible
                runs.append(size)
                continue
            options = [(n_runs, factor * ways) for n_runs, ways in self._next(runs)]
            n_runs, number = _pick(number, options)
            runs.append(n_runs)
            factor *= _n_compositions(size, n_runs, self.longest)
        lengths = []
        for size, n_runs in zip(self.sizes, runs, strict=True):
            ways = _n_compositions(size, n_runs, self.longest)
            number, index = divmod(number, ways)
            lengths.append(iter(_composition(index, size, n_runs, self.longest)))
        return [
            letter
            for run in _apart_word(number, tuple(runs), self.n_free)
            for letter in [run] * (1 if run == FREE else next(lengths[run]))
        ]

    def _next(self, runs: Sequence[int]) -> Iterator[tuple[int, int]]:
        # how many runs the next group may have, and in how many words, if those of the
        # groups before are not parted yet and those after it have any number
        size = self.sizes[len(runs)]
        others = _open(self.sizes[len(runs) + 1 :], self.longest)
        for n_runs in runs:
            others = _product(others, _signed(n_runs))
        by_blocks = [
            _of_words(_product(others, [*[0] * n_blocks, 1]), self.n_free)
            for n_blocks in range(size + 1)
        ]
        for n_runs in range(-(-size // self.longest), size + 1):
            words = sum(map(mul, _signed(n_runs), by_blocks))
            yield n_runs, words * _n_compositions(size, n_runs, self.longest)


@dataclass(frozen=True, slots=True, kw_only=True)
class StandardsApart:
    """Words of roles without two standards in a row."""

    n_standards: int
    n_dummies: int

    def count(self) -> int:
        """Return how many such words there are."""
        return comb(self.n_dummies + 1, self.n_standards)

    def word(self, number: int) -> list[str]:
        """Return the word of a number below `count`."""
        # at most one standard before each dummy, and one after the last
        gaps = range(self.n_dummies + 1)
        chosen = subset(number, gaps, self.n_standards)
        word = [["standard", "dummy"] if gap in chosen else ["dummy"] for gap in gaps]
        return [role for roles in word for role in roles][:-1]


Cell = tuple[int | None, bool]
"""What a presentation counts as: the number of its grade, and if it is a standard."""

_Sizes = tuple[int, int]  # dummies, standards

# Presentations that are left of each cell, the last cell, and its run of a grade. Cells
# are counted grade by grade, those without one last; of each dummies, standards.
_Remainder = tuple[tuple[int, ...], int, int]

_NOTHING = -2  # in the place of the last cell: of no grade, and no standard

MAX_REMAINDERS = 100_000
"""What may be left of a word, at most, for it to be counted; some seconds."""


@dataclass(frozen=True, slots=True)
class PartedRuns:
    """Words without two standards in a row, nor more than `longest` of a grade."""

    grades: tuple[_Sizes, ...]  # presentations of each grade
    free: _Sizes  # of no grade
    longest: int
    _counts: dict[object, int] = field(default_factory=dict, compare=False, repr=False)

    @property
    def n_remainders(self) -> int:
        """An upper limit to the number of different remainders of a word."""
        # Grades with as many presentations are alike: only how many of them have so
        # much left counts, and what the last presentation was.
        left = prod(
            comb((dummies + 1) * (standards + 1) + n - 1, n)
            for (dummies, standards), n in Counter(self.grades).items()
        )
        of_free = (self.free[0] + 1) * (self.free[1] + 1)
        longest = min(self.longest, max(map(sum, self.grades), default=1))
        return left * of_free * (len(self.grades) + 1) * 2 * longest

    def count(self) -> int:
        """Return how many such words there are."""
        return self._completions(self._whole())

    def word(self, number: int) -> list[Cell]:
        """Return the word of a number below `count`."""
        left, word = self._whole(), list[Cell]()
        while any(left[0]):
            options = ((each, self._completions(each)) for each in self._after(left))
            left, number = _pick(number, options)
            grade, is_standard = divmod(left[1], 2)
            word.append(
                (None if grade == len(self.grades) else grade, bool(is_standard))
            )
        return word

    def _whole(self) -> _Remainder:
        return tuple(chain(*self.grades, self.free)), _NOTHING, 0

    def _completions(self, left: _Remainder) -> int:
        sizes, last, run = left
        if not any(sizes):
            return 1
        # Words go on in as many ways whichever grade has so much left; that of the last
        # presentation is no longer like the others.
        *grades, free = zip(sizes[::2], sizes[1::2], strict=True)
        of_last = grades.pop(last // 2) if 0 <= last // 2 < len(grades) else None
        key = (*sorted(grades), of_last, free, last % 2, run)
        if key not in self._counts:
            total = 0
            for each in self._after(left):
                total += self._completions(each)
            self._counts[key] = total
        return self._counts[key]

    def _after(self, left: _Remainder) -> Iterator[_Remainder]:
        # by grade, then without one; of each a dummy, then a standard
        sizes, last, run_before = left
        for cell, n_left in enumerate(sizes):
            grade, is_standard = divmod(cell, 2)
            has_grade = grade < len(self.grades)
            run = run_before + 1 if has_grade and grade == last // 2 else 1
            is_apart = not (is_standard and last % 2)
            if n_left and run <= self.longest and is_apart:
                yield (*sizes[:cell], n_left - 1, *sizes[cell + 1 :]), cell, run


@lru_cache(maxsize=64)
def _open(sizes: tuple[int, ...], longest: int) -> list[int]:
    """Return signed counts of words of groups with any number of runs, by blocks."""
    product = [1]
    for size in sizes:
        of_group = [0] * (size + 1)
        for n_runs in range(-(-size // longest), size + 1):
            ways = _n_compositions(size, n_runs, longest)
            for n_blocks, sign in enumerate(_signed(n_runs)):
                of_group[n_blocks] += ways * sign
        product = _product(product, of_group)
    return product


def _signed(n_runs: int) -> list[int]:
    """Return, by the blocks that runs are joined to, in how many ways, signed."""
    # Inclusion and exclusion: words in which no two runs of a group touch are all
    # words, less those in which a pair is joined, and so on.
    return [0] + [
        (-1) ** (n_runs - n) * comb(n_runs - 1, n - 1) for n in range(1, n_runs + 1)
    ]


def _product(first: Sequence[int], second: Sequence[int]) -> list[int]:
    """Multiply counts of words by their number of blocks: words are interleaved."""
    product = [0] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            if a and b:
                product[i + j] += comb(i + j, i) * a * b
    return product


def _of_words(by_blocks: Sequence[int], n_free: int) -> int:
    """Return how many words these are once free letters are put in anywhere."""
    return sum(comb(n + n_free, n_free) * ways for n, ways in enumerate(by_blocks))


@lru_cache(maxsize=64)
def _completions(sizes: tuple[int, ...], n_free: int) -> list[list[int]]:
    """Return in how many ways a word becomes whole, by groups in it and touching pairs.

    Groups are put in one after the other, and the free letters last; a pair of
    neighbours of one group must then have been parted.
    """
    n_letters, n_later = sum(sizes), n_free
    # free letters: one into each pair, the others anywhere
    table = [[comb(n_free - d + n_letters, n_letters) for d in range(n_free + 1)]]
    for index in range(len(sizes) - 1, -1, -1):
        size = sizes[index]
        n_letters -= size
        n_later += size
        n_pairs = min(n_later, max(0, n_letters - index))
        table.append(
            [
                sum(ways for _, ways in _insertions(size, n_letters, d, table[-1]))
                for d in range(n_pairs + 1)
            ]
        )
    return table[::-1]


def _insertions(
    size: int, n_letters: int, n_pairs: int, later: Sequence[int]
) -> Iterator[tuple[tuple[int, int], int]]:
    # Letters of a new group stand in clusters, of which some part touching pairs:
    # yields clusters, pairs parted, and in how many ways the word becomes whole
    for clusters in range(1, size + 1):
        for parted in range(min(n_pairs, clusters) + 1):
            left = n_pairs - parted + size - clusters
            if left < len(later) and later[left]:
                ways = comb(size - 1, clusters - 1) * comb(n_pairs, parted)
                ways *= comb(n_letters + 1 - n_pairs, clusters - parted)
                yield (clusters, parted), ways * later[left]


def _apart_word(number: int, sizes: tuple[int, ...], n_free: int) -> list[int]:
    """Return the word of a number in which no two letters of a group touch."""
    later, word = _completions(sizes, n_free), list[int]()
    for group, size in enumerate(sizes):
        pairs = [i for i in range(1, len(word)) if word[i - 1] == word[i]]
        others = [i for i in range(len(word) + 1) if i not in set(pairs)]
        options = _insertions(size, len(word), len(pairs), later[group + 1])
        (clusters, parted), number = _pick(number, options)
        number, index = divmod(number, comb(size - 1, clusters - 1))
        lengths = _composition(index, size, clusters, size)
        number, index = divmod(number, comb(len(pairs), parted))
        gaps = subset(index, pairs, parted)
        number, index = divmod(number, comb(len(others), clusters - parted))
        gaps = sorted(gaps + subset(index, others, clusters - parted))
        for gap, length in reversed(list(zip(gaps, lengths, strict=True))):
            word[gap:gap] = [group] * length
    return _with_free(number, word, n_free)


def _pick(number: int, options: Iterable[tuple[_T, int]]) -> tuple[_T, int]:
    """Return the option that a number falls to, by their counts, and the remainder."""
    for option, ways in options:
        if number < ways:
            return option, number
        number -= ways
    raise IndexError("a number beyond the count")


def _with_free(number: int, word: Sequence[int], n_free: int) -> list[int]:
    # stars and bars: each touching pair gets a free letter, the others go anywhere
    n_pairs = sum(a == b for a, b in pairwise(word))
    n_places = n_free - n_pairs + len(word)
    bars = set(subset(number, range(n_places), len(word)))
    full: list[int] = []
    n_put = 0  # letters of the word
    for place in range(n_places):
        if place not in bars:
            full.append(FREE)
            continue
        if n_put and word[n_put - 1] == word[n_put]:
            full.append(FREE)
        full.append(word[n_put])
        n_put += 1
    return full


def _n_compositions(total: int, parts: int, longest: int) -> int:
    """Return in how many ways a number is a sum of parts from 1 to `longest`."""
    return sum(
        (-1) ** j * comb(parts, j) * comb(total - j * longest - 1, parts - 1)
        for j in range(parts + 1)
        if total - j * longest >= parts
    )


def _composition(number: int, total: int, parts: int, longest: int) -> list[int]:
    """Return the composition of a number, in lexicographic order."""
    composition = []
    for left in range(parts - 1, 0, -1):
        options = (
            (part, _n_compositions(total - part, left, longest))
            for part in range(1, longest + 1)
        )
        part, number = _pick(number, options)
        composition.append(part)
        total -= part
    return [*composition, total]


def subset(number: int, items: Sequence[int], size: int) -> list[int]:
    """Return the subset of a number, in the order of the items."""
    chosen: list[int] = []
    for place, item in enumerate(items):
        n_left = size - len(chosen)
        if not n_left:
            break
        ways = comb(len(items) - place - 1, n_left - 1)
        if number < ways:
            chosen.append(item)
        else:
            number -= ways
    return chosen


def n_arrangements(sizes: Sequence[int]) -> int:
    """Return the number of orders of things with these numbers of copies."""
    return prod(comb(sum(sizes[: i + 1]), size) for i, size in enumerate(sizes))


def arrangement(number: int, sizes: Sequence[int]) -> list[int]:
    """Return the order of a number below `n_arrangements`, by the places of things."""
    order = [0] * sum(sizes)
    places: Sequence[int] = range(len(order))
    for thing in range(len(sizes) - 1, -1, -1):
        number, index = divmod(number, comb(len(places), sizes[thing]))
        chosen = set(subset(index, places, sizes[thing]))
        for place in chosen:
            order[place] = thing
        places = [place for place in places if place not in chosen]
    return order
