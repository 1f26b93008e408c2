"""Output: files written whole or not at all, and cells that are not formulas.

A file is made under another name beside the one that it replaces, synced, and gets its
name in one step, which is synced too: a kill or a full disk leaves the old bytes or the
new ones. No link is followed, and no output takes the place of a primary record.
"""

import contextlib
import errno
import os
import re
import shutil
import stat
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from masrel._input import refuse

# What Windows alone has, and what it lacks
NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)
BINARY = getattr(os, "O_BINARY", 0)

# Names of files that are not whole yet, and seconds that no file takes to write
PART_BEGINS, PART_ENDS = ".masrel-", ".part"
_LONGEST_S = 86_400.0

# A cell that begins a formula, and a number that merely begins like one
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")

# Where a study's primary records are, which no output replaces
_PROTOCOL = "protocol.toml"
_KEY = ".key"  # also of a study that has no protocol yet
_RECORD_FOLDERS = ("schedules", "sessions", "conduct", _KEY)
# What in a study says who is who, who rated what, or what was presented
_PRIVATE = (
    *_RECORD_FOLDERS,
    *("conduct.jsonl", "sheets", "training", "rehearsals", "ratings", ".masrel_cache"),
)
_SOURCES = (
    ("ratings", "published.csv"),
    ("ratings", "in_person.csv"),
    ("conduct.jsonl",),
)


def write_file(
    path: Path,
    data: bytes | str,
    *,
    within: Path | None = None,
    mode: int | None = None,
) -> None:
    """Write an output: whole, on disk and under its name, or not at all."""
    # within: a folder that it may not leave by a link; mode: as `write_files` has it
    refuse_record(path)
    write_files({path: data}, within=within, mode=mode)


def write_files(
    contents: Mapping[Path, bytes | str | None],
    *,
    within: Path | None = None,
    mode: int | None = None,
) -> None:
    """Write files that belong together: all on disk before the first has its name."""
    # They get their names, or go where there is None, in this order. Text is UTF-8 with
    # lines as they are. mode: permissions; unless given its owner's alone where a study
    # has what is private, or those of what is replaced, or the usual ones
    parts: dict[Path, Path] = {}
    try:
        for path, data in contents.items():
            if data is not None:
                parts[path], descriptor = new_part(path, within, mode)
                with on_disk(path, descriptor) as out:
                    out.write(data.encode() if isinstance(data, str) else data)
        for path in contents:
            with naming(path):
                if path in parts:
                    os.replace(parts[path], path)
                    del parts[path]
                else:
                    path.unlink(missing_ok=True)
                    sync_folder(path.parent)  # it is gone before what follows is there
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)
    for folder in dict.fromkeys(path.parent for path in contents):
        remove_left_over(folder)
        sync_folder(folder)


@contextmanager
def on_disk(path: Path, descriptor: int) -> Iterator[BinaryIO]:
    """Give an open part to write into, which is on disk at the end, and then closed."""
    with naming(path), os.fdopen(descriptor, "wb") as out:
        yield out
        out.flush()
        os.fsync(descriptor)


def new_part(
    path: Path, within: Path | None = None, mode: int | None = None
) -> tuple[Path, int]:
    """Make a new file of a name that nobody knows beside a target."""
    if within is not None:
        check_inside(path.parent, within)
    replaced = _mode(path)
    if mode is None:
        mode = 0o600 if _is_private(path) else replaced
    make_folder(path.parent)
    part = path.with_name(f"{PART_BEGINS}{os.urandom(8).hex()}{PART_ENDS}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | NO_FOLLOW | BINARY
    with naming(path):
        descriptor = os.open(part, flags, 0o666 if mode is None else mode)
    if mode is not None:
        part.chmod(mode)  # as it was, whatever the umask is now
    return part, descriptor


def is_part(path: Path) -> bool:
    """Return whether a file is one that is not whole yet, by its name."""
    return path.name.startswith(PART_BEGINS) and path.name.endswith(PART_ENDS)


def remove_left_over(folder: Path) -> None:
    """Take away parts of processes that died: no file takes a day to write."""
    with contextlib.suppress(OSError):  # of what another process took away
        for path in folder.iterdir():
            if is_part(path) and path.lstat().st_mtime < time.time() - _LONGEST_S:
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path)
                else:
                    path.unlink()


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Within it, an error of the system that names no file names this one."""
    try:
        yield
    except OSError as error:
        # a full disk does not say which file it was, and nobody knows the part
        if str(error.filename or PART_ENDS).endswith(PART_ENDS):
            error.filename, error.filename2 = str(path), None
        raise


def _mode(path: Path) -> int | None:
    """Return the permissions of the file replaced; refuse what is not a file."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:  # nothing, or a link to nothing, which is replaced
        return None
    if not stat.S_ISREG(mode):  # such as /dev/stdout, which "-" stands for
        raise OSError(errno.EINVAL, "needed a file or a new name", str(path))
    if path.is_symlink():
        return None  # the permissions of another file
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    return stat.S_IMODE(mode)


def usual_mode(mode: int) -> int:
    """Return what the umask leaves of permissions."""
    umask = os.umask(0o077)  # it cannot be looked at alone
    os.umask(umask)
    return mode & ~umask


def _is_private(path: Path) -> bool:
    path = path.absolute()
    return _KEY in path.parts or any(
        (root / _PROTOCOL).is_file() and path.relative_to(root).parts[0] in _PRIVATE
        for root in path.parents
    )


def make_folder(folder: Path, *, mode: int | None = None) -> None:
    """Make a folder, with this mode, and those above it that are missing, on disk.

    Unless the mode is given, a folder for what is private is its owner's alone.
    """
    new: list[Path] = []
    while not folder.is_dir() and folder != folder.parent:
        new.append(folder)
        folder = folder.parent
    for path in reversed(new):
        # Another process may be as fast.
        its = mode if path is new[0] else None
        path.mkdir(exist_ok=True, mode=its or (0o700 if _is_private(path) else 0o777))
        sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on disk."""
    # A new file's name is on disk only when its folder is.
    if sys.platform == "win32":
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except PermissionError:  # a folder that one may write into, but not list
        return
    try:
        os.fsync(descriptor)
    except OSError as error:
        error.filename = str(folder)
        if error.errno != errno.EINVAL:  # a file system that syncs no folders
            raise
    finally:
        os.close(descriptor)


def check_inside(folder: Path, root: Path) -> None:
    """Refuse a folder of a study that a link leads out of it."""
    refuse(
        (
            not folder.resolve().is_relative_to(root.resolve()),
            f"{folder}: needs to be in {root}, got a link to {folder.resolve()}",
        )
    )


def refuse_record(path: Path) -> None:
    """Refuse to write over a study's protocol, schedule, log and so on."""
    place = path.parent.resolve() / path.name
    for root in place.parents:
        parts = place.relative_to(root).parts
        is_record = parts[0] in _RECORD_FOLDERS or parts in (*_SOURCES, (_PROTOCOL,))
        refuse(
            (
                is_record and (root / _PROTOCOL).is_file(),
                f"{path}: needed another file, because this is a primary record of the "
                f"study {root}",
            )
        )


def safe_cell(text: str) -> str:
    """Return a text as a cell of CSV that no spreadsheet runs as a formula."""
    # after an apostrophe; a text that begins with apostrophes and then like a formula
    # gets one more, so that what is read is what was written
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def from_safe_cell(cell: str) -> str:
    """Return the text of a cell that `safe_cell` may have made."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
