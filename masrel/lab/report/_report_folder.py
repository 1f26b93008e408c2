"""The folder of a report: whole while it has a manifest, and made when not current.

The manifest names every file with its hash. It is removed before the first file is
replaced and written after the last: a report without it is incomplete. Meanwhile a list
of all files that the earlier reports and the new one name replaces it, so that the next
build knows what to remove. What else is in the folder stays.

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
    usual_mode,
    write_file,
    write_files,
)
from masrel.errors import ParameterError
from masrel.lab._study_files import (
    MANIFEST,
    MAX_TABLE,
    UNFINISHED,
    read_object,
    read_regular,
    regular,
    sha256_of,
)

if sys.platform != "win32":
    import fcntl

NUMBERS = "analysis.json"
REFERENCES = "references.bib"

# What a build writes and may remove: pages and what stands beside them
_OWN = re.compile(
    r"report\.(?:html|md|tex|docx)|references\.bib"
    r"|(tables|figures)/[\w.-]+\.(?:csv|png|svg)"
)


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
        "files": {place: sha256_of(data) for place, data in written.items()},
        **({} if pandoc is None else {"pandoc": pandoc}),
        **({"private": True} if is_private else {}),
    }
    manifest = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    return {**written, MANIFEST: manifest.encode()}


def replace_report(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put the files of a report into a folder, replacing the report there."""
    for name in files:
        if "/" not in name:
            refuse_record(folder / name)
    is_private = "private" in json.loads(files[MANIFEST])
    with _alone(folder, 0o700 if is_private else None):
        is_cut_off = (folder / UNFINISHED).exists()
        was_private = is_cut_off or any("private" in d for d in _documents(folder))
        changed, stale = report_changes(folder, files)
        if changed or stale or is_cut_off:
            known = _known_files(folder)
            for place, data in files.items():
                known.setdefault(place, []).append(sha256_of(data))
            contents: dict[Path, bytes | str | None] = {
                folder / UNFINISHED: json.dumps({"format": 1, "files": known}),
                folder / MANIFEST: None,
                **{folder / name: files[name] for name in changed if name != MANIFEST},
                **dict.fromkeys(stale),
            }
            mode = 0o600 if is_private else None
            write_files(contents, within=folder, mode=mode)
            manifest = {folder / MANIFEST: files[MANIFEST], folder / UNFINISHED: None}
            write_files(manifest, within=folder, mode=mode)
        if is_private or was_private:
            _set_modes(folder, files, is_private=is_private)


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
    changed = [
        n for n, data in files.items() if _differs(folder / n, {sha256_of(data)})
    ]
    return changed, [*_stale_files(folder, files)]


def _differs(path: Path, hashes: Collection[str]) -> bool:
    return path.is_symlink() or file_hash(str(path)) not in hashes


def _documents(folder: Path) -> Iterator[dict[str, Any]]:
    # its manifest, and the list of a report that was cut off, where there are any
    for name in (MANIFEST, UNFINISHED):
        with contextlib.suppress(OSError):
            if (document := read_object(folder / name)) is not None:
                yield document


def _known_files(folder: Path) -> dict[str, list[str]]:
    # hashes that the files of a report have, or had when one was cut off
    known: dict[str, list[str]] = {}
    for document in _documents(folder):
        with contextlib.suppress(LookupError, TypeError, AttributeError):
            for place, hashes in document["files"].items():
                known.setdefault(place, []).extend(
                    [hashes] if isinstance(hashes, str) else map(str, hashes)
                )
    return known


def _stale_files(folder: Path, named: Collection[str]) -> Iterator[Path]:
    # files of a report before, which this one does not name; only if nobody has written
    # in them since
    for place, hashes in _known_files(folder).items():
        match = _OWN.fullmatch(place)
        if match is None or place in named or _differs(folder / place, hashes):
            continue
        if match[1] is None or not (folder / match[1]).is_symlink():
            yield folder / place


def file_hash(path: str) -> str | None:
    """Return the SHA-256 of a file; None if it cannot be read."""
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
    return notes / f"{sha256_of(os.path.abspath(folder).encode())}.json"


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
    return sha256_of(made.encode() + text).encode()


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
    known = _known_files(folder)
    differ = (_differs(folder / name, hashes) for name, hashes in known.items())
    return not any(differ) and not (folder / UNFINISHED).exists()
