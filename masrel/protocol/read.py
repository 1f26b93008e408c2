"""Read a protocol file and say everything that is wrong with it at once."""

import tomllib
from pathlib import Path

import msgspec

from masrel.errors import ProtocolError
from masrel.protocol.decode import decode_table
from masrel.protocol.definition import Protocol
from masrel.protocol.model_files import Resolved, resolve_model_files
from masrel.protocol.rules import broken_rules

__all__ = ["read_protocol"]


def read_protocol(path: Path) -> Protocol:
    """Read a protocol file.

    Parameters
    ----------
    path : Path
        A TOML file; ``docs/protocol.md`` has its keys.

    Returns
    -------
    Protocol
        The protocol, every key checked alone and against the others.

    Raises
    ------
    ProtocolError
        If there is no such file, it is not TOML, or any key is wrong. Its
        `problems` are all there are, each ``FILE: key[index].key: needed ..., got
        ...``, entries counted from 0.

    Notes
    -----
    A model that names a model file gets its numbers from there, and the protocol has
    them as if they stood in it: hashes follow the numbers, not the file.

    Rules across keys are applied to what could be decoded, so that one wrong key
    hides no other problem.
    """
    resolved = resolve_model_files(_read_toml(path), path.parent)
    raw = resolved.raw
    decoded = decode_table(raw, Protocol)
    problems = [*resolved.problems, *_told(decoded.problems, resolved)]
    problems += broken_rules(decoded.values)
    if problems:
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return msgspec.convert(raw, Protocol)


def _told(problems: list[str], resolved: Resolved) -> list[str]:
    # A model whose file could not be used lacks its keys for that reason alone.
    unread = tuple(f"models[{index}]." for index in resolved.unread)
    return [
        problem
        for problem in problems
        if not (problem.startswith(unread) and ", got none" in problem)
    ]


def _read_toml(path: Path) -> dict[str, object]:
    try:
        # utf-8-sig: some editors put a byte order mark first.
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise ProtocolError(f"{path}: needed a protocol file, got: {reason}") from error
    except UnicodeDecodeError as error:
        raise ProtocolError(
            f"{path}: needed UTF-8 text, got byte {error.object[error.start]:#04x} "
            f"at offset {error.start}"
        ) from error
    except ValueError as error:  # TOMLDecodeError says line and column
        raise ProtocolError(f"{path}: needed valid TOML, got: {error}") from error
