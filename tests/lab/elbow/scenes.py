"""Random scenes over many orders of magnitude, and corner cases built by hand."""

from dataclasses import replace
from math import nextafter, pi, radians

import numpy as np

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    Hold,
    Joined,
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    interrupted,
)

KINDS = (
    "constant",
    "minimum jerk",
    "trapezoid",
    "interrupted",
    "there and back",
    "recorded",
    "recorded, linear",
)

N_SEEDS = 715  # of each kind, at the speeds of a study and at all others: 10 010

Scene = tuple[ElbowParameters, Motion]


def random_scene(rng: np.random.Generator, kind: str, *, wide: bool) -> Scene:
    """Draw a joint and a motion that suit each other, so that most catch.

    With `wide` the speed is 1e-6 to 1e4 deg/s and durations reach 1e5 s; otherwise
    both are those of a study.
    """
    exponent = rng.uniform(-6, 4) if wide else rng.uniform(1.0, 2.3)
    speed = radians(10.0**exponent)
    start = rng.uniform(0.0, 1.5)
    way = min(rng.uniform(0.05, 1.6), 0.9e5 * speed / 3.0)
    end = start + way
    joint = _joint(rng, start, way, speed)
    return joint, _motion(rng, kind, start, end, speed)


def _joint(
    rng: np.random.Generator, start: float, way: float, speed: float
) -> ElbowParameters:
    def scaled(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    time = way / speed
    slope = rng.uniform(0.01, 0.5) * time  # α: a catch angle moves by a part of the way
    slowest = rng.uniform(0.0, 1.2) * speed
    constant = min(start + way * rng.uniform(0.2, 1.2) + slope * speed, pi)
    lowest = rng.uniform(-0.3, 0.7) * way + start
    return ElbowParameters(
        catch_angle_constant=constant,
        catch_torque_constant=float(
            rng.choice([0.0, rng.uniform(0.0, 5.0)], p=[0.1, 0.9])
        ),
        residual_ratio=float(rng.uniform(0.0, 0.99)),
        catch_travel=min(way * scaled(-9, 0.3), pi),
        inertia=float(rng.choice([0.0, rng.uniform(0.0, 0.3)])),
        damping=float(rng.choice([0.0, rng.uniform(0.0, 3.0)], p=[0.1, 0.9])),
        stiffness=float(rng.choice([0.0, rng.uniform(0.0, 8.0)], p=[0.1, 0.9])),
        catch_slope=slope,
        peak_duration=(peak := time * scaled(-9, 1)),
        catch_rise=float(rng.choice([0.0, peak * rng.uniform(0.0, 1.0)])),
        post_catch_stiffness=float(rng.uniform(0.0, 9.0)),
        speed_threshold=speed * rng.uniform(0.05, 1.3),
        slowest_mean_speed=slowest,
        smallest_catch_angle=max(0.0, min(lowest, constant - slope * slowest)),
        range_end=min(start + way * rng.uniform(0.3, 1.5), pi),
        rest_angle=None if rng.random() < 0.7 else float(rng.uniform(0.0, 2.0)),
        post_catch="additive" if rng.random() < 0.3 else "continuous",
        residual_reading="decrease" if rng.random() < 0.2 else "residual",
    )


def _motion(
    rng: np.random.Generator, kind: str, start: float, end: float, speed: float
) -> Motion:
    if kind == "constant":
        return ConstantSpeed(start=start, end=end, speed=speed)
    if kind == "minimum jerk":
        return MinimumJerk(start=start, end=end, mean_speed=speed)
    if kind == "trapezoid":
        rate = speed**2 / (end - start) * rng.uniform(1.01, 20.0)
        return Trapezoid(start=start, end=end, speed=speed, acceleration_rate=rate)
    if kind.startswith("recorded"):
        return _recorded(rng, start, end, speed, linear="linear" in kind)
    plain = str(rng.choice(["constant", "minimum jerk", "trapezoid"]))
    whole = _motion(rng, plain, start, end, speed)
    if kind == "interrupted":
        pause = whole.duration * float(rng.uniform(0.01, 1.0))
        return interrupted(
            whole, at=float(rng.uniform(0.1, 0.9)) * whole.duration, pause=pause
        )
    turn = float(rng.uniform(0.1, 1.0)) * whole.duration
    there = Part(motion=whole, begin=0.0, finish=turn)
    rest = Hold(start=there.end, duration=0.1 * whole.duration)
    if rng.random() < 0.5:
        return Joined([there, Reversed(motion=there), whole])
    return Joined([there, rest, Reversed(motion=there), whole])


def _recorded(
    rng: np.random.Generator, start: float, end: float, speed: float, *, linear: bool
) -> Recorded:
    # a smooth reach, sampled unevenly, with a hand's tremor
    n = int(rng.integers(5, 14))
    x = np.sort(rng.uniform(0.0, 1.0, n))
    x = np.concatenate([[0.0], x[(x > 0.01) & (x < 0.99)], [1.0]])
    share = x * x * (3.0 - 2.0 * x) + rng.normal(0.0, 0.02, x.size)
    angle = np.clip(start + (end - start) * share, 0.0, pi)
    angle[0] = start
    time = x * (end - start) / speed
    return Recorded(
        time=time, angle=angle, interpolation="linear" if linear else "pchip"
    )


def corner_cases() -> dict[str, Scene]:
    """Scenes in which something is just so."""
    hm3, hm1 = STANDARD_MODELS["HM3"], STANDARD_MODELS["HM1"]
    d = radians

    def line(speed: float, start: float = 30.0, end: float = 146.0) -> ConstantSpeed:
        return ConstantSpeed(start=d(start), end=d(end), speed=d(speed))

    def reach(speed: float, start: float = 30.0, end: float = 146.0) -> MinimumJerk:
        return MinimumJerk(start=d(start), end=d(end), mean_speed=d(speed))

    cases: dict[str, Scene] = {
        "catch at the start": (hm3, line(92.0, start=110.0)),
        "catch at onset": (hm3, reach(92.0, start=100.0)),
        "catch beyond the range": (replace(hm3, range_end=d(82.0)), line(92.0)),
        "stopped just before the catch": (hm3, line(92.0, end=82.8 - 1e-9)),
        "stopped just after the catch": (hm3, line(92.0, end=82.8 + 1e-9)),
        "mean speed ν_L": (hm3, ConstantSpeed(
            start=d(30), end=d(146), speed=hm3.slowest_mean_speed)),
        "mean speed just above ν_L": (hm3, ConstantSpeed(
            start=d(30), end=d(146), speed=nextafter(hm3.slowest_mean_speed, 9.0))),
        "mean speed ν_H": (hm1, ConstantSpeed(
            start=d(30), end=d(146), speed=hm1.fastest_mean_speed)),
        "mean speed just above ν_H": (hm1, ConstantSpeed(
            start=d(30), end=d(146), speed=nextafter(hm1.fastest_mean_speed, 9.0))),
        "speed just above ν_th": (hm3, ConstantSpeed(
            start=d(30), end=d(146), speed=nextafter(hm3.speed_threshold, 9.0))),
        "peak speed just above ν_th": (hm3, reach(20.0 / 1.875 * (1 + 1e-6))),
        "D tiny": (replace(hm3, catch_travel=1e-12), reach(92.0)),
        "D longer than the stretch": (replace(hm3, catch_travel=3.0), reach(92.0)),
        "peak tiny": (replace(hm3, peak_duration=1e-12), reach(92.0)),
        "peak longer than the stretch": (replace(hm3, peak_duration=50.0), reach(92.0)),
        "peak and catch end together": (
            replace(hm3, catch_travel=d(10.0), peak_duration=0.1), line(100.0)),
        "catch and range end together": (replace(hm3, range_end=d(82.8)), line(92.0)),
        "catch end and end together": (hm3, line(92.0, end=112.8)),
        "very slow": (replace(hm3, speed_threshold=d(1e-7)), line(1e-6, 90.0, 90.1)),
        "post-catch alone, very slow": (
            replace(
                hm3,
                damping=0.0,
                stiffness=0.0,
                catch_torque_constant=0.0,
                catch_angle_constant=d(90.000002),
                catch_travel=1e-9,
                slowest_mean_speed=0.0,
                speed_threshold=d(1e-7),
            ),
            line(1e-6, 90.0, 90.00001),
        ),
        "very fast": (hm3, line(1e4)),
        "very fast reach": (hm3, reach(1e4)),
        "1e5 s": (replace(hm3, speed_threshold=d(1e-4)), reach(0.00116)),
        "a rest of 1e5 s first": (hm3, Joined(
            [Hold(start=d(30), duration=1e5), reach(92.0)])),
        "ν_L above ν_H": (
            replace(hm3, smallest_catch_angle=d(100.0)), reach(92.0)),
    }  # fmt: skip
    at_threshold = ConstantSpeed(start=d(30), end=d(100), speed=hm3.speed_threshold)
    fast = line(92.0, end=100.0)
    cases |= {
        "speed ν_th": (hm3, ConstantSpeed(
            start=d(30), end=d(146), speed=hm3.speed_threshold)),
        "peak speed ν_th": (
            replace(hm3, speed_threshold=1.875),
            MinimumJerk(start=0.5, end=2.5, mean_speed=1.0),
        ),
        "flexed at ν_th": (hm3, Joined([fast, Reversed(motion=at_threshold), fast])),
        "stopped at the catch": (hm3, Joined(
            [line(92.0, end=82.8), Hold(start=d(82.8), duration=1.0)])),
        "catch at a joint": (hm3, Joined(
            [line(92.0, end=82.8), line(92.0, start=82.8)])),
        "stopped at the catch's end": (hm3, Joined(
            [line(92.0, end=112.8), Hold(start=d(112.8), duration=1.0),
             line(92.0, start=112.8)])),
        "slowed at the catch": (hm3, Joined(
            [line(92.0, end=82.8), line(19.0, start=82.8)])),
        "catch's end and range end together": (
            replace(hm3, range_end=d(112.8)), line(92.0)),
        "reach to the end of range": (hm3, reach(92.0, end=146.0)),
        "trapezoid to the end of range": (hm3, Trapezoid(
            start=d(30), end=d(146), speed=d(92.0), acceleration_rate=d(600.0))),
    }  # fmt: skip
    whole = reach(92.0)
    for name, share in (
        ("in pre-catch", 0.3),
        ("in the peak", 0.50),
        ("in the residual", 0.56),
        ("in post-catch", 0.75),
    ):
        there = Part(motion=whole, begin=0.0, finish=share * whole.duration)
        cases[f"reversed {name}"] = (
            hm3, Joined([there, Reversed(motion=there), whole])
        )  # fmt: skip
        cases[f"interrupted {name}"] = (
            hm3, interrupted(whole, at=share * whole.duration, pause=0.5)
        )  # fmt: skip
    return cases
