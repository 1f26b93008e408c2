"""The random words, against PCG64 and SHA-256 written out in Python integers."""

import hashlib
import itertools
from collections.abc import Iterator

import numpy as np

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
