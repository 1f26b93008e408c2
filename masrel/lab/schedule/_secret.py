"""The secret from which a study's orders and codes are drawn, and its file."""

import hashlib
import hmac
import json
import re
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from masrel._files import make_folder, write_files
from masrel.errors import ScheduleError
from masrel.lab._bounded_files import MAX_SMALL, read_regular
from masrel.lab.protocol import StudyPaths

N_BYTES = 16
"""Bytes of a secret: 128 bits, which nobody can try one by one."""

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
        """Return the secret of a study with its commitment."""
        return cls(commitment_of(secret), secret)

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
        return site_secret(self.secret, str(site))

    def draws(self, site: str | None, commitment: str | None) -> bool:
        """Return whether it can draw again what was drawn for a site."""
        return self.commitment == commitment and self.site in (None, site)


def site_secret(secret: bytes, site: str) -> bytes:
    """Return the secret of a site, which says nothing of the study's or another's."""
    name = json.dumps(["masrel", "site", site], separators=(",", ":"))
    return hmac.digest(secret, name.encode("ascii"), "sha256")[:N_BYTES]


def commitment_of(secret: bytes) -> str:
    """Return the SHA-256 that says which secret was used without saying it."""
    name = json.dumps(["masrel", "commitment", secret.hex()], separators=(",", ":"))
    return hashlib.sha256(name.encode("ascii")).hexdigest()


def check_secret(secret: bytes) -> None:
    """Refuse a secret of another length."""
    if len(secret) != N_BYTES:
        raise ScheduleError(f"secret: needed {N_BYTES} bytes, got {len(secret)}")


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
    make_folder(study.secret_file.parent, mode=0o700)
    text = secret_text(secret)
    write_files({study.secret_file: text}, within=study.root, mode=0o600)
    return StudySecret.of_study(secret)


def site_secret_text(key: StudySecret, site: str) -> str:
    """Return the text of the file of a site's secret, derived from the study's."""
    return (
        f"format: 2\nsite: {site}\nsecret: {key.of(site).hex()}\n"
        f"commitment: {key.commitment}\n"
    )


def secret_text(secret: bytes) -> str:
    """Return the text of the file of a secret."""
    return f"format: 1\nsecret: {secret.hex()}\n"


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
