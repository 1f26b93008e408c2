"""The folder of a report: at any moment, every page is whole and its links hold.

Tables and figures have the start of their hash in their names, so that those of a new
report never take the place of those that a page still shows. They are on disk before
the first page is replaced; the manifest names them all; then those go that it does not
name, also of a report that was never finished. What else is in the folder stays.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from masrel._files import refuse_record, sync_folder, write_files
from masrel._input import MAX_RECORDING, read_regular
from masrel.verification._outputs import REPORT_FORMAT

MANIFEST = "manifest.json"

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


def replace_report(
    folder: Path,
    assets: Assets,
    pages: Mapping[str, bytes],
    inputs: Mapping[str, str],
) -> None:
    """Put a report into a folder, in the place of the one that is there."""
    for name in (*pages, MANIFEST):
        refuse_record(folder / name)
    new = {
        folder / place: data
        for place, data in assets.contents.items()
        if not _is_there(folder / place, data)
    }
    write_files(new, within=folder)
    for page, data in pages.items():
        write_files({folder / page: data}, within=folder)
    written = {**assets.contents, **pages}
    document = {
        "format": REPORT_FORMAT,
        "inputs": dict(inputs),
        "files": {place: _hash(data) for place, data in written.items()},
    }
    manifest = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write_files({folder / MANIFEST: manifest}, within=folder)
    for name in _ASSET_FOLDERS:
        _remove_others(folder, name, assets.contents)


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _is_there(path: Path, data: bytes) -> bool:
    if path.is_symlink():
        return False
    try:
        return read_regular(path, most=len(data)) == data
    except OSError:
        return False


def _remove_others(folder: Path, name: str, named: Mapping[str, bytes]) -> None:
    # A file goes only if it is what a report wrote: its name holds its hash.
    inside = folder / name
    if inside.is_symlink() or not inside.is_dir():
        return
    for path in sorted(inside.iterdir()):
        place = f"{name}/{path.name}"
        asset = _ASSET.fullmatch(place)
        if asset is None or place in named or path.is_symlink():
            continue
        try:
            data = read_regular(path, most=MAX_RECORDING)
        except OSError:  # gone, or no file
            continue
        if _hash(data).startswith(asset[1]):
            path.unlink()
    sync_folder(inside)
