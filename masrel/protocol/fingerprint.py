"""Hashes of a protocol's content, whatever its comments and layout."""

import hashlib
from typing import Any

import msgspec

from masrel.protocol.definition import Protocol

__all__ = ["presented_hash", "protocol_hash"]

PRESENTED = ("scale", "elbow", "models", "schedule", "stretch", "device")
"""The tables that decide what a rater meets, besides the study's id."""

LATER: dict[str, object] = {
    "catch_rise_s": 0.0,
    "residual_reading": "residual",
    "rest_angle_deg": None,
}
"""Constants that protocols had no key for, with the defaults they then had: these do
not enter, so that no schedule drawn before turns stale."""


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
        file do not enter. Of a model file its numbers enter, its name, and whether
        it comes from simulated recordings.
    """
    return _digest(_plain(protocol))


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
    content = _plain({"study": protocol.study.id, **tables})
    for model in content["models"]:
        for key in ("file", "simulated"):  # the numbers are what is felt
            model.pop(key, None)
    return _digest(content)


def _plain(content: object) -> dict[str, Any]:
    plain: dict[str, Any] = msgspec.to_builtins(content)
    elbow = plain["elbow"]
    for model in plain["models"]:
        own = {k: v for k, v in model.pop("constants").items() if v is not None}
        # What a model shares with the others is not its own, and does not enter twice.
        for key in ("post_catch", *LATER):
            if key in own and own[key] == elbow[key]:
                del own[key]
        if own:
            model["constants"] = own
        for key, absent in (("file", None), ("simulated", False)):
            if model[key] is absent:
                del model[key]
    for key, default in LATER.items():
        if elbow[key] == default:
            del elbow[key]
    return plain


def _digest(content: object) -> str:
    canonical = msgspec.json.encode(content, order="sorted")
    return hashlib.sha256(canonical).hexdigest()
