"""Trainings in adaptive order begun before their presentations were weighted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from masrel.lab.run import read_log
from masrel.lab.training import SimulatedTrainee, train_rater
from masrel.lab.training._lessons import record_of

RULES = """
[training]
order = "adaptive"
kappa_insufficient = 0.3
kappa_sufficient = 0.95
false_pass = 0.2
window = 24
max_presentations = 32
"""


def test_a_training_begun_without_weights_ends_without(tmp_path: Path) -> None:
    copy_template("small", tmp_path / "study")
    paths = StudyPaths(tmp_path / "study")
    with paths.protocol.open("a", encoding="utf-8") as file:
        file.write(RULES)
    protocol = read_protocol(paths.protocol)
    trainee = SimulatedTrainee(protocol)
    now = train_rater(paths, protocol, "R1", grades=trainee, clock="simulated")
    log = paths.training_log_file("R1")
    first, *others = read_log(log)
    fields = {k: v for k, v in first.fields.items() if k != "is_weighted"}
    old = record_of(log, [replace(first, fields=fields), *others], protocol)
    code = {grade: at for at, grade in enumerate(old.criterion.grades)}
    intended = np.array([code[one.intended] for one in old.lessons])
    given = np.array([code[one.grade] for one in old.lessons])
    alike = old.criterion.evidence(intended, given)
    assert old.evidence() == pytest.approx(alike, abs=0.0)
    assert now.evidence() != pytest.approx(alike)
