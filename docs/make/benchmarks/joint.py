"""The joint model: one scene, thousands of scenes, and how late samples are."""

from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import partial
from math import radians
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from docs.make.benchmarks.joint_stepped import places, step_together
from docs.make.benchmarks.rows import Benchmark, Result, Row
from docs.make.evidence import FIGURES
from masrel.lab.elbow import (
    STANDARD_MODELS,
    Columns,
    ConstantSpeed,
    ElbowParameters,
    MinimumJerk,
    Motion,
    Recorded,
    SampledJoint,
    Trapezoid,
    evaluate,
    events,
    trace,
)
from masrel.lab.elbow._scenes import EVENTS
from masrel.plots._style import BLACK, BLUE, DASHES, finished, house_style

KINDS: dict[str, type] = {
    "constant": ConstantSpeed,
    "minimum jerk": MinimumJerk,
    "trapezoid": Trapezoid,
}
HM3 = STANDARD_MODELS["HM3"]


def rows(quick: bool, _: Path) -> Iterator[Row]:
    """Yield all of them."""
    yield from one_scene()
    n = 200 if quick else 10_000
    for kind in KINDS:
        yield many_scenes(kind, kind, n)
    for kind in ("minimum jerk", "trapezoid"):
        yield many_scenes(f"{kind}, with inertia", kind, n, inertia=0.1)
    yield many_scenes("minimum jerk, slow", "minimum jerk", n, speeds="slow")


def one_scene() -> Iterator[Row]:
    """Events of one stretch of HM3, and of a recording of it, beside the plain loop."""
    whole = reach(92.0)
    times = np.linspace(0.0, whole.duration, 1500)
    speed, rate = radians(92.0), radians(600.0)
    for name, motion in {
        "constant": stretch(ConstantSpeed, speed=speed),
        "minimum jerk": whole,
        "trapezoid": stretch(Trapezoid, speed=speed, acceleration_rate=rate),
        "recorded, 1500 samples": Recorded(time=times, angle=whole.angle(times)),
    }.items():
        yield Row(
            what=f"a stretch, {name}",
            works={
                "events": partial(events, HM3, motion),
                "evaluate, events": partial(evaluate, HM3, motion, EVENTS),
                "evaluate, with peak": partial(evaluate, HM3, motion),
                "stepping": partial(step, HM3, motion, 1000.0),
            },
            turns=11,
        )


def stretch(kind: type, **speeds: float) -> Motion:
    return kind(start=radians(30.0), end=radians(146.0), **speeds)


SPEEDS_DEG_S = {"as in Table V": (60.0, 131.0), "slow": (2.0, 9.0)}


def columns(
    kind: str, n: int, *, inertia: float = 0.0, speeds: str = "as in Table V"
) -> tuple[Columns, Columns]:
    """Joints between the standard models, and stretches."""
    rng = np.random.default_rng(7)
    base = list(STANDARD_MODELS.values())
    names = [
        "catch_angle_constant",
        "catch_torque_constant",
        "residual_ratio",
        "catch_travel",
    ]
    values = np.array([[getattr(joint, name) for name in names] for joint in base])
    share = rng.uniform(0.0, 3.0, n)
    joints = Columns(
        ElbowParameters,
        inertia=inertia,
        **{
            name: np.interp(share, range(4), column)
            for name, column in zip(names, values.T, strict=True)
        },
    )
    speed = {"minimum jerk": "mean_speed"}.get(kind, "speed")
    moves: dict[str, object] = {
        "start": radians(30.0),
        "end": np.radians(rng.uniform(120.0, 145.0, n)),
        speed: np.radians(rng.uniform(*SPEEDS_DEG_S[speeds], n)),
    }
    if kind == "trapezoid":
        moves["acceleration_rate"] = radians(600.0)
    return joints, Columns(KINDS[kind], **moves)


def many_scenes(
    name: str,
    kind: str,
    n: int,
    *,
    inertia: float = 0.0,
    speeds: str = "as in Table V",
) -> Row:
    """Events and peak torque of many scenes beside stepping them all at once."""
    joints, motions = columns(kind, n, inertia=inertia, speeds=speeds)
    each = [motions.row(i) for i in range(n)]
    models = [replace(joint, inertia=inertia) for joint in STANDARD_MODELS.values()]
    four = [models[i % len(models)] for i in range(n)]
    different = [joints.row(i) for i in range(n)]
    p = asdict(STANDARD_MODELS["HM1"]) | joints.columns
    m = {name: np.broadcast_to(column, n) for name, column in motions.columns.items()}
    duration, at = places(kind, m)
    outputs = (*EVENTS, "peak_torque")
    return Row(
        what=f"{n:,} stretches, {name}",
        works={
            "Columns": partial(evaluate, joints, motions, outputs),
            "objects, four joints": partial(evaluate, four, each, outputs),
            "objects, all differ": partial(evaluate, different, each, outputs),
            "stepping": partial(step_together, p, m["start"], duration, at, 1000.0),
        },
        turns=3 if speeds == "slow" else 11,  # stepping the slow ones takes 20 s
    )


def step(joint: ElbowParameters, motion: Motion, rate_hz: float) -> tuple[float, float]:
    """The plain loop: when the catch is seen, and the largest torque."""
    n = int(np.floor(motion.duration * rate_hz)) + 1
    times = np.arange(n) / rate_hz
    samples = (times, motion.angle(times), motion.velocity(times))
    stepped = SampledJoint(joint, start_angle=motion.start)
    torques = [
        stepped.step(*sample)
        for sample in zip(*(column.tolist() for column in samples), strict=True)
    ]
    return stepped.catch_time, max(torques)


def reach(speed_deg_s: float) -> MinimumJerk:
    return MinimumJerk(
        start=radians(30.0), end=radians(146.0), mean_speed=radians(speed_deg_s)
    )


def exact(motion: Motion) -> tuple[float, float]:
    found = events(HM3, motion)
    return found.catch, found.catch_end


def sampled(rate_hz: float, motion: Motion) -> tuple[float, float]:
    made = trace(HM3, motion, rate_hz=rate_hz)
    catch, end = (made.time[np.argmax(made.phase == code)] for code in (1, 2))
    return float(catch), float(end)


def approach() -> tuple[list[float], dict[str, np.ndarray]]:
    """How late samples see catch and catch end, for many speeds, rate by rate."""
    rates = np.geomspace(50.0, 1e5, 60).tolist()
    late = np.empty((2, 9, len(rates)))
    for row, speed in enumerate(np.linspace(70.0, 130.0, 9)):
        motion = reach(float(speed))
        true = exact(motion)
        for column, rate in enumerate(rates):
            late[:, row, column] = np.subtract(sampled(rate, motion), true)
    return rates, {"catch": late[0], "catch end": late[1]}


def draw(_: list[Result]) -> None:
    """Draw how late a sampled law sees the events, speed by speed, by the rate."""
    rates, late = approach()
    with house_style(parse_math=True):
        figure = Figure(figsize=(6.2, 2.9))
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        periods = 1e3 / np.array(rates)
        for axes, (name, rows), most in zip(panels, late.items(), (1, 2), strict=True):
            axes.fill_between(
                rates, 0.0, most * periods, color="#DDDDDD", lw=0,
                label=f"0 to {most} period" + "s" * (most > 1),
            )  # fmt: skip
            for row in rows:
                axes.plot(rates, 1e3 * row, ".", color=BLUE, markersize=2.5)
            axes.axvline(1000.0, color=BLACK, lw=0.7, linestyle=DASHES)
            axes.set(title=name, xscale="log", xlabel="samples a second (Hz)")
            axes.set_yscale("symlog", linthresh=0.01)
            axes.legend(fontsize=7.5, loc="upper right")
        panels[0].set_ylabel("sampled − exact (ms)")
        picture = finished(figure, stamp="", forms=["png"])["png"]
        (FIGURES / "elbow_sampled.png").write_bytes(picture)


BENCHMARK = Benchmark(rows=rows, draw=draw)
