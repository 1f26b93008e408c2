"""The secret from which a study's orders and codes are drawn, and its file."""

import hashlib
import json
import re
import secrets
from pathlib import Path

from masrel._files import make_folder, write_files
from masrel._input import MAX_SMALL, read_regular
from masrel.errors import ScheduleError
from masrel.protocol import StudyPaths

N_BYTES = 16
"""Bytes of a secret: 128 bits, which nobody can try one by one."""

_TEXT = re.compile(r"format: 1\nsecret: ([0-9a-f]{32})\n?")


def commitment_of(secret: bytes) -> str:
    """Return the SHA-256 that says which secret was used without saying it."""
    name = json.dumps(["masrel", "commitment", secret.hex()], separators=(",", ":"))
    return hashlib.sha256(name.encode("ascii")).hexdigest()


def check_secret(secret: bytes) -> None:
    """Refuse a secret of another length."""
    if len(secret) != N_BYTES:
        raise ScheduleError(f"secret: needed {N_BYTES} bytes, got {len(secret)}")


def find_secret(study: StudyPaths) -> bytes | None:
    """Return the secret of a study, published or not; None when there is no file."""
    files = (study.secret_file, study.published_secret_file)
    there = {file: _read(file) for file in files if file.is_file()}
    if len(set(there.values())) > 1:
        raise ScheduleError(
            f"{study.published_secret_file}: needed the secret of {study.secret_file}, "
            "got another"
        )
    return next(iter(there.values()), None)


def new_secret(study: StudyPaths) -> bytes:
    """Draw the secret of a study and keep it where only its owner can read it."""
    secret = secrets.token_bytes(N_BYTES)
    make_folder(study.secret_file.parent, mode=0o700)
    text = secret_text(secret)
    write_files({study.secret_file: text}, within=study.root, mode=0o600)
    return secret


def secret_text(secret: bytes) -> str:
    """Return the text of the file of a secret."""
    return f"format: 1\nsecret: {secret.hex()}\n"


def _read(file: Path) -> bytes:
    text = read_regular(file, most=MAX_SMALL).decode("utf-8", errors="replace")
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ScheduleError(
            f"{file}: needed a line 'format: 1' and a line 'secret: ' with "
            f"{2 * N_BYTES} hexadecimal digits, got another text"
        )
    return bytes.fromhex(match[1])
