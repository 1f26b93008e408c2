"""Files of a study as they are read: regular, of a bounded size and depth.

No pipe or device holds a command up, no file fills the memory, and no nesting or number
ends in an error of the parser.
"""

import errno
import io
import json
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

# The most bytes of a protocol, a model file, a schedule, a sheet, facts of a recording
MAX_SMALL = 1_000_000
# of a table of ratings, or a session log
MAX_TABLE = 64_000_000
# of a recording, and of what one is unpacked to: half an hour at 1 kHz
MAX_RECORDING = 128_000_000

# of a file that grows while it is read
_PIECE = 65_536

# Each missing on some systems
_NO_WAIT = getattr(os, "O_NONBLOCK", 0)
_BINARY = getattr(os, "O_BINARY", 0)

# Tables and arrays inside each other; a protocol has four
_MAX_DEPTH = 32
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""  # of a key
_LONG_KEY = re.compile(
    rf"""(?<![\w"'.-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_MAX_DEPTH}}}"""
)
# A spreadsheet fills a line up with separators
_CSV_FORMAT = re.compile(r"# *format: *([^\s,;]{1,18})")
_MAX_BITS = 1024  # of a whole number: what is longer cannot always be shown


def read_regular(path: Path, *, most: int) -> bytes:
    """Return the bytes of a regular file of at most so many."""
    # A pipe without a writer would keep it waiting, and a device never ends.
    descriptor = os.open(path, os.O_RDONLY | _NO_WAIT | _BINARY)
    regular(descriptor, path)
    try:
        # room for what is there, not for the most that there may be
        data = os.read(descriptor, min(os.fstat(descriptor).st_size, most) + 1)
        while len(data) <= most and (more := os.read(descriptor, _PIECE)):
            data += more
    finally:
        os.close(descriptor)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"larger than {most} bytes", str(path))
    return data


def regular(descriptor: int, path: Path) -> int:
    """Return a descriptor that is of a file; close any other and refuse it."""
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    os.close(descriptor)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    raise OSError(errno.EINVAL, "not a regular file", str(path))


def csv_format(text: str) -> object:
    """Return the version that a CSV file names at its head; 1 where it names none."""
    for line in io.StringIO(text):
        if not line.startswith("#"):
            break
        named = _CSV_FORMAT.match(line)
        if named:
            return int(named[1]) if named[1].isdecimal() else named[1]
    return 1


def format_problem(version: object, *, newest: int) -> str | None:
    """Return why a file of this version of its format is not read, or None."""
    if type(version) is int and 1 <= version <= newest:  # true is no number
        return None
    known = "1" if newest == 1 else f"1 to {newest}"
    return f"needed format {known}, got {version!r}"


def parse_json(text: str | bytes) -> Any:
    """Return what a JSON text holds; ValueError says why it cannot be read."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None


def parse_toml(data: bytes) -> dict[str, Any]:
    """Return what a TOML file holds; ValueError says why it cannot be read."""
    import tomllib  # a file of ratings needs none

    # utf-8-sig: some editors put a byte order mark first.
    text = data.decode("utf-8-sig")
    if _LONG_KEY.search(text):  # tomllib takes the square of its length
        raise ValueError(f"a key of more than {_MAX_DEPTH} parts, nested too deep")
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None
    level: list[object] = [content]
    for _ in range(_MAX_DEPTH):
        level = [part for value in level for part in _parts(value)]
    if level:
        raise ValueError(f"nested deeper than {_MAX_DEPTH} tables or arrays")
    return content


def _parts(value: object) -> list[object]:
    if isinstance(value, int) and value.bit_length() > _MAX_BITS:
        raise ValueError(f"a whole number of more than {_MAX_BITS} bits")
    if isinstance(value, Mapping):
        return list(value.values())
    return value if isinstance(value, list) else []
