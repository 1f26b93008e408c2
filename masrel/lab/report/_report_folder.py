"""The folder of a report, whose pages are whole at any moment, and when it is current.

Tables and figures have the start of their hash in their names, so that those of a new
report never take the place of those that a page still shows. They are on disk before
the first page is replaced; the manifest names them all; then those go that it does not
name, also of a report that was never finished. What else is in the folder stays.

A report is current if it was made by the same call, of the same files, by the same
code: a note in a folder of the study has their hash. Nothing heavy is loaded for it.
"""

import contextlib
import hashlib
import json
import os
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from masrel._files import (
    make_folder,
    refuse_record,
    sync_folder,
    write_file,
    write_files,
)
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_TABLE, read_regular, regular

if sys.platform != "win32":
    import fcntl

MANIFEST = "manifest.json"
NUMBERS = "analysis.json"

_N_HEX = 16  # of a hash in a name
_ASSET_FOLDERS = ("tables", "figures")
_ASSET = re.compile(r"(?:tables|figures)/[\w.-]+-([0-9a-f]{16})\.(?:csv|png|svg)")


def asset_name(folder: str, name: str, form: str, data: bytes) -> str:
    """Return the name of a table or a figure, from the report's folder."""
    return f"{folder}/{name}-{_hash(data)[:_N_HEX]}.{form}"


def report_files(
    assets: Mapping[str, bytes],
    pages: Mapping[str, bytes],
    inputs: Mapping[str, str],
    *,
    pandoc: str | None = None,
) -> dict[str, bytes]:
    """Return every file of a report in the order in which they are written."""
    # pandoc: its version, where it made a page
    # Imported here: whether a report is current is known without it.
    from masrel.lab.verification.record import _REPORT_FORMAT

    written = {**assets, **pages}
    document = {
        "format": _REPORT_FORMAT,
        "inputs": dict(inputs),
        "files": {place: _hash(data) for place, data in written.items()},
        **({} if pandoc is None else {"pandoc": pandoc}),
    }
    manifest = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    return {**written, MANIFEST: manifest.encode()}


def replace_report(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put the files of a report into a folder, in the place of the one there is."""
    for name in files:
        if "/" not in name:
            refuse_record(folder / name)
    with _alone(folder):
        stale = [*stale_assets(folder, files), *stale_pages(folder, files)]
        new = {folder / place: files[place] for place in changed_files(folder, files)}
        assets = {path: data for path, data in new.items() if path.parent != folder}
        write_files(assets, within=folder)
        for path, data in new.items():  # the pages, and the manifest last
            if path not in assets:
                write_files({path: data}, within=folder)
        _remove(stale)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    # Of two builds at once one waits: else it would remove what the other links to.
    make_folder(folder)
    if sys.platform == "win32":
        yield
        return
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # a file system without locks
            descriptor = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, descriptor)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield


def _remove(paths: Sequence[Path]) -> None:
    for path in paths:
        path.unlink()
    for folder in dict.fromkeys(path.parent for path in paths):
        sync_folder(folder)


def changed_files(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """Return those files of a report that are not in a folder as they should be."""
    return [p for p, data in files.items() if not _is_there(folder / p, data)]


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _is_there(path: Path, data: bytes) -> bool:
    return not path.is_symlink() and file_hash(str(path)) == _hash(data)


def stale_pages(folder: Path, named: Collection[str]) -> Iterator[Path]:
    """Yield pages of the last report in a folder that this one does not have."""
    # Only if nobody has written in them since: the manifest has their hashes.
    hashes = _hashes_in(folder)
    for name in ("report.html", "report.md", "report.tex", "report.docx"):
        page = folder / name
        if name in named or name not in hashes or page.is_symlink():
            continue
        if hashes[name] == file_hash(str(page)):
            yield page


def _hashes_in(folder: Path) -> dict[str, str]:
    # what its manifest says of the files of a report; nothing if there is none
    try:
        document = json.loads(read_regular(folder / MANIFEST, most=MAX_TABLE))
    except (OSError, ValueError):
        return {}
    files = document.get("files") if isinstance(document, dict) else None
    pairs = files.items() if isinstance(files, dict) else ()
    return {name: digest for name, digest in pairs if isinstance(digest, str)}


def stale_assets(folder: Path, named: Collection[str]) -> Iterator[Path]:
    """Yield tables and figures of a folder that its report does not name."""
    # Only what a report wrote: its name holds its hash.
    for name in _ASSET_FOLDERS:
        inside = folder / name
        if inside.is_symlink() or not inside.is_dir():
            continue
        for path in sorted(inside.iterdir()):
            place = f"{name}/{path.name}"
            asset = _ASSET.fullmatch(place)
            if asset is None or place in named or path.is_symlink():
                continue
            digest = file_hash(str(path))
            if digest is not None and digest.startswith(asset[1]):
                yield path


def file_hash(path: str) -> str | None:
    """Return the SHA-256 of a file; None where there is none that can be read."""
    try:
        # a pipe without a writer keeps nobody waiting
        descriptor = regular(os.open(path, _FLAGS), Path(path))
        with open(descriptor, "rb", buffering=0) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)

NOTES = ".masrel_cache"
"""The folder of notes in a study."""

_PACKAGE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
_SOURCES = (".py", ".html", ".css", ".md", ".toml", ".bib")
_DEPTH = 3  # of the folders in a study whose files are read
# Nobody wants it in a repository, or in a backup (https://bford.info/cachedir/)
_MARKS = {
    ".gitignore": "*\n",
    "CACHEDIR.TAG": "Signature: 8a477f597d28d172789f06886806bc55\n",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """A call of ``masrel report``."""

    study: Path
    folder: Path  # of the report
    notes: Path  # the folder that has what builds were made from
    options: Mapping[str, str]  # all of the call that changes what is made or said
    ratings_file: Path | None  # a table of ratings that the study may not have

    def made_from(self) -> str:
        """Return a hash of the call, of every file that it may read, and the code."""
        call = [os.path.abspath(self.study), os.environ.get("MASREL_FONT")]
        digest = hashlib.sha256(json.dumps([call, self.options, sys.version]).encode())
        outputs = tuple(map(os.path.abspath, (self.folder, self.notes)))
        files = [*_files_below(self.study, outputs), *_sources(_PACKAGE)]
        for path in (*files, *filter(None, [self.ratings_file])):
            digest.update(f"{path}\0{file_hash(str(path))}\n".encode())
        digest.update(json.dumps(_libraries()).encode())
        return digest.hexdigest()

    def last(self, made_from: str) -> dict[str, Any] | None:
        """Return what the last build has shown if a new one would change nothing."""
        with contextlib.suppress(OSError, ValueError):
            seal, _, text = read_regular(self._note(), most=MAX_TABLE).partition(b"\n")
            if seal == self._seal(made_from, text):
                shown: dict[str, Any] = json.loads(text)
                return shown if _is_whole(self.folder, shown["manifest"]) else None
        return None

    def keep(self, made_from: str, shown: Mapping[str, Any]) -> None:
        """Note what this build has shown, or do without."""
        # shown: the hash of its manifest, too
        if made_from != self.made_from():
            return  # somebody wrote in the study meanwhile
        text = json.dumps(shown).encode()
        # full, read-only, no folder, a link
        with contextlib.suppress(OSError, ParameterError):
            if not self.notes.exists():
                for name, mark in _MARKS.items():
                    write_file(self.notes / name, mark)
            write_file(self._note(), self._seal(made_from, text) + b"\n" + text)

    def _note(self) -> Path:
        return self.notes / f"{_hash(os.path.abspath(self.folder).encode())}.json"

    def _seal(self, made_from: str, text: bytes) -> bytes:
        # of both: a note under another's name is of no use
        return _hash(made_from.encode() + text).encode()


def _files_below(folder: Path, but: Collection[str], depth: int = _DEPTH) -> list[str]:
    # hidden ones are none of a study's, but for its key
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return []
    paths = []
    for entry in entries:
        is_hidden = entry.name.startswith(".") and entry.name != ".key"
        if is_hidden or os.path.abspath(entry.path) in but:
            continue
        if not entry.is_dir():
            paths.append(entry.path)
        elif depth:
            paths += [entry.path, *_files_below(Path(entry.path), but, depth - 1)]
    return paths


def _sources(folder: str) -> Iterator[str]:
    # every file of masrel: who edits its code has no other version
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.name.endswith(_SOURCES):
            yield entry.path
        elif entry.name != "__pycache__" and entry.is_dir():
            yield from _sources(entry.path)


def _libraries() -> list[str]:
    # names and versions of all that Python finds, by the names of folders:
    # importlib.metadata takes longer than all else here
    names: list[str] = []
    for folder in sys.path:
        with contextlib.suppress(OSError):  # such as a zip
            every = os.listdir(folder or ".")
            names += (n for n in every if n.endswith((".dist-info", ".egg-info")))
    return sorted(names)


def _is_whole(folder: Path, manifest: str) -> bool:
    # Whether a report is there as it was written, and nothing that a build would remove
    if file_hash(str(folder / MANIFEST)) != manifest:
        return False
    hashes = _hashes_in(folder)
    return not any(
        os.path.islink(folder / name) or file_hash(str(folder / name)) != digest
        for name, digest in hashes.items()
    ) and not any(stale_assets(folder, hashes))
