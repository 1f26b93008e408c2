"""The joint model beside 50 digits: how far are its events and torques off?

``python -m docs.make.accuracy.elbow [--quiet]`` solves thousands of random scenes and
the built corner cases twice, which takes some minutes, and writes the last section of
``docs/evidence/accuracy.md``; the rest of the page stays as it is.
"""

import argparse
import math
import string
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from docs.make.accuracy import cells
from tests.lab.elbow.exactness import Errors, errors
from tests.lab.elbow.scenes import KINDS, N_SEEDS, corner_cases, random_scene

PAGE = Path(__file__).parents[2] / "evidence" / "accuracy.md"
HEADING = "\n## The joint model\n"

_TEMPLATE = Path(__file__).with_name("elbow_template.md")


def solved(kind: str, *, wide: bool, n_seeds: int, bar: tqdm) -> list[Errors]:
    """Errors of random scenes; one that starts beyond its range is none."""
    solutions = []
    for seed in range(n_seeds):
        rng = np.random.default_rng([seed, KINDS.index(kind), wide])
        joint, motion = random_scene(rng, kind, wide=wide)
        if motion.start < joint.range_end:
            solutions.append(errors(joint, motion, rng))
        bar.update()
    return solutions


def section(
    random: dict[tuple[str, bool], list[Errors]], corners: dict[str, Errors]
) -> str:
    """Write the section in Markdown."""
    rows = [
        [kind, "wide" if wide else "study", *_counts(solutions), *_largest(solutions)]
        for (kind, wide), solutions in random.items()
    ]
    head = ["motion", "scenes", "number", "with a catch", "time, s", "ulp", "torque"]
    corner_rows = [
        [name, " → ".join(solution.phases), *_largest([solution])]
        for name, solution in corners.items()
    ]
    every = [one for solutions in random.values() for one in solutions]
    n_off = sum(not one.holds for one in [*every, *corners.values()])
    corner_head = ["case", "phases", "time, s", "ulp", "torque"]
    return string.Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        random=cells.table(head, rows, n_text=2),
        corners=cells.table(corner_head, corner_rows, n_text=2),
        n_random=len(every),
        n_corners=len(corners),
        but=f", but for {n_off}" if n_off else "",
    )


def _counts(solutions: Sequence[Errors]) -> list[str]:
    return [str(len(solutions)), str(sum("catch" in one.phases for one in solutions))]


def _largest(solutions: Sequence[Errors]) -> list[str]:
    return [
        cells.power(max(one.time_s for one in solutions)),
        f"{max(one.time_ulp for one in solutions):.2f}",
        cells.power(max(one.torque for one in solutions)),
    ]


def written_section(page: Path) -> str:
    """Return the section as it stands at the end of a page, or nothing."""
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    start = text.find(HEADING)
    return text[start:] if start >= 0 else ""


def main() -> None:
    """Solve every scene and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    quiet = parser.parse_args().quiet
    random = {}
    total = 2 * len(KINDS) * N_SEEDS
    with tqdm(total=total, desc="scenes", disable=quiet) as bar:
        for wide in (False, True):
            for kind in KINDS:
                random[kind, wide] = solved(kind, wide=wide, n_seeds=N_SEEDS, bar=bar)
    corners = {
        name: errors(*scene, np.random.default_rng(5))
        for name, scene in corner_cases().items()
    }
    if any(math.isnan(one.torque) for one in corners.values()):
        raise SystemExit("a torque is undefined")
    text = PAGE.read_text(encoding="utf-8")
    before = text.removesuffix(written_section(PAGE)).rstrip("\n") + "\n"
    PAGE.write_text(before + section(random, corners), encoding="utf-8")


if __name__ == "__main__":
    main()
