"""The figures of docs/judges.md, of the files that the page makes.

``python -m docs.make.judges`` draws them.
"""

import contextlib
import subprocess
import sys
import tempfile

from docs.make.pages import ROOT, read

FIGURES = ROOT / "docs" / "figures"
CALLS = {
    "judges_humans.png": (
        *("answers.csv", "--judge", "large", "--judge", "small"),
        *("--annotators", "skilled", "--target", "items"),
    ),
    "judges_corrected.png": ("monitor.csv", "--judge", "large", "--rate", "pass"),
}


def draw() -> None:
    """Write the files of the first block of Python, and draw what is shown of them."""
    page = (ROOT / "docs" / "judges.md").read_text(encoding="utf-8")
    block = next(of for of in read(page) if of.language == "python")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec("\n".join(block.lines), {})
        for name, call in CALLS.items():
            command = [sys.executable, "-m", "masrel", "judge", *call]
            subprocess.run([*command, "--figure", FIGURES / name], check=True)


if __name__ == "__main__":
    draw()
