"""What goes out: files that replace no primary record, cells that are no formulas."""

import errno
import os
import re
import shutil
from pathlib import Path

from masrel.errors import ParameterError

# A cell that begins a formula, and a number that merely begins like one
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")

# Where a study's primary records are, which no output replaces
_PROTOCOL = "protocol.toml"
_RECORD_FOLDERS = ("schedules", "sessions", "conduct", ".key")
_SOURCES = (
    ("ratings", "published.csv"),
    ("ratings", "in_person.csv"),
    ("conduct.jsonl",),
)


def write_file(path: Path, data: bytes | str) -> None:
    """Write what can be computed again: whole, through no link, or not at all."""
    # what a study must not lose is written by `masrel.lab._durable_files`
    refuse_record(path)
    if path.exists() and not path.is_file():  # such as /dev/stdout
        raise OSError(errno.EINVAL, "needs to be a file, or nothing yet", str(path))
    if path.is_file() and not os.access(path, os.W_OK):  # it is to stay as it is
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    part = path.with_name(f".masrel-{os.urandom(8).hex()}.part")
    try:
        part.write_bytes(data.encode() if isinstance(data, str) else data)
        if path.exists() and not path.is_symlink():
            shutil.copymode(path, part)
        os.replace(part, path)
    except OSError as error:  # nobody knows the part
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        part.unlink(missing_ok=True)


def refuse_record(path: Path) -> None:
    """Refuse an output in the place of a study's protocol, schedule, log and so on."""
    place = path.parent.resolve() / path.name
    for root in place.parents:
        parts = place.relative_to(root).parts
        is_record = parts[0] in _RECORD_FOLDERS or parts in _SOURCES
        if (is_record or parts == (_PROTOCOL,)) and (root / _PROTOCOL).is_file():
            raise ParameterError(
                f"{path}: needs a file that is no primary record, got one of the "
                f"study {root}"
            )


def safe_cell(text: str) -> str:
    """Return a text as a cell of CSV that no spreadsheet runs as a formula."""
    # after an apostrophe; a text that begins with apostrophes and then like a formula
    # gets one more, so that what is read is what was written
    if _FORMULA.match(text) and not _NUMBER.fullmatch(text):
        return f"'{text}"
    return text


def from_safe_cell(cell: str) -> str:
    """Return the text of a cell that `safe_cell` may have made."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
