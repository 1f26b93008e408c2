"""Whether a report is what a build would write, seen before anything is loaded.

In: a call of ``masrel report``, and what the last build of the same call left in the
cache: the hash of every file that it read, of the names of all files there were, and of
what it wrote. Out: what that build shown, if all of it still holds.
"""

import json
import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from masrel.lab._bounded_files import MAX_TABLE, parse_json, read_regular
from masrel.lab._cache import (
    Cache,
    code_hash,
    code_status,
    content_hash,
    file_hash,
    file_status,
    installed,
    is_settled,
)
from masrel.lab.report._report_folder import MANIFEST, stale_assets

_NOTE = "note"
# What a user sets or matplotlib keeps: figures are drawn in the report's style alone
_OF_MATPLOTLIB = re.compile(r"matplotlibrc|fontlist-v.*\.json|.*\.mplstyle")
_DEPTH = 3  # of the folders in a study whose files are listed
_HIDDEN = ".key"  # the one hidden folder of a study that has files of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """A call of ``masrel report``."""

    study: Path
    folder: Path  # of the report
    options: Mapping[str, object]  # all of the call that changes what is made or said
    cache: Cache

    def last(self) -> dict[str, Any] | None:
        """Return what the last build has shown if a new one would change nothing."""
        stored = self.cache.read(self._key())
        if stored is None:
            return None
        note: dict[str, Any] = parse_json(stored[_NOTE])
        is_current = (
            # first: the same code has left the same kind of note
            _is_same_code(note.get("code"))
            and note["made_from"] == self._made_from()
            and all(_is_same(path, *known) for path, known in note["read"].items())
            and _is_whole(self.folder, note["manifest"])
        )
        shown: dict[str, Any] = note["shown"]
        return shown if is_current else None

    @contextmanager
    def noted(self) -> Iterator[dict[str, Any]]:
        """Keep what a build has read with what it says of itself in what is given."""
        # To be filled in: the hash of its manifest, and what it has shown
        made: dict[str, Any] = {}
        # Listed before anything is read: a file that comes later is a change.
        made_from, code = self._made_from(), (code_hash(), code_status())
        with _files_read(self.study, self._outputs()) as readings:
            yield made
        if not readings.are_as_they_were():
            return
        note = {
            **made,
            "made_from": made_from,
            "code": {"sha256": code[0], "status": code[1]},
            "read": {
                path: (digest, status if is_settled(status) else None)
                for path, (digest, status) in readings.files.items()
            },
        }
        self.cache.write(self._key(), {_NOTE: json.dumps(note).encode()})
        self.cache.remove_oldest()

    def _key(self) -> str:
        # Paths as they were typed, too: they are in what is said.
        places = [self.study, self.folder]
        at = [os.path.abspath(place) for place in places]
        font = os.environ.get("MASREL_FONT")
        call = ([str(p) for p in places], at, sorted(self.options.items()), font)
        return content_hash("build", call)

    def _made_from(self) -> str:
        return content_hash(installed(), *_listing(self.study, self._outputs(), _DEPTH))

    def _outputs(self) -> tuple[str, ...]:
        folders = (self.folder, self.cache.folder)
        return tuple(os.path.abspath(folder) for folder in folders if folder)


def _listing(folder: Path | str, but: tuple[str, ...], depth: int) -> Iterator[str]:
    # What a study has or has not is seen without any file being opened.
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        yield f"{folder}: {error.errno}"
        return
    for entry in entries:
        if entry.name.startswith(".") and entry.name != _HIDDEN:
            continue
        if os.path.abspath(entry.path) in but:
            continue
        is_folder = entry.is_dir()
        yield f"{entry.path}{'/' * is_folder}"
        if is_folder and depth:
            yield from _listing(entry.path, but, depth - 1)


def _is_same_code(code: object) -> bool:
    if not isinstance(code, dict):
        return False
    status = code.get("status")
    if status is not None and code_status() == status:
        return True
    return code_hash() == code.get("sha256")


def _is_same(path: str, digest: str | None, status: list[int] | None) -> bool:
    # Its hash is not computed again where it cannot have been written since.
    if status is not None and file_status(path) == tuple(status):
        return True
    return file_hash(path) == digest


def _is_whole(folder: Path, manifest: str | None) -> bool:
    # Whether a report is there as it was written, and nothing that a build would remove
    path = folder / MANIFEST
    if manifest is None or file_hash(str(path)) != manifest:
        return False
    files = parse_json(read_regular(path, most=MAX_TABLE))["files"]
    return not any(
        os.path.islink(folder / name) or file_hash(str(folder / name)) != digest
        for name, digest in files.items()
    ) and not any(stale_assets(folder, files))


class _Readings:
    """The files that this process opens to read, each as it was at first."""

    def __init__(self, study: Path, but: tuple[str, ...]) -> None:
        # hash, or None of what could not be read; size and times
        self.files: dict[str, tuple[str | None, tuple[int, ...] | None]] = {}
        self._study = os.path.join(os.path.abspath(study), "")
        self._outputs = tuple(os.path.join(folder, "") for folder in but)
        libraries = os.path.dirname(os.path.dirname(os.__file__))
        self._code = (os.path.join(libraries, ""), os.path.join(_MASREL, ""))

    def add(self, path: str) -> None:
        """Note a file, unless it is code or was written by a build."""
        if path in self.files or path.startswith(self._outputs):
            return
        is_code = path.startswith(self._code) or "-packages" + os.sep in path
        is_code |= bool(_OF_MATPLOTLIB.fullmatch(os.path.basename(path)))
        if (is_code and not path.startswith(self._study)) or os.path.isdir(path):
            return
        self.files[path] = (None, None)  # it is opened once more here
        self.files[path] = (file_hash(path), file_status(path))

    def are_as_they_were(self) -> bool:
        """Return whether no file has changed since it was noted."""
        return all(
            file_status(path) == status for path, (_, status) in self.files.items()
        )


_MASREL = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_readings: list[_Readings] = []
"""Where files that are opened are noted: in one place, or in none."""

_hooks: list[object] = []


def _see(event: str, args: tuple[Any, ...]) -> None:
    # Python calls this at every opening of a file, and can never be told not to.
    if event != "open" or not _readings or not isinstance(args[0], str | os.PathLike):
        return
    if not args[2] & (os.O_WRONLY | os.O_RDWR):
        _readings[0].add(os.path.abspath(os.fsdecode(args[0])))


@contextmanager
def _files_read(study: Path, but: tuple[str, ...]) -> Iterator[_Readings]:
    # Python's own audit sees every file: no reader is forgotten.
    if not _hooks:
        sys.addaudithook(_see)
        _hooks.append(_see)
    _readings.append(_Readings(study, but))
    try:
        yield _readings[0]
    finally:
        _readings.clear()
