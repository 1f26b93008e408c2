"""Random numbers of a schedule: raw words, from a name and a secret."""

import hashlib
import hmac
import json
from collections.abc import MutableSequence
from typing import TypeVar

from numpy.random import PCG64

_T = TypeVar("_T")

_N_WORDS = 2**64


class Stream:
    """Random words for one purpose, whatever else is drawn from the same seed."""

    # NumPy keeps the raw words of a bit generator the same for ever, but not what its
    # Generator methods make of them: words are taken raw, and numbers made here.
    #
    # The SHA-256 of the JSON array ``["masrel", seed, *purpose]`` (UTF-8, no spaces,
    # non-ASCII escaped) is the whole state of the generator: its first 16 bytes, big
    # endian, are PCG64's state, the other 16 its increment, made odd. With a secret it
    # is the HMAC-SHA256 of that array, whose key is the secret: who has the words of
    # some streams learns neither the secret nor any other stream.

    def __init__(self, seed: int, *purpose: str, secret: bytes | None = None) -> None:
        name = json.dumps(["masrel", seed, *purpose], separators=(",", ":")).encode()
        if secret is None:
            digest = hashlib.sha256(name).digest()
        else:
            digest = hmac.digest(secret, name, "sha256")
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
        """Return a number uniform on 0 to `limit` - 1; `limit` from 1."""
        # As many words as are needed make one number, the first word its highest.
        # Those at and above the last multiple of `limit` are rejected, so that every
        # number has exactly the same chance.
        n_words = max(1, -(-(limit - 1).bit_length() // 64))
        usable = _N_WORDS**n_words // limit * limit
        while (number := self._joined(n_words)) >= usable:
            pass
        return number % limit

    def _joined(self, n_words: int) -> int:
        number = 0
        for _ in range(n_words):
            number = number * _N_WORDS + self.word()
        return number

    def shuffle(self, items: MutableSequence[_T]) -> None:
        """Put `items` into a random order in place, each order equally likely."""
        # Fisher and Yates, from the last place down: place i takes the item of a place
        # drawn from 0 to i.
        for i in range(len(items) - 1, 0, -1):
            j = self.below(i + 1)
            items[i], items[j] = items[j], items[i]
