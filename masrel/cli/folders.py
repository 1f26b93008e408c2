"""Whether files to be written have a folder, asked before anything is computed."""

from pathlib import Path

from masrel.errors import ParameterError

__all__ = ["check_folders"]


def check_folders(**files: Path | str | None) -> None:
    """Check that the folders of files to be written exist."""
    for option, name in files.items():
        if name is None or str(name) == "-":
            continue
        folder = Path(name).parent
        if not folder.is_dir():
            raise ParameterError(
                f"--{option}: needs a folder that exists, got {name}, where {folder} "
                "is none"
            )
