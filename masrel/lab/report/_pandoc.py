"""LaTeX, and documents of a word processor, by pandoc from the Markdown of a page."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Literal

from masrel._files import write_file
from masrel.errors import ParameterError

_FIRST_DAY = "315532800"  # of 1980, the earliest that a zip can say
_SMALL = (  # letters of tables; figures stand where they are told of
    r"header-includes=\usepackage{float}\floatplacement{figure}{H}"
    r"\AtBeginEnvironment{longtable}{\footnotesize"
    r"\setlength{\tabcolsep}{3pt}}"
)
_OPTIONS = {
    "latex": (
        *("--from=markdown-smart-citations", "--toc"),
        *("-V", "papersize=a4", "-V", "geometry=margin=20mm", "-V", _SMALL),
    ),
    "docx": ("--from=markdown-smart-citations-tex_math_dollars",),
}


@cache
def _pandoc() -> str:
    """Return the path of pandoc, or refuse to go on without it."""
    try:
        import pypandoc

        return str(pypandoc.get_pandoc_path())
    except (ImportError, OSError):
        if path := shutil.which("pandoc"):
            return path
    raise ParameterError(
        "latex and docx: need pandoc; install it with: pip install 'masrel[docx]'"
    )


def pandoc_version() -> str:
    """Return the version of pandoc, or refuse to go on without it."""
    shown = subprocess.run([_pandoc(), "--version"], capture_output=True, check=True)
    return shown.stdout.decode().split()[1]


def converted(
    markdown: str,
    form: Literal["latex", "docx"],
    *,
    pictures: Mapping[str, bytes],
) -> bytes:
    """Return Markdown in another form; pictures by their paths from its folder."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out = folder / f"report.{form}"
        for path, data in pictures.items():
            (folder / path).parent.mkdir(exist_ok=True)
            write_file(folder / path, data)
        done = subprocess.run(
            [
                *(_pandoc(), "--to", form, "--standalone", "--output", str(out)),
                "--data-dir=.",  # templates of the user's change nothing
                *("--shift-heading-level-by=-1", *_OPTIONS[form]),
            ],
            input=markdown.encode(),
            cwd=folder,
            env={**os.environ, "SOURCE_DATE_EPOCH": _FIRST_DAY},
            check=False,
            capture_output=True,
        )
        if done.returncode:
            why = " ".join(done.stderr.decode(errors="replace").split())
            raise ParameterError(
                f"{form}: needs a pandoc that makes it, 3.0 or newer; {_pandoc()} "
                f"ended with: {why}"
            )
        return out.read_bytes()
