"""The bundled studies, and copying one as the start of a new study."""

import shutil
from pathlib import Path

import masrel
from masrel.errors import ParameterError

__all__ = ["copy_template", "template_names"]

BUNDLED = (
    "protocol.toml",
    "README.md",
    "ratings/published.csv",
    "ratings/in_person.csv",
)
"""What a bundled study may hold; nothing drawn, run or computed in it is copied."""


def template_names() -> tuple[str, ...]:
    """Return the names of the bundled studies.

    Returns
    -------
    tuple of str
        In alphabetical order.

    Examples
    --------
    >>> template_names()
    ('hess2012', 'small')
    """
    return tuple(sorted(file.parent.name for file in _home().glob("*/protocol.toml")))


def copy_template(name: str, destination: Path) -> None:
    """Copy a bundled study into a new or empty folder.

    Parameters
    ----------
    name : str
        One of :func:`template_names`.
    destination : Path
        The new study's folder; made when it does not exist.

    Raises
    ------
    ParameterError
        If there is no such study, or `destination` is a file or holds anything.
    OSError
        If the system refuses a folder or file.
    """
    if name not in template_names():
        known = ", ".join(template_names())
        raise ParameterError(f"study: needed one of {known}, got {name!r}")
    if destination.exists() and not destination.is_dir():
        raise ParameterError(f"{destination}: needed a new or empty folder, got a file")
    if destination.is_dir() and (held := sorted(p.name for p in destination.iterdir())):
        raise ParameterError(
            f"{destination}: needed a new or empty folder, got one that holds {held[0]}"
            + (f" and {len(held) - 1} more" if len(held) > 1 else "")
        )
    destination.mkdir(parents=True, exist_ok=True)
    for part in BUNDLED:
        source, target = _home() / name / part, destination / part
        if source.is_file():
            target.parent.mkdir(exist_ok=True)
            # Contents only: an installed file may be read-only, a study is edited.
            shutil.copyfile(source, target)


def _home() -> Path:
    # A wheel carries the studies inside the package, the repository beside it.
    package = Path(masrel.__file__).parent
    inside = package / "studies"
    return inside if inside.is_dir() else package.parent / "studies"
