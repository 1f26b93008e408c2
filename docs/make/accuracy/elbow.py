"""The joint model beside 50 digits: how far are its events and torques off?

``python -m docs.make.accuracy.elbow [--quiet]`` solves thousands of random scenes and
the built corner cases twice, which takes some minutes, and writes
``accuracy_joint.csv`` and a part of ``accuracy.md``, in ``docs/evidence``.
"""

import argparse
import math

import numpy as np
from tqdm import tqdm

from docs.make.evidence import EVIDENCE, write_part, write_rows
from tests.lab.elbow.exactness import Errors, errors
from tests.lab.elbow.scenes import KINDS, N_SEEDS, corner_cases, random_scene


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


def rows(solutions: dict[tuple[str, str], list[Errors]]) -> list[dict[str, object]]:
    """Return a row a group of scenes, each error the largest of the group."""
    return [
        {
            "motion or case": name,
            "scenes": group,
            "number": len(of),
            "with a catch": sum("catch" in one.phases for one in of),
            "time_s": max(one.time_s for one in of),
            "time_ulp": max(one.time_ulp for one in of),
            "torque": max(one.torque for one in of),
        }
        for (name, group), of in solutions.items()
    ]


def main() -> None:
    """Solve every scene and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    quiet = parser.parse_args().quiet
    scenes: dict[tuple[str, str], list[Errors]] = {}
    total = 2 * len(KINDS) * N_SEEDS
    with tqdm(total=total, desc="scenes", disable=quiet) as bar:
        for group in ("study", "wide"):
            for kind in KINDS:
                scenes[kind, group] = solved(
                    kind, wide=group == "wide", n_seeds=N_SEEDS, bar=bar
                )
    for name, scene in corner_cases().items():
        scenes[name, "built"] = [errors(*scene, np.random.default_rng(5))]
    every = [one for of in scenes.values() for one in of]
    if any(math.isnan(one.torque) for one in every):
        raise SystemExit("a torque is undefined")
    write_rows("accuracy_joint", rows(scenes))
    n_off = sum(not one.holds for one in every)
    text = (
        f"Of {len(every)} scenes {n_off or 'none'} is off by more than 10⁻¹¹ s and "
        "10⁻¹⁴ of the duration, or in torque by more than 10⁻¹² of the largest term."
    )
    write_part(EVIDENCE / "accuracy.md", "joint", text)


if __name__ == "__main__":
    main()
