"""Files of a study: read within limits and once, written bit by bit, added to.

What is read is regular, of a bounded size and depth: no pipe or device holds a command
up, no file fills the memory, and no nesting or number ends in an error of the parser.
"""

import csv
import errno
import functools
import hashlib
import io
import json
import math
import os
import re
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from datetime import date, time
from pathlib import Path
from typing import Any, TextIO, TypeVar

from masrel._files import (
    BINARY,
    NO_FOLLOW,
    PART_BEGINS,
    PART_ENDS,
    make_folder,
    naming,
    new_part,
    on_disk,
    refuse_record,
    remove_left_over,
    safe_cell,
    sync_folder,
)
from masrel.errors import MasrelError, ParameterError

# What an event of a log, or a recording, has by a name; also that of each of several
Fact = str | int | float | bool | None
Facts = Fact | Sequence[Mapping[str, Fact]]

# The most bytes of a protocol, a model file, a schedule, a sheet, facts of a recording
MAX_SMALL = 1_000_000
# of a table of ratings, or a session log
MAX_TABLE = 64_000_000
# of a recording, and of what one is unpacked to: half an hour at 1 kHz
MAX_RECORDING = 128_000_000

# What names every file of a report with its hash; what stands there while it is made
MANIFEST, UNFINISHED = "manifest.json", "unfinished.json"
CUT_OFF = "is incomplete because writing was interrupted; masrel report writes it again"


def is_cut_off(report: Path) -> bool:
    """Return whether a report was not finished: its manifest comes last."""
    # also where somebody has taken the manifest away
    names = (UNFINISHED, "report.html", "report.md", "report.tex", "report.docx")
    return not (report / MANIFEST).is_file() and any(
        (report / name).is_file() for name in names
    )


# of a file that grows while it is read
_PIECE = 65_536

# missing on some systems
_NO_WAIT = getattr(os, "O_NONBLOCK", 0)

# Tables and arrays inside each other; a protocol has four
_MAX_DEPTH = 32
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""  # of a key
_LONG_KEY = re.compile(
    rf"""(?<![\w"'.-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_MAX_DEPTH}}}"""
)
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
# A spreadsheet fills a line up with separators
_CSV_FORMAT = re.compile(r"# *format: *([^\s,;]{1,18})")
_MAX_BITS = 1024  # of a whole number: what is longer cannot always be shown


def read_regular(path: Path, *, most: int, follows: bool = True) -> bytes:
    """Return the bytes of a regular file, or of a link to one; at most `most`."""
    # A pipe without a writer would keep it waiting, and a device never ends.
    if follows:
        descriptor = regular(os.open(path, os.O_RDONLY | _NO_WAIT | BINARY), path)
    else:
        descriptor = no_follow(str(path), os.O_RDONLY)
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


def sha256_of(content: bytes | memoryview) -> str:
    """Return the SHA-256 of what a file holds, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def repeated(values: Sequence[str]) -> list[bool]:
    """Return of each value whether it stands there before, in linear time."""
    first = {value: place for place, value in reversed([*enumerate(values)])}
    return [first[value] < place for place, value in enumerate(values)]


def csv_format(text: str) -> object:
    """Return the version that a CSV file names at its head; 1 where it names none."""
    for line in io.StringIO(text):
        if not line.startswith("#"):
            break
        named = _CSV_FORMAT.match(line)
        if named:
            return int(named[1]) if named[1].isdecimal() else named[1]
    return 1


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as the text of a CSV file."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def format_problem(version: object, *, newest: int) -> str | None:
    """Return why a file of this version of its format is not read, or None."""
    if type(version) is int and 1 <= version <= newest:  # true is no number
        return None
    known = "1" if newest == 1 else f"1 to {newest}"
    return f"needed format {known}, got {version!r}"


def check_format(
    path: Path, version: object, *, newest: int, error: type[MasrelError]
) -> None:
    """Refuse a file of a version of its format that is not read."""
    problem = format_problem(version, newest=newest)
    if problem is not None:
        raise error(f"{path}: {problem}")


def parse_json(text: str | bytes) -> Any:
    """Return what a JSON text holds; ValueError says why it cannot be read."""
    try:
        return json.loads(text, object_pairs_hook=_distinct)
    except RecursionError:
        raise ValueError("nested too deep") from None


def read_object(path: Path) -> dict[str, Any] | None:
    """Return the object that a JSON file holds; None where it holds none."""
    try:
        document = parse_json(read_regular(path, most=MAX_TABLE))
    except (FileNotFoundError, ValueError):
        return None
    return document if isinstance(document, dict) else None


YES_NO = ("no", "yes")
"""Cells of False and True."""


def is_unknown(value: object) -> bool:
    """Return whether a table has no value here."""
    return value is None or (isinstance(value, float) and math.isnan(value))


def table_csv(
    columns: Iterable[str],
    rows: Iterable[Iterable[object]],
    *,
    head: Iterable[str],
    absent: str = "NA",
) -> str:
    """Return the text of a table of a study: comments, names of columns, rows."""
    cells = ([_cell(value, absent) for value in row] for row in rows)
    return "".join(f"# {line}\n" for line in head) + csv_text([columns, *cells])


def _cell(value: object, absent: str) -> str:
    if is_unknown(value):
        return absent
    if isinstance(value, bool):
        return YES_NO[value]
    if isinstance(value, tuple):
        return ";".join(_cell(part, absent) for part in value)
    return repr(value) if isinstance(value, float) else safe_cell(str(value))


def leaves(
    document: Any, place: str = "", *, within: tuple[type, ...] = (dict,)
) -> Iterator[tuple[str, str]]:
    """Yield the places of a document, and the JSON of what stands there."""
    # within: what is gone into; anything else, and what is empty, stands in one place
    if type(document) in within and document:
        named = document if isinstance(document, dict) else dict(enumerate(document))
        for name, part in named.items():
            yield from leaves(part, f"{place}.{name}".lstrip("."), within=within)
    else:
        yield place, json.dumps(document, ensure_ascii=False)


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    # of two values of one key a reader may take either
    table = dict(pairs)
    if len(table) < len(pairs):
        raise ValueError("a key is there twice")
    return table


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


def toml_lines(table: Mapping[str, Any], place: str = "") -> Iterator[str]:
    """Give the lines of a TOML file; ValueError says what it cannot hold."""
    # what is no table comes first, so that it does not belong to one
    parts = {name: value for name, value in table.items() if _is_table(value)}
    for name, value in table.items():
        if name not in parts:
            yield f"{_toml_key(name)} = {_toml_value(value)}"
    for name, value in parts.items():
        where = f"{place}.{_toml_key(name)}".lstrip(".")
        if isinstance(value, Mapping):
            yield from ("", f"[{where}]", *toml_lines(value, where))
        else:
            for entry in value:
                yield from ("", f"[[{where}]]", *toml_lines(entry, where))


def _is_table(value: object) -> bool:
    entries = value if isinstance(value, list) and value else [value]
    return all(isinstance(entry, Mapping) for entry in entries)


def _toml_key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _toml_value(name)


def _toml_value(value: object) -> str:
    if isinstance(value, Mapping):
        pairs = (f"{_toml_key(k)} = {_toml_value(v)}" for k, v in value.items())
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml_value, value))}]"
    if isinstance(value, date | time):  # a datetime too
        return value.isoformat()
    is_number = isinstance(value, int | float) and math.isfinite(value)
    if not is_number and not isinstance(value, str):
        raise ValueError(f"needs text, a finite number or a list, got {value!r}")
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


@contextmanager
def new_file(path: Path) -> Iterator[TextIO]:
    """Give a text to write an output into bit by bit; at the end it gets its name."""
    refuse_record(path)
    part, descriptor = new_part(path)
    try:
        with on_disk(path, descriptor) as out:
            text = io.TextIOWrapper(out, encoding="utf-8", newline="")
            yield text
            text.detach()  # with all of it, and not closed before it is on disk
        with naming(path):
            os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    remove_left_over(path.parent)
    sync_folder(path.parent)


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Give a folder to write into; at the end it gets its name, at a stop it goes."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ParameterError(f"{folder}: needed a new or empty folder, got another")
    make_folder(folder.parent)
    part = folder.with_name(f"{PART_BEGINS}{os.urandom(8).hex()}{PART_ENDS}")
    try:
        part.mkdir()
        yield part
        os.replace(part, folder)
    except OSError as error:
        place = Path(str(error.filename))
        if place.is_relative_to(part):  # nobody knows it
            error.filename = str(folder / place.relative_to(part))
            error.filename2 = None
        raise
    finally:
        shutil.rmtree(part, ignore_errors=True)
    sync_folder(folder.parent)


def no_follow(path: str, flags: int, mode: int = 0o600) -> int:
    """Open a file that is added to, an `opener` for ``open``; refuse a link or pipe."""
    try:
        descriptor = os.open(path, flags | NO_FOLLOW | _NO_WAIT | BINARY, mode)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OSError(
                errno.ELOOP, "is a link, which is not followed", path
            ) from None
        raise
    return regular(descriptor, Path(path))


_About = TypeVar("_About")
_Answer = TypeVar("_Answer")

_memory: ContextVar[dict[Any, Any] | None] = ContextVar("_memory", default=None)
_then: ContextVar[Mapping[str, int]] = ContextVar("_then")


@contextmanager
def read_once() -> Iterator[None]:
    """Within it, what a file said when it was first read is what it says."""
    memory = _memory.get()  # one within another remembers with it
    token = _memory.set({} if memory is None else memory)
    try:
        yield
    finally:
        _memory.reset(token)


def as_then(
    n_lines: Mapping[str, int], answer: Callable[[_About], _Answer], about: _About
) -> _Answer:
    """Return what a function says while logs end at these numbers of lines."""
    context = copy_context()
    context.run(_then.set, n_lines)
    return context.run(answer, about)


def lines_then(path: Path) -> int | None:
    """Return in how many lines a log says what it says; None for all there are."""
    return _then.get({}).get(str(path))


def once(answer: Callable[[_About], _Answer]) -> Callable[[_About], _Answer]:
    """Remember within `read_once` what a function said of a path, or of an object."""

    @functools.wraps(answer)
    def remembered(about: _About) -> _Answer:
        memory = _memory.get()
        if memory is None:
            return answer(about)
        key = (
            (answer, str(about), lines_then(about))
            if isinstance(about, Path)
            else (answer, id(about))
        )
        if key not in memory:
            memory[key] = about, answer(about)  # nothing else gets its id meanwhile
        result: _Answer = memory[key][1]
        return result

    return remembered
