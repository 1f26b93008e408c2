"""What docs/reference/driver.md says is what the driver does."""

import csv
import re
from math import radians
from pathlib import Path

import pytest

from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk, trace
from masrel.lab.hess import Friction, device_names
from masrel.lab.protocol import DeviceSettings

from .rig import END, START

STUDY = Path(__file__).parents[3] / "studies" / "hess2012"
DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "reference/driver.md").read_text(encoding="utf-8")


def table_5() -> list[tuple[str, float]]:
    # Every model with every mean speed at which a rater stretched it
    with (STUDY / "ratings" / "published.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [(row["model"], float(row["mean_speed_deg_s"])) for row in rows]


def row(first: str) -> list[str]:
    # Cells of the table row that begins with a word
    line = next(line for line in PAGE.splitlines() if line.startswith(f"| {first} |"))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_devices_are_those_that_the_page_names() -> None:
    # When a backend is added, the page's first statement has to change.
    assert device_names() == ("moteus", "puck", "replay", "simulated")
    assert "It has not been tested on physical hardware" in PAGE
    first = (DOCS / "howto/laboratory/hardware.md").read_text("utf-8").split("\n\n")[1]
    assert first.startswith("**Nothing on this page has been tested on physical hard")


def shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "none" if value is None else str(value).removesuffix(".0")


# "backends" is no key: it has the tables [device.NAME]
KEYS = [key for key in DeviceSettings.__struct_fields__ if key != "backends"]


@pytest.mark.parametrize("key", KEYS)
def test_every_key_of_a_device_has_its_default_and_a_reason(key: str) -> None:
    rows = [
        line.strip("| ").split("|") for line in PAGE.splitlines() if line[:1] == "|"
    ]
    *cells, reason = next(row for row in rows if f"`{key}`" in "".join(row[:-1]))
    # "400 deg/s", "5 deg, 10 N·m", "−5 and 185 deg" or alone
    words = re.split(r"[ ,`]+", " ".join(cells).replace("−", "-"))
    assert shown(getattr(DeviceSettings(), key)) in words
    assert len(reason) > 20


def test_the_friction_is_the_default_one() -> None:
    friction = Friction()
    assert row("I, B, β")[1] == (
        f"{friction.inertia} kg·m², {friction.viscous} N·m·s/rad, "
        f"{friction.coulomb} N·m"
    )


def test_the_largest_torque_of_table_5_is_the_one_the_limit_is_explained_by() -> None:
    peaks = []
    for model, speed_deg_s in table_5():
        motion = MinimumJerk(start=START, end=END, mean_speed=radians(speed_deg_s))
        peaks.append((trace(STANDARD_MODELS[model], motion).torque.max(), model))
    assert max(peaks) == (pytest.approx(18.3, abs=0.05), "HM4")
    assert "HM4 at a mean speed of 72 deg/s asks for most, 18.3 N·m" in PAGE
