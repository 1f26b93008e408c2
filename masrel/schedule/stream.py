"""A stream of random words that is the same on every machine and numpy version.

NumPy keeps the raw words of a bit generator the same for ever, but not what its
``Generator`` methods make of them. So the words are taken raw, and what is made of
them is made here.
"""

import hashlib
import json
from collections.abc import MutableSequence
from typing import TypeVar

from numpy.random import PCG64

__all__ = ["Stream"]

T = TypeVar("T")

WORD = 2**64


class Stream:
    """Random words for one purpose, whatever else is drawn from the same seed."""

    # The SHA-256 of the JSON array ``["masrel", seed, *purpose]`` (UTF-8, no spaces,
    # non-ASCII escaped) is the whole state of the generator: its first 16 bytes, big
    # endian, are PCG64's state, the other 16 its increment, made odd.

    def __init__(self, seed: int, *purpose: str) -> None:
        name = json.dumps(["masrel", seed, *purpose], separators=(",", ":"))
        digest = hashlib.sha256(name.encode("ascii")).digest()
        self._generator = PCG64(0)
        self._generator.state = {
            "bit_generator": "PCG64",
            "state": {
                "state": int.from_bytes(digest[:16], "big"),
                "inc": int.from_bytes(digest[16:], "big") | 1,
            },
            "has_uint32": 0,
            "uinteger": 0,
        }

    def word(self) -> int:
        """Return the next word, uniform on 0 to 2**64 - 1."""
        return int(self._generator.random_raw())

    def below(self, limit: int) -> int:
        """Return a number uniform on 0 to `limit` - 1; `limit` from 1 to 2**64."""
        # Words at and above the last multiple of `limit` are rejected, so that every
        # number has exactly the same chance.
        usable = WORD - WORD % limit
        while (word := self.word()) >= usable:
            pass
        return word % limit

    def shuffle(self, items: MutableSequence[T]) -> None:
        """Put `items` into a random order in place, each order equally likely."""
        # Fisher and Yates, from the last place down: place i takes the item of a place
        # drawn from 0 to i.
        for i in range(len(items) - 1, 0, -1):
            j = self.below(i + 1)
            items[i], items[j] = items[j], items[i]
