"""Hashes of a protocol's content, whatever its comments and layout."""

import hashlib

import msgspec

from masrel.protocol.definition import Protocol

__all__ = ["presented_hash", "protocol_hash"]

PRESENTED = ("scale", "elbow", "models", "schedule", "stretch", "device")
"""The tables that decide what a rater meets, besides the study's id."""


def protocol_hash(protocol: Protocol) -> str:
    """Hash the whole content of a protocol.

    Parameters
    ----------
    protocol : Protocol
        A protocol; keys left out of the file count with their defaults.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits. Comments, order of keys and layout of the
        file do not enter.
    """
    return _digest(msgspec.to_builtins(protocol))


def presented_hash(protocol: Protocol) -> str:
    """Hash the part of a protocol that decides what a rater meets.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the study's id and the tables
        ``scale``, ``elbow``, ``models``, ``schedule``, ``stretch`` and ``device``.

    Notes
    -----
    Raters, sessions, texts, the analysis plan and the report do not enter: adding
    a rater or wording a title better makes nobody's drawn schedule stale.
    """
    tables = {name: getattr(protocol, name) for name in PRESENTED}
    return _digest(msgspec.to_builtins({"study": protocol.study.id, **tables}))


def _digest(content: object) -> str:
    canonical = msgspec.json.encode(content, order="sorted")
    return hashlib.sha256(canonical).hexdigest()
