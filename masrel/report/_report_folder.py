"""The folder of a report: at any moment, every page is whole and its links hold.

Tables and figures have the start of their hash in their names, so that those of a new
report never take the place of those that a page still shows. They are on disk before
the first page is replaced; the manifest names them all; then those go that only the
manifest before names. What else is in the folder stays.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from masrel._files import refuse_record, sync_folder, write_files
from masrel._input import MAX_RECORDING, MAX_SMALL, parse_json, read_regular

MANIFEST = "manifest.json"
_FORMAT = "masrel report 1"

_N_HEX = 16  # of a hash in a name
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
    pages: Mapping[str, str],
    inputs: Mapping[str, str],
) -> None:
    """Put a report into a folder, in the place of the one that is there."""
    for name in (*pages, MANIFEST):
        refuse_record(folder / name)
    before = _named_before(folder)
    new = {
        folder / place: data
        for place, data in assets.contents.items()
        if not _is_there(folder / place, data)
    }
    write_files(new, within=folder)
    for page, text in pages.items():
        write_files({folder / page: text}, within=folder)
    written = assets.contents | {page: text.encode() for page, text in pages.items()}
    document = {
        "format": _FORMAT,
        "inputs": dict(inputs),
        "files": {place: _hash(data) for place, data in written.items()},
    }
    manifest = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write_files({folder / MANIFEST: manifest}, within=folder)
    _remove(folder, [place for place in before if place not in assets.contents])


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _is_there(path: Path, data: bytes) -> bool:
    if path.is_symlink():
        return False
    try:
        return read_regular(path, most=len(data)) == data
    except OSError:
        return False


def _named_before(folder: Path) -> list[str]:
    # The assets that the manifest in the folder names, if there is a good one
    try:
        document = parse_json(read_regular(folder / MANIFEST, most=MAX_SMALL))
    except (OSError, ValueError):
        return []
    files = document.get("files") if isinstance(document, dict) else None
    if not isinstance(files, dict):
        return []
    return [place for place in files if _ASSET.fullmatch(place)]


def _remove(folder: Path, places: list[str]) -> None:
    # A file goes only if it is what was written: its name holds its hash.
    for place in places:
        path, asset = folder / place, _ASSET.fullmatch(place)
        if asset is None or path.is_symlink() or path.parent.is_symlink():
            continue
        try:
            data = read_regular(path, most=MAX_RECORDING)
        except OSError:  # gone, or no such file any more
            continue
        if _hash(data).startswith(asset[1]):
            path.unlink()
    for name in {Path(place).parent for place in places}:
        if (folder / name).is_dir():
            sync_folder(folder / name)
