"""What orders and codes are drawn from: secrets of a study and its sites, and words.

The secret has a file; where sites are strata each has one of its own, derived from the
study's, and can have a copy of the study. Random words come from a name and a secret.
"""

import hashlib
import hmac
import json
import re
import secrets
from collections.abc import MutableSequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self, TypeVar

from numpy.random import PCG64

from masrel._files import write_files
from masrel.errors import ScheduleError
from masrel.lab._study_files import MAX_SMALL, read_regular
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol.study import _check_new_folder

N_BYTES = 16
"""Bytes of a secret: 128 bits, which nobody can try one by one."""

SECRET_TEXT = "format: 1\nsecret: {}\n"
"""The text of the file of a study's secret, with its hexadecimal digits."""

_TEXT = re.compile(r"format: 1\nsecret: ([0-9a-f]{32})\n?")
_SITE_TEXT = re.compile(
    r"format: 2\nsite: ([A-Za-z0-9][A-Za-z0-9_.-]{0,31})\nsecret: ([0-9a-f]{32})\n"
    r"commitment: ([0-9a-f]{64})\n?"
)


@dataclass(frozen=True, slots=True)
class StudySecret:
    """The secret of a study, or that of one of its sites alone."""

    commitment: str  # to the secret of the study
    secret: bytes
    site: str | None = None  # whose secret it is; None of the whole study

    @classmethod
    def of_study(cls, secret: bytes) -> Self:
        """Return the secret of a study with its commitment; refuse another length."""
        if len(secret) != N_BYTES:
            raise ScheduleError(f"secret: needed {N_BYTES} bytes, got {len(secret)}")
        # it says which secret was used without saying it
        commitment = hashlib.sha256(_named("commitment", secret.hex())).hexdigest()
        return cls(commitment, secret)

    def of(self, site: str | None) -> bytes:
        """Return what a site's orders are drawn from; of no site the study's."""
        if self.site == site:
            return self.secret
        if self.site is not None:
            raise ScheduleError(
                f"secret: needed that of {'the study' if site is None else site}, got "
                f"that of site {self.site} alone, whose raters masrel schedule draws "
                f"with --site {self.site}"
            )
        # says nothing of the study's secret or another site's
        return hmac.digest(self.secret, _named("site", str(site)), "sha256")[:N_BYTES]

    def draws(self, site: str | None, commitment: str | None) -> bool:
        """Return whether it can draw again what was drawn for a site."""
        return self.commitment == commitment and self.site in (None, site)


def _named(*parts: str | int) -> bytes:
    # what a hash is of: a JSON array without spaces, all but ASCII escaped
    return json.dumps(["masrel", *parts], separators=(",", ":")).encode("ascii")


def find_secret(study: StudyPaths) -> StudySecret | None:
    """Return the secret of a study, published or not; None when there is no file."""
    files = (study.published_secret_file, study.secret_file)
    there = [_read(file) for file in files if file.is_file()]
    if len(there) == 2:
        published, private = there
        if not published.draws(private.site, private.commitment) or (
            published.of(private.site) != private.secret
        ):
            raise ScheduleError(
                f"{study.published_secret_file}: needed the secret of "
                f"{study.secret_file}, got another"
            )
    return there[0] if there else None


def new_secret(study: StudyPaths) -> StudySecret:
    """Draw the secret of a study and keep it where only its owner can read it."""
    secret = secrets.token_bytes(N_BYTES)
    text = SECRET_TEXT.format(secret.hex())
    write_files({study.secret_file: text}, within=study.root)
    return StudySecret.of_study(secret)


def _read(file: Path) -> StudySecret:
    text = read_regular(file, most=MAX_SMALL).decode("utf-8", errors="replace")
    if match := _TEXT.fullmatch(text):
        return StudySecret.of_study(bytes.fromhex(match[1]))
    if match := _SITE_TEXT.fullmatch(text):
        return StudySecret(match[3], bytes.fromhex(match[2]), match[1])
    raise ScheduleError(
        f"{file}: needed a line 'format: 1' and a line 'secret: ' with "
        f"{2 * N_BYTES} hexadecimal digits, got another text"
    )


def site_of(protocol: Protocol, rater: str) -> str | None:
    """Return the site of a rater where sites are strata; else None."""
    if protocol.schedule.strata == "none":
        return None
    return {each.id: each.site for each in protocol.raters}[rater]


def rater_sessions_at(protocol: Protocol, site: str | None) -> list[tuple[str, str]]:
    """Return every rater and session of a site, or of the study."""
    pairs = protocol.rater_sessions
    return [pair for pair in pairs if site in (None, site_of(protocol, pair[0]))]


def checked_site(protocol: Protocol, site: str | None) -> str | None:
    """Return a site that the protocol has, and by which it draws; refuse any other."""
    if site is None:
        return None
    if protocol.schedule.strata != "site":
        raise ScheduleError(
            'site: needed schedule.strata = "site" in the protocol, got '
            f'"{protocol.schedule.strata}"'
        )
    sites = dict.fromkeys(rater.site for rater in protocol.raters if rater.site)
    if site not in sites:
        raise ScheduleError(f"site: needed one of {', '.join(sites)}, got {site!r}")
    return site


def site_of_copy(study: StudyPaths) -> str | None:
    """Return the site that a study is the copy of.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    str or None
        The site whose secret alone the study has; None of a whole study.

    Raises
    ------
    ScheduleError
        If the file of the secret is damaged.
    """
    key = find_secret(study)
    return None if key is None else key.site


def copy_for_site(
    protocol: Protocol, study: StudyPaths, site: str, destination: Path
) -> None:
    """Copy a study for one of its sites, whose secret alone the copy has.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol, whose sites are strata.
    study : StudyPaths
        Where the study is; its secret is drawn if it has none yet.
    site : str
        Whose copy.
    destination : Path
        A new or empty folder: it gets the protocol with its model files, and the
        secret of the site with the study's commitment. Neither schedules nor logs.

    Raises
    ------
    ScheduleError
        If there is no such site, the study has another site's secret alone, or a
        model file is not in the study.
    ParameterError
        If `destination` is a file or holds anything.
    OSError
        If the system refuses a folder or file.
    """
    checked_site(protocol, site)
    copy = StudyPaths(destination)
    files = [model.file for model in protocol.models if model.file is not None]
    for file in files:
        if not (study.root / file).resolve().is_relative_to(study.root.resolve()):
            raise ScheduleError(
                f"{study.protocol}: needed model files inside the study to copy it, "
                f"got {file}"
            )
    contents = {
        destination / file: read_regular(study.root / file, most=MAX_SMALL)
        for file in (*dict.fromkeys(files), study.protocol.name)
    }
    key = find_secret(study) or new_secret(study)
    text = (
        f"format: 2\nsite: {site}\nsecret: {key.of(site).hex()}\n"
        f"commitment: {key.commitment}\n"
    )
    secret = {copy.secret_file: text.encode()}
    _check_new_folder(destination, secret | contents)
    write_files(secret | contents, within=destination, mode=0o600)


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
        name = _named(seed, *purpose)
        digest = hashlib.sha256(name).digest()
        if secret is not None:
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
        number: int = usable
        while number >= usable:
            number = 0
            for _ in range(n_words):
                number = number * _N_WORDS + self.word()
        return number % limit

    def shuffle(self, items: MutableSequence[_T]) -> None:
        """Put `items` into a random order in place, each order equally likely."""
        # Fisher and Yates, from the last place down: place i takes the item of a place
        # drawn from 0 to i.
        for i in range(len(items) - 1, 0, -1):
            j = self.below(i + 1)
            items[i], items[j] = items[j], items[i]
