"""The folder of a report, whose pages are whole at any moment, and when it is current.

Tables and figures have the start of their hash in their names, so that those of a new
report never take the place of those that a page still shows. They are on disk before
the first page is replaced; the manifest names them all; then those go that it does not
name, also of a report that was never finished. What else is in the folder stays.

A report is current if it was made by the same call, of the same files, by the same
code: a note in a folder of the study has their hash. Nothing heavy is loaded for it.
"""

import contextlib
import glob
import hashlib
import json
import os
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from masrel._files import (
    make_folder,
    refuse_record,
    sync_folder,
    usual_mode,
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
_PAGES = ("report.html", "report.md", "report.tex", "report.docx")
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
    is_private: bool = False,
) -> dict[str, bytes]:
    """Return every file of a report in the order in which they are written."""
    # pandoc: its version, where it made a page; is_private: of a study that goes on
    # Imported here: whether a report is current is known without it.
    from masrel.lab.verification.record import _REPORT_FORMAT

    written = {**assets, **pages}
    document = {
        "format": _REPORT_FORMAT,
        "inputs": dict(inputs),
        "files": {place: _hash(data) for place, data in written.items()},
        **({} if pandoc is None else {"pandoc": pandoc}),
        **({"private": True} if is_private else {}),
    }
    manifest = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    return {**written, MANIFEST: manifest.encode()}


def replace_report(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put the files of a report into a folder, in the place of the one there is."""
    for name in files:
        if "/" not in name:
            refuse_record(folder / name)
    is_private = "private" in json.loads(files[MANIFEST])
    with _alone(folder, 0o700 if is_private else None):
        was_private = "private" in _manifest(folder)
        changed, stale = report_changes(folder, files)
        new = {folder / place: files[place] for place in changed}
        assets = {path: data for path, data in new.items() if path.parent != folder}
        mode = 0o600 if is_private else None
        write_files(assets, within=folder, mode=mode)
        for path, data in new.items():  # the pages, and the manifest last
            if path not in assets:
                write_files({path: data}, within=folder, mode=mode)
        if is_private or was_private:
            _set_modes(folder, files, is_private=is_private)
        for path in stale:
            path.unlink()
        for parent in dict.fromkeys(path.parent for path in stale):
            sync_folder(parent)


def _set_modes(folder: Path, files: Iterable[str], *, is_private: bool) -> None:
    # also of what has not changed
    modes = {folder / place: 0o666 for place in files}
    modes |= {path.parent: 0o777 for path in modes}
    if not (folder.parent / "protocol.toml").is_file():  # it may be somebody's
        del modes[folder]
    for path, mode in modes.items():
        path.chmod(mode & 0o700 if is_private else usual_mode(mode))


@contextmanager
def _alone(folder: Path, mode: int | None) -> Iterator[None]:
    # Of two builds at once one waits: else it would remove what the other links to.
    make_folder(folder, mode=mode)
    if sys.platform == "win32":
        yield
        return
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # a file system without locks
            descriptor = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, descriptor)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield


def report_changes(
    folder: Path, files: Mapping[str, bytes]
) -> tuple[list[str], list[Path]]:
    """Return files that a folder lacks, and those in it of a report before."""
    hashes = ((place, _hash(data)) for place, data in files.items())
    changed = [place for place, digest in hashes if _differs(folder / place, digest)]
    return changed, [*_stale_files(folder, files)]


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _differs(path: Path, digest: str) -> bool:
    return path.is_symlink() or file_hash(str(path)) != digest


def _manifest(folder: Path) -> dict[str, Any]:
    # that of the report in a folder; empty if there is none
    try:
        document = json.loads(read_regular(folder / MANIFEST, most=MAX_TABLE))
    except (OSError, ValueError):
        return {}
    return document if isinstance(document, dict) else {}


def _hashes_in(folder: Path) -> dict[str, str]:
    # what its manifest says of the files of a report
    files = _manifest(folder).get("files")
    pairs = files.items() if isinstance(files, dict) else ()
    return {name: digest for name, digest in pairs if isinstance(digest, str)}


def _stale_files(folder: Path, named: Collection[str]) -> Iterator[Path]:
    # tables, figures and pages of a report before, which this one does not name; only
    # if nobody has written in them since: a name, or the manifest, has their hash
    for name in _ASSET_FOLDERS:
        inside = () if (folder / name).is_symlink() else (folder / name).glob("*")
        for path in sorted(inside):
            place = f"{name}/{path.name}"
            asset = _ASSET.fullmatch(place)
            if asset is None or place in named or path.is_symlink():
                continue
            if (file_hash(str(path)) or "").startswith(asset[1]):
                yield path
    for name, digest in _hashes_in(folder).items():
        if name in _PAGES and name not in named and not _differs(folder / name, digest):
            yield folder / name


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


def made_from(
    study: Path,
    options: Mapping[str, str],
    ratings_file: Path | None,
    outputs: Iterable[Path],
) -> str:
    """Return a hash of a call, of every file that it may read, and of the code."""
    # options: all that change what is made or said; ratings_file: a table that the
    # study may not have; outputs: the folders of the report and of notes
    call = [os.path.abspath(study), os.environ.get("MASREL_FONT")]
    digest = hashlib.sha256(json.dumps([call, options, sys.version]).encode())
    files = [*_files_below(study, [*map(os.path.abspath, outputs)]), *_sources()]
    for path in (*files, *filter(None, [ratings_file])):
        digest.update(f"{path}\0{file_hash(str(path))}\n".encode())
    digest.update(json.dumps(_libraries()).encode())
    return digest.hexdigest()


def note_of(folder: Path, notes: Path) -> Path:
    """Return the note, in a folder of notes, of the report in a folder."""
    return notes / f"{_hash(os.path.abspath(folder).encode())}.json"


def last_shown(note: Path, made: str, folder: Path) -> dict[str, Any] | None:
    """Return what the last build has shown if a new one would change nothing."""
    with contextlib.suppress(OSError, ValueError):
        seal, _, text = read_regular(note, most=MAX_TABLE).partition(b"\n")
        if seal == _seal(made, text):
            shown: dict[str, Any] = json.loads(text)
            return shown if _is_whole(folder, shown["manifest"]) else None
    return None


def keep_shown(
    note: Path, shown: Mapping[str, Any], *, before: str, after: str
) -> None:
    """Note what a build has shown, the hash of its manifest too, or do without."""
    if before != after:
        return  # somebody wrote in the study meanwhile
    text = json.dumps(shown).encode()
    # full, read-only, no folder, a link
    with contextlib.suppress(OSError, ParameterError):
        if not note.parent.exists():
            for name, mark in _MARKS.items():
                write_file(note.with_name(name), mark)
        write_file(note, _seal(after, text) + b"\n" + text)


def _seal(made: str, text: bytes) -> bytes:
    # of both: a note under another's name is of no use
    return _hash(made.encode() + text).encode()


def _files_below(folder: Path, but: Collection[str]) -> Iterator[str]:
    # hidden ones are none of a study's, but for its key
    patterns = [".key", ".key/*", *("*/" * depth + "*" for depth in range(_DEPTH + 1))]
    names = (name for of in patterns for name in glob.iglob(of, root_dir=folder))
    for path in (os.path.join(folder, name) for name in sorted(names)):
        within = f"{os.path.abspath(path)}{os.sep}"
        if not any(within.startswith(f"{output}{os.sep}") for output in but):
            yield path


def _sources() -> Iterator[str]:
    # every file of masrel: who edits its code has no other version
    for name in sorted(glob.iglob("**", root_dir=_PACKAGE, recursive=True)):
        if name.endswith(_SOURCES):
            yield os.path.join(_PACKAGE, name)


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
    differ = (_differs(folder / name, digest) for name, digest in hashes.items())
    return not any(differ) and not any(_stale_files(folder, hashes))
