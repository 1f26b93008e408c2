"""The figure of docs/howto/diagnosis.md, of eight simulated raters.

``python -m docs.make.diagnosis`` draws it.
"""

import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from docs.make.evidence import FIGURES

CATEGORIES = ("mild", "some", "much")
N_ITEMS = 200
SEES = (0.65, 0.7, 0.6, 0.7, 0.3, 0.85, 0.85, 0.9)  # how often each sees what is there


def draw(path: Path) -> None:
    """Draw what ``masrel diagnose`` shows of ratings with such raters."""
    rng = np.random.default_rng(1)
    true = rng.integers(0, len(CATEGORIES), N_ITEMS)
    guesses = rng.integers(0, len(CATEGORIES), (N_ITEMS, len(SEES)))
    sees = rng.random((N_ITEMS, len(SEES))) < SEES
    codes = np.where(sees, true[:, None], guesses)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder, "ratings.csv")
        with table.open("w", encoding="utf-8", newline="") as file:
            lines = csv.writer(file)
            lines.writerow(["item", "rater", "rating", "source"])
            for (item, rater), code in np.ndenumerate(codes):
                name = f"R{rater + 1}"
                lines.writerow([item + 1, name, CATEGORIES[code], "simulated"])
        call = ["diagnose", table, "--categories", ",".join(CATEGORIES)]
        options = ["--target", "items", "--figure", path]
        subprocess.run([sys.executable, "-m", "masrel", *call, *options], check=True)


if __name__ == "__main__":
    draw(FIGURES / "diagnosis.png")
