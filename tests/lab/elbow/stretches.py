"""Stretches that the tests of the elbow share, and those of the paper."""

from math import radians
from pathlib import Path
from typing import NamedTuple

from masrel.lab.elbow import ConstantSpeed, MinimumJerk
from tests.files import table_of

PUBLISHED = Path(__file__).parents[3] / "studies/hess2012/ratings/published.csv"

START_DEG, END_DEG = 30.0, 146.0


class Published(NamedTuple):
    model: str
    speed_deg_s: float


def table_v() -> list[Published]:
    """The 32 models and mean speeds of Table V."""
    return [
        Published(row["model"], float(row["mean_speed_deg_s"]))
        for row in table_of(PUBLISHED)
    ]


def constant(
    speed_deg_s: float, *, start_deg: float = START_DEG, end_deg: float = END_DEG
) -> ConstantSpeed:
    return ConstantSpeed(
        start=radians(start_deg), end=radians(end_deg), speed=radians(speed_deg_s)
    )


def minimum_jerk(
    speed_deg_s: float, *, start_deg: float = START_DEG, end_deg: float = END_DEG
) -> MinimumJerk:
    return MinimumJerk(
        start=radians(start_deg), end=radians(end_deg), mean_speed=radians(speed_deg_s)
    )
