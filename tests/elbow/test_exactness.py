"""Events and torques against 50 digits, over random scenes and built corner cases."""

import numpy as np
import pytest

from masrel.elbow import ElbowParameters, Motion
from tests.elbow.exactness import Errors, errors
from tests.elbow.scenes import KINDS, corner_cases, random_scene

CORNERS = corner_cases()


def of_scenes(kind: str, *, wide: bool, seeds: range) -> list[Errors]:
    found = []
    for seed in seeds:
        rng = np.random.default_rng([seed, KINDS.index(kind), wide])
        joint, motion = random_scene(rng, kind, wide=wide)
        if motion.start < joint.range_end:
            found.append(errors(joint, motion, rng))
    return found


def assert_exact(found: list[Errors]) -> None:
    assert all(one.holds for one in found)
    assert any("post-catch" in one.phases for one in found)


# Phases must be the same, times within 1e-11 s or 4 ulp of the duration, torques within
# 1e-12 of the largest term: `errors` and `holds` say so. The scenes are fixed by their
# seeds: there is no false alarm.
@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_random_scenes_are_exact(kind: str, wide: bool) -> None:
    assert_exact(of_scenes(kind, wide=wide, seeds=range(1000, 1010)))


@pytest.mark.slow
@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_random_scenes_are_exact(kind: str, wide: bool) -> None:
    assert_exact(of_scenes(kind, wide=wide, seeds=range(250)))


@pytest.mark.parametrize("scene", CORNERS.values(), ids=CORNERS)
def test_corner_cases_are_exact(scene: tuple[ElbowParameters, Motion]) -> None:
    found = errors(*scene, np.random.default_rng(5))
    assert found.holds


# What the corner cases are for, by hand


@pytest.mark.parametrize(
    ("name", "phases"),
    [
        ("catch at the start", "catch post-catch"),
        ("catch beyond the range", "pre-catch"),
        ("stopped just before the catch", "pre-catch"),
        ("stopped just after the catch", "pre-catch catch"),
        ("D tiny", "pre-catch catch post-catch pre-catch"),
        ("D longer than the stretch", "pre-catch catch"),
        ("reversed in pre-catch", "pre-catch catch post-catch pre-catch"),
        # flexing ends the catch, and the second stretch catches again
        (
            "reversed in the peak",
            "pre-catch catch pre-catch catch post-catch pre-catch",
        ),
        (
            "reversed in post-catch",
            "pre-catch catch post-catch pre-catch catch post-catch pre-catch",
        ),
        # a rest does not end a catch, and one in post-catch does not arm the next
        ("interrupted in the peak", "pre-catch catch post-catch pre-catch"),
        ("interrupted in post-catch", "pre-catch catch post-catch pre-catch"),
    ],
)
def test_corner_cases_have_the_phases_they_are_built_for(
    name: str, phases: str
) -> None:
    found = errors(*CORNERS[name], np.random.default_rng(5))
    assert " ".join(found.phases) == phases
