"""Real arms: what `fit` says of open recordings, and which law predicts them best.

python -m tests.benchmarks.real_arms FILE.csv ... [--sign -1] [--curve DEG_S]

The data are fetched by who runs this; none is shipped. Files are those that `masrel
fit` reads (time_s, angle_deg or angle_rad, torque_nm). Sources:

- https://github.com/myo-manipulation/SpasticMyoElbow (Apache-2.0):
  `data/ref_data_0_1.pkl`, nine stretches of a relaxed healthy elbow at constant speeds
  of 10 to 90 deg/s; a pickle: turn it into CSV files where it can do no harm.
  `data/ref_data_1.csv`, a torque-angle curve of a spastic elbow, digitised from a
  journal, without times: give the speed at which it may have been taken (``--curve
  90``).
- https://github.com/reklab/reklab_public (GPL-2.0; no licence for the data):
  `stiffnessID/experimental_data.mat`, five records of a human ankle that is perturbed
  by about one degree, at 1 kHz; export position and torque as CSV from MATLAB.

Every law is fitted to all recordings but one and predicts that one, up to a constant;
a single recording has nothing to predict it from: what is left is that of the fit.
"""

import argparse
import math
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls
from scipy.signal import savgol_filter

from masrel.errors import MasrelError
from masrel.lab.elbow import STANDARD_MODELS, ElbowParameters, SampledJoint, fit

Floats = NDArray[np.float64]
DELAY = 0.03  # s, of the reflex
WINDOW = 0.06  # s, of the filter of speeds


@dataclass(frozen=True)
class Arm:
    """One recording at even times: angle, its derivatives, torque without its mean."""

    name: str
    time: Floats
    angle: Floats
    speed: Floats
    acceleration: Floats
    torque: Floats


Law = Callable[[Sequence[Arm]], Callable[[Arm], Floats]]
"""From recordings to what predicts the torque of one, up to a constant."""


def read(path: Path, sign: float, curve: float | None) -> Arm:
    """A recording, or a curve as one at a constant speed (rad/s)."""
    if curve is not None:
        table = np.loadtxt(path, delimiter=",")
        table = table[np.argsort(table[:, 0])]
        time = np.radians(table[:, 0] - table[0, 0]) / curve
        angle, torque = np.radians(table[:, 0]), table[:, 1]
    else:
        with path.open(encoding="utf-8") as file:
            names = file.readline().strip().split(",")
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        column = {name: table[:, i] for i, name in enumerate(names)}
        time, torque = column["time_s"], column["torque_nm"]
        degrees = column.get("angle_deg")
        angle = column["angle_rad"] if degrees is None else np.radians(degrees)
    period = 0.002 if curve is not None else float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1], period)
    angle = np.interp(even, time, angle)
    torque = sign * np.interp(even, time, torque)
    n = 2 * round(0.5 * WINDOW / period) + 1
    return Arm(
        name=path.name,
        time=even,
        angle=angle,
        speed=savgol_filter(angle, n, 3, deriv=1, delta=period),
        acceleration=savgol_filter(angle, n, 3, deriv=2, delta=period),
        torque=torque - torque.mean(),
    )


def _centred(table: Floats) -> Floats:
    return table - table.mean(axis=0)


def _linear(columns: Callable[[Arm], Floats], n_free: int) -> Law:
    # least squares; columns from `n_free` on have no negative weight
    def learn(arms: Sequence[Arm]) -> Callable[[Arm], Floats]:
        table = np.concatenate([_centred(columns(arm)) for arm in arms])
        torque = np.concatenate([arm.torque for arm in arms])
        free = table[:, :n_free]
        both = np.concatenate([free, -free, table[:, n_free:]], axis=1)
        size = np.linalg.norm(both, axis=0)
        size[size == 0.0] = 1.0
        weights = nnls(both / size, torque, maxiter=1000)[0] / size
        values = np.concatenate(
            [weights[:n_free] - weights[n_free : 2 * n_free], weights[2 * n_free :]]
        )
        return lambda arm: _centred(columns(arm)) @ values

    return learn


def spring_damper(arm: Arm) -> Floats:
    """k·θ + b·ω + J·θ̈."""
    return np.stack([arm.angle, arm.speed, arm.acceleration], axis=1)


def reflex_stiffness(arms: Sequence[Arm]) -> Callable[[Arm], Floats]:
    """The same and (k0 + k1·v)[θ(t - d) - λ + μ·v(t - d)]+, by a grid over λ and μ."""
    low = min(float(arm.angle.min()) for arm in arms)
    high = max(float(arm.angle.max()) for arm in arms)
    best: tuple[float, Callable[[Arm], Floats]] | None = None
    for threshold in np.linspace(low, high, 15).tolist():
        for slope in (0.0, 0.1, 0.25, 0.5):

            def columns(arm: Arm, t: float = threshold, s: float = slope) -> Floats:
                at = arm.time - DELAY
                v = np.maximum(np.interp(at, arm.time, arm.speed), 0.0)
                past = np.interp(at, arm.time, arm.angle) - t + s * v
                reflex = np.maximum(past, 0.0)
                return np.column_stack([spring_damper(arm), reflex, v * reflex])

            learnt = _linear(columns, 3)(arms)
            left = sum(float(((arm.torque - learnt(arm)) ** 2).sum()) for arm in arms)
            if best is None or left < best[0]:
                best = left, learnt
    assert best is not None
    return best[1]


def this_law(arms: Sequence[Arm]) -> Callable[[Arm], Floats]:
    """(1) to (5), all parameters by the simplex of Nelder and Mead from each model."""
    thin = [_thinned(arm) for arm in arms]

    def left(vector: Floats) -> float:
        joint = _joint(vector)
        if joint is None:
            return math.inf
        return sum(float(((a.torque - _stepped(joint, a)) ** 2).sum()) for a in thin)

    best: tuple[float, Floats] | None = None
    for model in ("HM2", "HM4"):
        start = _vector(STANDARD_MODELS[model])
        options = {"maxfev": 500, "xatol": 1e-3, "fatol": 1e-4}
        made = minimize(left, start, method="Nelder-Mead", options=options)
        if best is None or made.fun < best[0]:
            best = float(made.fun), made.x
    assert best is not None
    joint = _joint(best[1])
    assert joint is not None
    return lambda arm: _stepped(joint, arm)


def _vector(joint: ElbowParameters) -> Floats:
    return np.array(
        [
            math.sqrt(joint.damping),
            math.sqrt(joint.stiffness),
            joint.catch_angle_constant,
            joint.catch_slope,
            math.sqrt(joint.catch_torque_constant),
            joint.residual_ratio,
            joint.catch_travel,
            math.sqrt(joint.post_catch_stiffness),
        ]
    )


def _joint(vector: Floats) -> ElbowParameters | None:
    b, k, line, slope, h, q, travel, post = vector.tolist()
    try:
        return ElbowParameters(
            damping=b * b,
            stiffness=k * k,
            catch_angle_constant=line,
            catch_slope=slope,
            catch_torque_constant=h * h,
            residual_ratio=q,
            catch_travel=travel,
            post_catch_stiffness=post * post,
            range_end=math.pi,
        )
    except MasrelError:
        return None


def _thinned(arm: Arm) -> Arm:
    every = max(1, round(0.01 / float(arm.time[1] - arm.time[0])))
    part = {name: getattr(arm, name)[::every] for name in list(vars(arm))[1:]}
    part["torque"] = part["torque"] - part["torque"].mean()
    return Arm(name=arm.name, **part)


def _stepped(joint: ElbowParameters, arm: Arm) -> Floats:
    sampled = SampledJoint(joint, start_angle=float(arm.angle[0]))
    rows = zip(
        (arm.time - arm.time[0]).tolist(),
        arm.angle.tolist(),
        arm.speed.tolist(),
        strict=True,
    )
    law = np.array([sampled.step(*row) for row in rows])
    return np.asarray(law - law.mean())


LAWS: dict[str, Law] = {
    "spring, damper, mass": _linear(spring_damper, 3),
    "reflex stiffness": reflex_stiffness,
    "this law": this_law,
}


def folds(arms: Sequence[Arm]) -> list[tuple[list[Arm], Arm]]:
    """What each law learns from, and what it predicts."""
    if len(arms) > 1:
        return [([*arms[:i], *arms[i + 1 :]], arm) for i, arm in enumerate(arms)]
    return [(list(arms), arms[0])]


def compare(arms: Sequence[Arm]) -> None:
    """Print what each law leaves of recordings that it has not seen, and has."""
    print(
        "| law | error of prediction (N·m) | of the torque's sd | error of fit (N·m) |"
    )
    print("|---|---|---|---|")
    for name, law in LAWS.items():
        seen, new, size = [], [], []
        for known, unseen in folds(arms):
            learnt = law(known)
            new.append(unseen.torque - learnt(unseen))
            size.append(unseen.torque)
            seen += [arm.torque - learnt(arm) for arm in known]
        error = math.sqrt(float((np.concatenate(new) ** 2).mean()))
        whole = math.sqrt(float((np.concatenate(size) ** 2).mean()))
        fitted = math.sqrt(float((np.concatenate(seen) ** 2).mean()))
        print(f"| {name} | {error:.3f} | {error / whole:.2f} | {fitted:.3f} |")


def said(arms: Sequence[Arm], **options: object) -> str:
    """What `fit` comes to: its verdict, or why it is refused."""
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for i, arm in enumerate(arms):
            files.append(Path(folder) / f"{i}.csv")
            table = np.column_stack([arm.time, arm.angle, arm.torque])
            head = "time_s,angle_rad,torque_nm"
            np.savetxt(files[-1], table, delimiter=",", header=head, comments="")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                made = fit(files, **options)  # type: ignore[arg-type]
            except MasrelError as error:
                return f"refused: {str(error).replace(folder + '/', '')}"
    values = ", ".join(
        f"{e.name} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]"
        for e in made.estimates
        if not math.isnan(e.value)
    )
    return f"{values}. {made.lack_of_fit.sentence}"


def main() -> None:
    """Read, fit, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--sign", type=float, default=1.0)
    parser.add_argument("--curve", type=float, help="deg/s, of a curve without times")
    args = parser.parse_args()
    curve = None if args.curve is None else math.radians(args.curve)
    arms = [read(path, args.sign, curve) for path in args.files]
    print("fit:", said(arms))
    everything = math.radians(200.0)
    print("fit, all slow, zero known:", said(arms, offset="off", slow_below=everything))
    compare(arms)


if __name__ == "__main__":
    main()
