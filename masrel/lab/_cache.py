"""A folder of what was made before, by what it was made from.

In: the values that something is made from. Out: what was made of the same values by the
same code, if it is there whole. Whatever is wrong with the folder, it is made again.
"""

import contextlib
import dataclasses
import hashlib
import json
import os
import struct
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_RECORDING, read_regular, regular

FOLDER = ".masrel_cache"
"""What the folder is called in a study."""

_MOST_BYTES = 256_000_000
_FORMAT = b"masrel made 1 "
_ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # of masrel
_MACHINE = os.uname().machine if sys.platform != "win32" else sys.platform
_PYTHON = f"{sys.implementation.name} {sys.version} {_MACHINE}"
_TICK_NS = 3_000_000_000
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_SOURCES = (".py", ".html", ".css", ".md", ".toml", ".bib")
# Nobody wants it in a repository, or in a backup (https://bford.info/cachedir/)
_MARKS = {
    ".gitignore": "*\n",
    "CACHEDIR.TAG": "Signature: 8a477f597d28d172789f06886806bc55\n",
}


@dataclass(slots=True)
class Cache:
    """What was made before, in a folder; without one nothing is stored."""

    folder: Path | None
    is_read_only: bool = False
    _is_broken: bool = field(default=False, init=False)  # a write has failed

    def key(self, kind: str, *read: object, libraries: tuple[str, ...]) -> str | None:
        """Return the key of what is made of values by libraries; None of unknown."""
        known = installed()
        if self.folder is None or not all(name in known for name in libraries):
            return None
        made_by = {name: known[name] for name in libraries}
        try:
            return content_hash(kind, code_hash(), made_by, read)
        except TypeError:  # a value without a hash is made every time
            return None

    def read(self, key: str | None) -> dict[str, bytes] | None:
        """Return the parts that were kept under a key; None if they are not whole."""
        if self.folder is None or key is None:
            return None
        try:
            data = read_regular(self.folder / key, most=MAX_RECORDING)
            head, _, body = data.partition(b"\n")
            if head != _FORMAT + _seal(key, body):
                return None
            index, _, rest = body.partition(b"\n")
            parts, first = {}, 0
            for name, size in json.loads(index):
                parts[name] = rest[first : first + size]
                first += size
        except (OSError, ValueError):
            return None
        return parts

    def write(self, key: str | None, parts: Mapping[str, bytes]) -> None:
        """Keep parts under a key, or do without."""
        if self.folder is None or key is None or self.is_read_only or self._is_broken:
            return
        index = json.dumps([[name, len(part)] for name, part in parts.items()])
        body = b"".join([index.encode(), b"\n", *parts.values()])
        try:
            if not self.folder.exists():
                for name, text in _MARKS.items():
                    write_file(self.folder / name, text)
            write_file(
                self.folder / key, b"\n".join([_FORMAT + _seal(key, body), body])
            )
        except (OSError, ParameterError):  # full, read-only, no folder, a link
            self._is_broken = True

    def remove_oldest(self) -> None:
        """Take away what was kept first, until the folder is of a bearable size."""
        if self.folder is None or self.is_read_only:
            return
        with contextlib.suppress(OSError):  # another process may be as fast
            stored = [(entry.stat(), entry.path) for entry in os.scandir(self.folder)]
            stored.sort(key=lambda each: each[0].st_mtime_ns)
            too_many = sum(status.st_size for status, _ in stored) - _MOST_BYTES
            for status, path in stored:
                if too_many > 0 and len(os.path.basename(path)) == _N_HEX:
                    os.unlink(path)
                    too_many -= status.st_size


_N_HEX = 64


def _seal(key: str, body: bytes) -> bytes:
    # Of both: a file under another's name is of no use.
    return hashlib.sha256(key.encode() + body).hexdigest().encode()


def file_hash(path: str) -> str | None:
    """Return the SHA-256 of a file; None where there is none that can be read."""
    digest = hashlib.sha256()
    try:
        # a pipe without a writer keeps nobody waiting
        descriptor = regular(os.open(path, _FLAGS), Path(path))
        try:
            while data := os.read(descriptor, 1 << 20):
                digest.update(data)
        finally:
            os.close(descriptor)
    except OSError:
        return None
    return digest.hexdigest()


def file_status(path: str) -> tuple[int, ...] | None:
    """Return what changes whenever a file is written; None where there is none."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)


def is_settled(status: tuple[int, ...] | None) -> bool:
    """Return whether a file that is written from now on has another status."""
    # Within a tick of a file system's clock it could have the same.
    return status is not None and max(status[2:]) < time.time_ns() - _TICK_NS


@cache
def code_hash() -> str:
    """Return a hash of all that makes a report, but for other libraries."""
    # Every file of masrel: who edits its code has no other version.
    digest = hashlib.sha256(_PYTHON.encode())
    for path in _source_files(_ROOT):
        digest.update(f"{path[len(_ROOT) :]}\0{file_hash(path)}\n".encode())
    return digest.hexdigest()


def code_status() -> str | None:
    """Return what changes whenever that code is written, if it is settled."""
    files = [(path, file_status(path)) for path in _source_files(_ROOT)]
    if not all(is_settled(status) for _, status in files):
        return None
    return hashlib.sha256(f"{_PYTHON} {files}".encode()).hexdigest()


def _source_files(folder: str) -> Iterator[str]:
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.name.endswith(_SOURCES):
            yield entry.path
        elif entry.name != "__pycache__" and entry.is_dir():
            yield from _source_files(entry.path)


@cache
def installed() -> dict[str, str]:
    """Return the version of every library that Python finds, by its name."""
    # By the names of folders: importlib.metadata takes longer than all else here.
    versions: dict[str, str] = {}
    for folder in sys.path:
        try:
            names = os.listdir(folder or ".")
        except OSError:  # such as a zip
            continue
        for name in names:
            if name.endswith((".dist-info", ".egg-info")):
                library, _, version = name.rpartition(".")[0].partition("-")
                versions.setdefault(library.lower().replace("_", "-"), version)
    return versions


def content_hash(*values: object) -> str:
    """Return a hash of plain values, arrays and results; TypeError of any other."""
    digest = hashlib.sha256()
    for part in _tokens(values):
        digest.update(part)
    return digest.hexdigest()


def _tokens(value: object) -> Iterator[bytes]:
    # Each says its kind and its length, so that no two values have the same ones.
    if value is None or isinstance(value, bool | int | float | str):
        # a note that knows its kind is the text that it is when it is read again
        kind = "str" if isinstance(value, str) else type(value).__name__
        yield _token(kind, repr(value).encode())
    elif isinstance(value, bytes):
        yield _token("bytes", value)
    elif isinstance(value, os.PathLike):
        yield _token("path", os.fsencode(value))
    elif isinstance(value, tuple | list):
        yield _token("sequence", str(len(value)).encode())
        if value and all(type(each) is float for each in value):
            yield _token("floats", struct.pack(f"<{len(value)}d", *value))
            return
        for each in value:
            yield from _tokens(each)
    elif isinstance(value, Mapping):
        yield _token("mapping", str(len(value)).encode())
        for pair in value.items():
            yield from _tokens(pair)
    else:
        yield from _tokens_of_object(value)


def _tokens_of_object(value: object) -> Iterator[bytes]:
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    array: Any = value
    if hasattr(array, "tobytes") and hasattr(array, "dtype"):  # numpy's
        yield _token(kind, repr((array.dtype.str, array.shape)).encode())
        if array.dtype.hasobject:
            yield from _tokens(array.tolist())
        else:
            yield _token("bytes", array.tobytes())
        return
    names: tuple[str, ...] | None = getattr(value, "__struct_fields__", None)  # msgspec
    if names is None and dataclasses.is_dataclass(value):
        names = tuple(field.name for field in dataclasses.fields(value))
    if names is None:
        raise TypeError(kind)
    yield _token(kind, str(len(names)).encode())
    for name in names:
        yield from _tokens((name, getattr(value, name)))


def _token(kind: str, data: bytes) -> bytes:
    return b"%s %d\n%s\n" % (kind.encode(), len(data), data)
