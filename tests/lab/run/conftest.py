"""A study of three models and two raters, as small as a study can be."""

from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.schedule.sheets import write_schedules
from tests.lab.schedule.studies import with_secret

PROTOCOL = """
[study]
id = "three"
title = "Three models"

[scale]
name = "MAS"
grades = ["0", "1", "1+", "2", "3", "4"]

[[models]]
id = "HM1"
intended_grade = "1"
catch_angle_constant_deg = 130.0
catch_torque_nms_rad = 1.4
residual_ratio = 0.15
catch_travel_deg = 60.0

[[models]]
id = "HM3"
intended_grade = "2"
catch_angle_constant_deg = 115.0
catch_torque_nms_rad = 2.8
residual_ratio = 0.60
catch_travel_deg = 30.0

[[models]]
id = "D1"
role = "dummy"
catch_angle_constant_deg = 118.0
catch_torque_nms_rad = 2.1
residual_ratio = 0.40
catch_travel_deg = 40.0

[[raters]]
id = "R1"

[[raters]]
id = "R2"

[[sessions]]
id = "test"
raters = ["R1", "R2"]

[[sessions]]
id = "retest"
raters = ["R1"]

[schedule]
seed = 11

[simulated_raters]
seed = 5
"""


@pytest.fixture
def new_study(tmp_path: Path) -> Callable[..., tuple[StudyPaths, Protocol]]:
    """Make a study folder with drawn schedules; changes are (old, new) texts."""

    def make(
        *changes: tuple[str, str], name: str = "study"
    ) -> tuple[StudyPaths, Protocol]:
        text = PROTOCOL
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        study = StudyPaths(tmp_path / name)
        study.root.mkdir()
        study.protocol.write_text(text, encoding="utf-8")
        protocol = read_protocol(study.protocol)
        with_secret(study)
        write_schedules(protocol, study)
        return study, protocol

    return make


@pytest.fixture
def small(
    new_study: Callable[..., tuple[StudyPaths, Protocol]],
) -> tuple[StudyPaths, Protocol]:
    """The small study as it is."""
    return new_study()


@pytest.fixture
def faulty(
    new_study: Callable[..., tuple[StudyPaths, Protocol]],
) -> tuple[StudyPaths, Protocol]:
    """A study whose speed limit every stretch exceeds."""
    limit = "[device]\nspeed_limit_deg_s = 30.0\n\n[schedule]"
    return new_study(("[schedule]", limit))
