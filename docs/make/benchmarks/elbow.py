"""The joint model: thousands of scenes, traces, and run time against error.

``python -m docs.make.benchmarks.elbow [--quiet]`` prints the tables of docs/elbow.md
and draws its figures. Times are of the processor, so that other load counts for less;
all functions of a table are timed in turn in one run.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from mpmath import mp
from tqdm import tqdm

from masrel.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    MinimumJerk,
    Motion,
    SampledJoint,
    evaluate,
    events,
    peak_torque,
    torque_traces,
    trace,
)
from masrel.elbow.scenes import EVENTS
from tests.benchmarks.sidebyside import Timing, side_by_side
from tests.elbow.ode import Ode
from tests.elbow.reference import solved

N_SCENES, N_STEPPED = 10_000, 100
N_TRACES, N_SAMPLES = 1000, 1500
RATES_HZ = (100.0, 1e3, 1e4, 1e5)
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)

Scenes = tuple[list[ElbowParameters], list[Motion]]


def scenes(kind: str, n: int, *, samples: int | None = None) -> Scenes:
    """Joints between the standard models, stretched at the speeds of Table V.

    With `samples` every stretch lasts that many milliseconds.
    """
    rng = np.random.default_rng(7)
    base = list(STANDARD_MODELS.values())
    joints, motions = [], []
    for i in range(n):
        joint = replace(
            base[i % 4],
            catch_angle_constant=radians(rng.uniform(110.0, 130.0)),
            catch_torque_constant=rng.uniform(1.4, 3.8),
            catch_travel=radians(rng.uniform(10.0, 60.0)),
        )
        start, end = radians(30.0), radians(rng.uniform(120.0, 145.0))
        speed = radians(rng.uniform(60.0, 131.0))
        if samples is not None:
            speed = (end - start) / ((samples - 0.5) / 1000.0)
        motion = (
            ConstantSpeed(start=start, end=end, speed=speed)
            if kind == "constant"
            else MinimumJerk(start=start, end=end, mean_speed=speed)
        )
        joints.append(joint)
        motions.append(motion)
    return joints, motions


def step(joint: ElbowParameters, motion: Motion, rate_hz: float) -> tuple[float, float]:
    """The plain loop: when the catch is seen, and the largest torque."""
    n = int(np.floor(motion.duration * rate_hz)) + 1
    times = np.arange(n) / rate_hz
    columns = (times, motion.angle(times), motion.velocity(times))
    stepped = SampledJoint(joint, start_angle=motion.start)
    torques = [
        stepped.step(*sample)
        for sample in zip(*(column.tolist() for column in columns), strict=True)
    ]
    return stepped.catch_time, max(torques)


def step_all(joints: Sequence[ElbowParameters], motions: Sequence[Motion]) -> None:
    for joint, motion in zip(joints, motions, strict=True):
        step(joint, motion, 1000.0)


def ratio(timings: dict[str, Timing], slow: str, fast: str, factor: float) -> str:
    """How often the fast goes into the slow, turn by turn, times a factor."""
    every = [
        factor * a / b
        for a, b in zip(timings[slow].seconds, timings[fast].seconds, strict=True)
    ]
    low, middle, high = np.quantile(every, [0.25, 0.5, 0.75])
    return f"{middle:.3g} ± {100 * (high - low) / (2 * middle):.0f} %"


def many_scenes(kind: str, turns: int) -> str:
    """Events and peak torque of 10 000 scenes beside the plain loop over some."""
    joints, motions = scenes(kind, N_SCENES)
    outputs = (*EVENTS, "peak_torque")
    timings = side_by_side(
        {
            "step": lambda: step_all(joints[:N_STEPPED], motions[:N_STEPPED]),
            "together": lambda: evaluate(joints, motions, outputs),
        },
        turns=turns,
        clock=time.process_time,
    )
    alone = evaluate(joints, motions, outputs).n_alone
    scaled = N_SCENES / N_STEPPED
    return (
        f"| {kind} | {1e3 * timings['together'].median:.0f} ms "
        f"| {scaled * timings['step'].median:.1f} s "
        f"| {ratio(timings, 'step', 'together', scaled)} | {alone} |"
    )


def many_traces(kind: str, turns: int) -> str:
    """Traces of 1000 scenes of 1500 samples beside one multiply and the plain loop."""
    joints, motions = scenes(kind, N_TRACES, samples=N_SAMPLES)
    made = torque_traces(joints, motions)
    sampled = torque_traces(joints, motions, reading="sampled")
    if not made.shape == sampled.shape == (N_TRACES, N_SAMPLES):
        raise SystemExit(f"traces of shapes {made.shape} and {sampled.shape}")
    out = np.empty_like(made)
    timings = side_by_side(
        {
            "multiply": lambda: np.multiply(made, 2.0, out=out),
            "sampled": lambda: torque_traces(joints, motions, reading="sampled"),
            "exact": lambda: torque_traces(joints, motions),
            "step": lambda: step_all(joints[:N_STEPPED], motions[:N_STEPPED]),
        },
        turns=turns,
        clock=time.process_time,
    )
    scaled = N_TRACES / N_STEPPED
    return "\n".join(
        f"| {kind} | {reading} | {1e3 * timings[reading].median:.1f} ms "
        f"| {ratio(timings, reading, 'multiply', 1.0)} "
        f"| {ratio(timings, 'step', reading, scaled)} |"
        for reading in ("exact", "sampled")
    )


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
        ways["stepped", name] = (_sampled(rate), _stepped(rate))
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


def _stepped(rate_hz: float) -> Way:
    return lambda joint, motion: step(joint, motion, rate_hz)


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
    turns, rows = options.turns, []
    with tqdm(total=6, desc="parts", disable=options.quiet) as bar:
        for table in (many_scenes, many_traces):
            for kind in ("constant", "minimum jerk"):
                rows.append(table(kind, turns))
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
