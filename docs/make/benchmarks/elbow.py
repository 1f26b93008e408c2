"""The joint model: one scene, thousands of scenes, and run time against error.

``python -m docs.make.benchmarks.elbow [--quiet]`` prints the tables of
docs/reference/elbow.md and draws its figures. Times are of the processor, so that other
load counts for less; all functions of a table are timed in turn in one run.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import radians

import numpy as np
from mpmath import mp
from tqdm import tqdm

from docs.make.benchmarks.elbow_ode import Ode
from docs.make.benchmarks.elbow_stepped import places, step_together
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
    peak_torque,
    trace,
)
from masrel.lab.elbow._scenes import EVENTS
from tests.benchmarks.sidebyside import Timing, side_by_side
from tests.lab.elbow.reference import solved

N_SCENES = 10_000
RATES_HZ = (100.0, 1e3, 1e4, 1e5)
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
KINDS: dict[str, type] = {
    "constant": ConstantSpeed,
    "minimum jerk": MinimumJerk,
    "trapezoid": Trapezoid,
}


def one_scene(turns: int) -> list[str]:
    """Events of one stretch of HM3, and of a recording of it, beside the plain loop."""
    joint, whole = STANDARD_MODELS["HM3"], reach(92.0)
    times = np.linspace(0.0, whole.duration, 1500)
    motions: dict[str, Motion] = {
        "constant": stretch(ConstantSpeed, speed=radians(92.0)),
        "minimum jerk": whole,
        "trapezoid": stretch(
            Trapezoid, speed=radians(92.0), acceleration_rate=radians(600.0)
        ),
        "recorded, 1500 samples": Recorded(time=times, angle=whole.angle(times)),
    }
    rows = []
    for name, motion in motions.items():
        timings = side_by_side(
            {
                "step": lambda motion=motion: step(joint, motion, 1000.0),
                "events": lambda motion=motion: events(joint, motion),
                "evaluate": lambda motion=motion: evaluate(joint, motion, EVENTS),
                "both": lambda motion=motion: evaluate(joint, motion),
            },
            turns=turns,
            clock=time.process_time,
        )
        found, table, both, stepped = (
            f"{1e6 * timings[key].median:.0f} µs"
            for key in ("events", "evaluate", "both", "step")
        )
        share = ratio(timings, "step", "events")
        rows.append(f"| {name} | {found} | {table} | {both} | {stepped} | {share} |")
    return rows


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
    kind: str, turns: int, *, inertia: float = 0.0, speeds: str = "as in Table V"
) -> str:
    """Events and peak torque of 10 000 scenes beside stepping them all at once."""
    joints, motions = columns(kind, N_SCENES, inertia=inertia, speeds=speeds)
    rows = range(N_SCENES)
    each = [joints.row(i) for i in rows], [motions.row(i) for i in rows]
    models = list(STANDARD_MODELS.values())
    four = [replace(models[i % 4], inertia=inertia) for i in range(4)] * (N_SCENES // 4)
    outputs = (*EVENTS, "peak_torque")
    p = {
        item.name: getattr(STANDARD_MODELS["HM1"], item.name)
        for item in fields(ElbowParameters)
    } | joints.columns
    m = {
        name: np.broadcast_to(column, N_SCENES)
        for name, column in motions.columns.items()
    }
    duration, at = places(kind, m)
    timings = side_by_side(
        {
            "step": lambda: step_together(p, m["start"], duration, at, 1000.0),
            "columns": lambda: evaluate(joints, motions, outputs),
            "objects": lambda: evaluate(*each, outputs),
            "models": lambda: evaluate(four, each[1], outputs),
        },
        turns=turns,
        clock=time.process_time,
    )
    table = evaluate(joints, motions, outputs)
    name = f"{kind}, with inertia" if inertia else kind
    name += ", slow" if speeds == "slow" else ""
    cells = [f"{1e3 * timings['step'].median:.0f} ms"]
    for way in ("columns", "models", "objects"):
        cells.append(f"{1e3 * timings[way].median:.1f} ms")
        cells.append(ratio(timings, "step", way))
    return f"| {name} | {' | '.join(cells)} | {table.n_alone} |"


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


def ratio(timings: dict[str, Timing], slow: str, fast: str) -> str:
    """How often the fast goes into the slow, turn by turn."""
    every = [
        a / b for a, b in zip(timings[slow].seconds, timings[fast].seconds, strict=True)
    ]
    low, middle, high = np.quantile(every, [0.25, 0.5, 0.75])
    return f"{middle:.3g} ± {100 * (high - low) / (2 * middle):.0f} %"


@dataclass(frozen=True)
class Point:
    """One way to find the events of a stretch: what it takes, and how far it is off."""

    way: str
    setting: str
    seconds: float
    error_s: float


def work_against_error(turns: int) -> list[Point]:
    """Largest error of catch and catch end over a few speeds, and the time it takes."""
    joint = STANDARD_MODELS["HM3"]
    motions = [reach(speed) for speed in (73.0, 81.0, 92.0, 104.0, 117.0)]
    ways: dict[tuple[str, str], tuple[Way, Way | None]] = {
        ("exact", ""): (_exact, _exact_and_peak)
    }
    for rate in RATES_HZ:
        name = f"{rate:g} Hz"
        ways["sampled", name] = (_sampled(rate), None)
    for tolerance in TOLERANCES:
        ways["solve_ivp", f"rtol {tolerance:g}"] = (_integrated(tolerance), None)
    errors = dict.fromkeys(ways, 0.0)
    with mp.workdps(50):
        for motion in motions:
            (true,) = solved(joint, motion).stretches
            for key, (find_events, _) in ways.items():
                catch, end = find_events(joint, motion)
                off = float(max(abs(catch - true.catch), abs(end - true.catch_end)))
                errors[key] = max(errors[key], off)

    def over(way: Way) -> Callable[[], object]:
        return lambda: [way(joint, motion) for motion in motions]

    timed = side_by_side(
        {
            " ".join(key): over(timed or find_events)
            for key, (find_events, timed) in ways.items()
        },
        turns=turns,
        clock=time.process_time,
    )
    return [
        Point(*key, timed[" ".join(key)].median / len(motions), errors[key])
        for key in ways
    ]


def reach(speed_deg_s: float) -> MinimumJerk:
    return MinimumJerk(
        start=radians(30.0), end=radians(146.0), mean_speed=radians(speed_deg_s)
    )


Way = Callable[[ElbowParameters, Motion], tuple[float, float]]


def _exact(joint: ElbowParameters, motion: Motion) -> tuple[float, float]:
    result = events(joint, motion)
    return result.catch, result.catch_end


def _exact_and_peak(joint: ElbowParameters, motion: Motion) -> tuple[float, float]:
    return events(joint, motion).end, peak_torque(joint, motion)


def _sampled(rate_hz: float) -> Way:
    def find_events(joint: ElbowParameters, motion: Motion) -> tuple[float, float]:
        made = trace(joint, motion, rate_hz=rate_hz)
        catch, end = (made.time[np.argmax(made.phase == code)] for code in (1, 2))
        return float(catch), float(end)

    return find_events


def _integrated(rtol: float) -> Way:
    def find_events(joint: ElbowParameters, motion: Motion) -> tuple[float, float]:
        ode = Ode(joint, motion, rtol=rtol, max_step=np.inf, method="RK45")
        return ode.found.get("catch", np.nan), ode.found.get("catch_end", np.nan)

    return find_events


def approach() -> tuple[list[float], dict[str, np.ndarray]]:
    """How late samples see catch and catch end, for many speeds, rate by rate."""
    rates = np.geomspace(50.0, 1e5, 60).tolist()
    joint = STANDARD_MODELS["HM3"]
    late: dict[str, list[list[float]]] = {"catch": [], "catch end": []}
    for speed in np.linspace(70.0, 130.0, 9):
        motion = reach(float(speed))
        true = events(joint, motion)
        rows: dict[str, list[float]] = {"catch": [], "catch end": []}
        for rate in rates:
            made = trace(joint, motion, rate_hz=rate)
            for code, name, exact in (
                (1, "catch", true.catch),
                (2, "catch end", true.catch_end),
            ):
                rows[name].append(
                    float(made.time[np.argmax(made.phase == code)]) - exact
                )
        for name, row in rows.items():
            late[name].append(row)
    return rates, {name: np.array(rows) for name, rows in late.items()}


def main() -> None:
    """Print the tables and draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    parser.add_argument("--turns", type=int, default=11)
    options = parser.parse_args()
    turns = options.turns
    scenes = [(kind, 0.0) for kind in KINDS]
    scenes += [("minimum jerk", 0.1), ("trapezoid", 0.1)]
    rows = one_scene(turns)
    with tqdm(total=len(scenes) + 3, desc="parts", disable=options.quiet) as bar:
        for kind, inertia in scenes:
            rows.append(many_scenes(kind, turns, inertia=inertia))
            bar.update()
        # one turn takes half a minute of stepping
        rows.append(many_scenes("minimum jerk", min(turns, 3), speeds="slow"))
        bar.update()
        points = work_against_error(turns)
        bar.update()
        from docs.make.benchmarks import elbow_figures

        elbow_figures.draw_work(points)
        elbow_figures.draw_approach(*approach())
        bar.update()
    print("\n".join(rows))
    for point in points:
        print(
            f"{point.way} {point.setting}: {point.seconds:.3g} s, {point.error_s:.2g} s"
        )


if __name__ == "__main__":
    main()
