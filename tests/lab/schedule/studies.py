"""Protocols to draw from, made without a file."""

import hashlib
from collections.abc import Iterator
from typing import Any

from masrel.lab.protocol import (
    Model,
    Protocol,
    Rater,
    ScaleDefinition,
    ScheduleScheme,
    Session,
    Study,
    StudyPaths,
)

SECRET = bytes(range(16))


def with_secret(study: StudyPaths, secret: bytes = SECRET) -> StudyPaths:
    """The study, its secret published."""
    study.root.mkdir(exist_ok=True)
    text = f"format: 1\nsecret: {secret.hex()}\n"
    study.published_secret_file.write_text(text, encoding="utf-8")
    return study


def protocol_of(
    *,
    models: tuple[str, ...] = ("HM1", "HM2", "HM3", "HM4"),
    raters: tuple[str, ...] = ("R1", "R2"),
    seed: int = 1,
    repeats: int = 1,
    title: str = "A study",
    study: str = "tiny",
    sessions: tuple[str, ...] = ("test",),
    dummies: tuple[str, ...] = (),
    grades: dict[str, str] | None = None,
    sites: dict[str, str] | None = None,
    **rules: Any,
) -> Protocol:
    """A protocol in which every rater is in every session."""
    # dummies: those of the models; grades, sites: by model and by rater; rules: further
    # keys of [schedule]
    return Protocol(
        study=Study(id=study, title=title),
        scale=ScaleDefinition(name="MAS", grades=("1", "1+", "2", "3")),
        models=tuple(
            Model(
                id=name,
                role="dummy" if name in dummies else "standard",
                intended_grade="1+" if grades is None else grades.get(name),
                catch_angle_constant_deg=120.0,
                catch_torque_nms_rad=2.0,
                residual_ratio=0.3,
                catch_travel_deg=50.0,
            )
            for name in models
        ),
        raters=tuple(Rater(id=name, site=(sites or {}).get(name)) for name in raters),
        sessions=tuple(Session(id=name, raters=raters) for name in sessions),
        schedule=ScheduleScheme(seed=seed, repeats=repeats, **rules),
    )


def words_of(name: str) -> Iterator[int]:
    """The words of a stream that is started from the SHA-256 of a name."""
    return words_from(hashlib.sha256(name.encode()).hexdigest())


def words_from(digest: str) -> Iterator[int]:
    """PCG XSL RR 128/64 (O'Neill 2014, HMC-CS-2014-0905), started from 64 digits."""
    state, increment = int(digest[:32], 16), int(digest[32:], 16) | 1
    while True:
        state = (state * 0x2360ED051FC65DA44385DF649FCCF645 + increment) & (2**128 - 1)
        folded, turn = (state >> 64) ^ (state & (2**64 - 1)), state >> 122
        yield ((folded >> turn) | (folded << (64 - turn))) & (2**64 - 1)
