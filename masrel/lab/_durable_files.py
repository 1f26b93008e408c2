"""Files of a study that are written bit by bit, added to, or stand in a new folder."""

import errno
import io
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

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
    sync_folder,
)
from masrel.errors import ParameterError
from masrel.lab._bounded_files import regular

_NO_WAIT = getattr(os, "O_NONBLOCK", 0)


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
