"""The folder of a report: at any moment, every page is whole and its links hold.

Tables and figures have the start of their hash in their names, so that those of a new
report never take the place of those that a page still shows. They are on disk before
the first page is replaced; the manifest names them all; then those go that it does not
name, also of a report that was never finished. What else is in the folder stays.
"""

import contextlib
import hashlib
import json
import os
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from masrel._files import make_folder, refuse_record, sync_folder, write_files
from masrel.lab._bounded_files import MAX_TABLE, read_regular
from masrel.lab._cache import file_hash

if sys.platform != "win32":
    import fcntl

MANIFEST = "manifest.json"
NUMBERS = "analysis.json"

_N_HEX = 16  # of a hash in a name
_ASSET_FOLDERS = ("tables", "figures")
_ASSET = re.compile(r"(?:tables|figures)/[\w.-]+-([0-9a-f]{16})\.(?:csv|png|svg)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Assets:
    """The tables and figures of a report, each under the name that a link has."""

    contents: dict[str, bytes] = field(default_factory=dict)

    def add(self, folder: str, name: str, form: str, data: bytes) -> str:
        """Take one in and return its name, from the report's folder."""
        place = f"{folder}/{name}-{_hash(data)[:_N_HEX]}.{form}"
        self.contents[place] = data
        return place


def report_files(
    assets: Assets,
    pages: Mapping[str, bytes],
    inputs: Mapping[str, str],
    *,
    pandoc: str | None = None,
) -> dict[str, bytes]:
    """Return every file of a report in the order in which they are written."""
    # pandoc: its version, where it made a page
    # Imported here: whether a report is current is known without it.
    from masrel.lab.verification._outputs import REPORT_FORMAT

    written = {**assets.contents, **pages}
    document = {
        "format": REPORT_FORMAT,
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
    if path.is_symlink():
        return False
    try:
        return read_regular(path, most=len(data)) == data
    except OSError:
        return False


def stale_pages(folder: Path, named: Collection[str]) -> Iterator[Path]:
    """Yield pages of the last report in a folder that this one does not have."""
    # Only if nobody has written in them since: the manifest has their hashes.
    path = folder / MANIFEST
    for name in ("report.html", "report.md", "report.tex", "report.docx"):
        page = folder / name
        if name in named or page.is_symlink() or not page.is_file():
            continue
        if _hash_in(path, name) == file_hash(str(page)):
            yield page


def _hash_in(manifest: Path, name: str) -> str | None:
    # what a manifest says of a file; None if it says nothing
    try:
        document = json.loads(read_regular(manifest, most=MAX_TABLE))
    except (OSError, ValueError):
        return None
    files = document.get("files") if isinstance(document, dict) else None
    digest = files.get(name) if isinstance(files, dict) else None
    return digest if isinstance(digest, str) else None


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
