"""The random words, against PCG64 and SHA-256 written out in Python integers."""

import hashlib
import itertools
from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.schedule._secret import Stream

MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
MASK = 2**128 - 1


def words_of(name: str) -> Iterator[int]:
    """The words of a stream that is started from the SHA-256 of a name."""
    return words_from(hashlib.sha256(name.encode()).hexdigest())


def words_from(digest: str) -> Iterator[int]:
    """PCG XSL RR 128/64 (O'Neill 2014, HMC-CS-2014-0905), started from 64 digits."""
    state, increment = int(digest[:32], 16), int(digest[32:], 16) | 1
    while True:
        state = (state * MULTIPLIER + increment) & MASK
        folded, turn = (state >> 64) ^ (state & (2**64 - 1)), state >> 122
        yield ((folded >> turn) | (folded << (64 - turn))) & (2**64 - 1)


def test_words_are_those_of_pcg64_started_from_the_hash_of_seed_and_purpose() -> None:
    stream = Stream(2012, "schedule", "test", "R1")
    expected = itertools.islice(words_of('["masrel",2012,"schedule","test","R1"]'), 100)
    assert [stream.word() for _ in range(100)] == list(expected)


def test_the_reference_is_the_generator_that_numpy_calls_pcg64() -> None:
    name = "anything"
    digest = hashlib.sha256(name.encode()).hexdigest()
    generator = np.random.PCG64(0)
    generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": int(digest[:32], 16), "inc": int(digest[32:], 16) | 1},
        "has_uint32": 0,
        "uinteger": 0,
    }
    expected = [int(word) for word in generator.random_raw(50)]
    assert list(itertools.islice(words_of(name), 50)) == expected


@pytest.mark.parametrize(
    "other", [(2, "a", "b"), (1, "b", "a"), (1, "ab"), (1, "a"), (1, "a", "b", "")]
)
def test_streams_of_other_seeds_or_purposes_differ(other: tuple[int, ...]) -> None:
    seed, *purpose = other
    assert Stream(1, "a", "b").word() != Stream(seed, *map(str, purpose)).word()


class Given(Stream):
    """A stream of words that are given."""

    def __init__(self, *words: int) -> None:
        self._words = iter(words)

    def word(self) -> int:
        return next(self._words)


def test_words_beyond_the_last_multiple_are_rejected() -> None:
    # 2**64 = 3 * 6148914691236517205 + 1: the word 2**64 - 1 would favour 0
    assert Given(2**64 - 1, 2**64 - 2).below(3) == 2
    # a power of two divides 2**64: no word is rejected
    assert Given(2**64 - 1).below(8) == 7
    assert Given(5).below(1) == 0


def test_a_shuffle_swaps_from_the_last_place_down() -> None:
    items = ["a", "b", "c", "d"]
    # i = 3 takes 1: a d c b; i = 2 takes 2: the same; i = 1 takes 0: d a c b
    Given(1, 2, 0).shuffle(items)
    assert items == ["d", "a", "c", "b"]


@given(st.integers(0, 2**63 - 1), st.lists(st.integers(), max_size=20))
def test_a_shuffle_loses_and_invents_nothing(seed: int, items: list[int]) -> None:
    shuffled = list(items)
    Stream(seed, "any").shuffle(shuffled)
    assert Counter(shuffled) == Counter(items)


def test_every_order_of_four_is_equally_likely() -> None:
    # 24 orders, 24 000 streams of consecutive seeds: chi-square with 23 degrees of
    # freedom exceeds 63.8 with probability 1e-5. Seeds are fixed, so this either
    # holds for good or fails for good.
    counts: Counter[tuple[str, ...]] = Counter()
    for seed in range(24_000):
        items = list("abcd")
        Stream(seed, "order").shuffle(items)
        counts[tuple(items)] += 1
    assert len(counts) == 24
    assert sum((count - 1000) ** 2 / 1000 for count in counts.values()) < 63.8
