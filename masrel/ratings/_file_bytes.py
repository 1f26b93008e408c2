"""The bytes of a file or a pipe: unpacked, and decoded if they are text."""

import codecs
import gzip
import io
import lzma
import sys
import zipfile
import zlib
from pathlib import Path
from typing import IO

from masrel.errors import ParameterError, RatingsError

MAX_UNPACKED = 256_000_000
MAX_WORKBOOK = MAX_UNPACKED // 4
"""Bytes of XML: its cells take several times the room."""

_BLOCK = 1 << 20

_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)

_PACKED = {b"\x1f\x8b": ".gz", b"\xfd7zXZ\0": ".xz"}
"""How packed files begin."""

_MARKS = {
    b"PK\x03\x04": ".xlsx, .ods or .zip",
    b"\xd0\xcf\x11\xe0": ".xls",
    b"PAR1": ".parquet",
    b"ARROW1": ".feather",
    b"$FL": ".sav or .zsav",
    b"<stata_dta>": ".dta",
    b"BZh": ".bz2, which is not read",
    b"(\xb5/\xfd": ".zst, which is not read",
    b"%PDF": ".pdf, which is not read",
}
"""How files begin that are no text, and what their names end in."""


def bytes_of(path: Path | str) -> bytes:
    """Return the bytes of a file, or of standard input for "-"."""
    if str(path) == "-":
        return sys.stdin.buffer.read()
    path = Path(path)
    if path.is_dir():
        raise RatingsError(f"{path}: needed a file, got a folder")
    if not path.exists():
        raise RatingsError(f"{path}: no such file")
    if path.is_char_device() or path.is_block_device():
        raise RatingsError(f"{path}: needed a file or a pipe, got a device")
    return path.read_bytes()


def unpacked(name: str, data: bytes, *, is_export: bool) -> tuple[str, bytes]:
    """Return what is in a packed file, by its suffix: the name without it, and it."""
    stem, suffix = name.removesuffix(Path(name).suffix), Path(name).suffix.lower()
    packed = next((e for mark, e in _PACKED.items() if data.startswith(mark)), None)
    suffix = packed or suffix  # a pipe has no suffix
    stem = stem if name.lower().endswith(suffix) else name
    try:
        if suffix == ".gz":
            return stem, _within(name, gzip.GzipFile(fileobj=io.BytesIO(data)))
        if suffix == ".xz":
            return stem, _within(name, lzma.LZMAFile(io.BytesIO(data)))
        if suffix == ".zip":
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                members = [m for m in archive.namelist() if not m.endswith("/")]
                if len(members) > 1 and is_export:  # such as a file of each annotator
                    return f"{stem}.zip", data
                if len(members) != 1:
                    raise RatingsError(
                        f"{name}: needed one file in it, got {len(members)}: "
                        f"{', '.join(members[:5])}"
                    )
                with archive.open(members[0]) as member:
                    return members[0], _within(name, member)
    except (
        *(OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile),
        *(RuntimeError, NotImplementedError),  # encrypted, packed in another way
    ) as error:
        raise RatingsError(
            f"{name}: is damaged, or no {suffix} file ({error})"
        ) from error
    return name, data


def _within(name: str, packed: IO[bytes] | gzip.GzipFile) -> bytes:
    # What is in a packed file, if it is not so much that it fills the memory
    data = packed.read(MAX_UNPACKED + 1)
    if len(data) > MAX_UNPACKED:
        raise RatingsError(
            f"{name}: is more than {MAX_UNPACKED} bytes when it is unpacked: unpack "
            "it, since a large table is read piece by piece"
        )
    return data


def unpacked_size(data: bytes, most: int) -> int:
    """Count the bytes that an archive holds, until they are more than some."""
    size = 0
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for member in archive.infolist():
            # read to its end: where that is said to be may be a lie
            member.file_size = sys.maxsize
            with archive.open(member) as packed:
                while size <= most and (block := packed.read(_BLOCK)):
                    size += len(block)
    return size


def decoded(name: str, data: bytes, encoding: str | None, n_before: int = 0) -> str:
    """Return bytes as text, by the encoding, or by their mark, or as UTF-8."""
    # n_before: lines of the file before these
    marked = next((e for bom, e in _BOMS if data.startswith(bom)), None)
    encoding = encoding or marked or "utf-8"
    for mark, suffix in _MARKS.items():
        if data.startswith(mark):
            raise RatingsError(f"{name}: needed text, got a file of the kind {suffix}")
    try:
        text = data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        line = n_before + len((data[: error.start] + b"x").splitlines())
        likely = "utf-16" if 0 in data[:100] else "cp1252 or latin-1"
        raise RatingsError(
            f"{name}: line {line}: needed {encoding} text, got the byte "
            f"0x{data[error.start]:02x}; --encoding {likely} may be right"
        ) from error
    except (LookupError, ValueError) as error:
        raise ParameterError(
            f"--encoding: there is none called {encoding!r}"
        ) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        hint = "; --encoding utf-16 may be right" if 0 in data[:4] else ""
        raise RatingsError(f"{name}: line {line}: needed text, got a zero byte{hint}")
    text = text.removeprefix("\ufeff")
    return text if "\n" in text else text.replace("\r", "\n")  # of an old Mac
