"""What verification finds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Weight = Literal["broken", "doubt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that is not as it should be.

    Attributes
    ----------
    weight : {"broken", "doubt"}
        A doubt may have an innocent reason; a record with doubts alone is whole.
    path : Path
        The file or folder that it is about.
    message : str
        What was needed and what is there; it begins with the path.
    """

    weight: Weight
    path: Path
    message: str


def broken(path: Path, message: str) -> Finding:
    """Return a finding whose message does not begin with its path yet."""
    return Finding(weight="broken", path=path, message=f"{path}: {message}")


def doubt(path: Path, message: str) -> Finding:
    """Return a finding that may have an innocent reason."""
    return Finding(weight="doubt", path=path, message=f"{path}: {message}")
