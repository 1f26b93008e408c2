"""Laws of tone fitted beside the elbow's own, and compared by leaving recordings out.

Every law is that of `masrel.lab.elbow.tone`, evaluated along the recorded motion. A
recording has a constant of its own, the sensor's zero, and all weigh the same.
"""

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from masrel._input import check_option
from masrel.errors import MasrelError, MasrelWarning, ParameterError
from masrel.lab.elbow._torque import torque
from masrel.lab.elbow.identification._catches import Law, Part, differentiate
from masrel.lab.elbow.identification._clusters import (
    FittedParameter,
    Rows,
    fitted,
    solve,
)
from masrel.lab.elbow.identification._identify import (
    ElbowFit,
    against_best,
    aligned,
    fit,
)
from masrel.lab.elbow.identification._reading import (
    Movement,
    even_samples,
    read_movement,
)
from masrel.lab.elbow.motions import Floats, Recorded
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Clonus,
    Cogwheel,
    Contracture,
    Dystonia,
    LeadPipe,
    ThresholdReflex,
    ToneModel,
)

# Torque is compared in means over so many seconds, those of a law over so many times
# within; the angle's filter passes no more.
_BIN_S, _WITHIN, _WINDOW_S = 0.02, 4, 0.06

# Evaluations from each start, from the best of them on, and from that fit on without a
# recording; the relative change of the sum of squares, or of the parameters, that ends
# the search.
_TRIED, _EVALUATIONS, _AGAIN, _PRECISE = 3, 40, 10, 1e-6

_NEAR_END = math.radians(2.0)  # of the farthest angle, where every movement stops

_SMALL = 1e-6
_BOUNDS = {
    "positive": (_SMALL, math.inf),
    "not negative": (0.0, math.inf),
    "share": (0.0, 1.0),
    "angle": (0.0, math.pi),
    "frequency": (_SMALL, 100.0),
}

_ARM = ("gravity", "arm_inertia")  # what every law may have beside it

ELBOW = ElbowParameters.kind


@dataclass(frozen=True, slots=True, kw_only=True)
class FittableLaw:
    """A law that torque recordings can identify.

    `free` is fitted, of `held` other values than the defaults are taken, and `tied`
    follows from what is fitted. The search begins at the defaults, and at each of
    `starts`; those of an angle are shares of the range that was recorded. `needs` says
    what recordings must hold.
    """

    law: type[ToneModel]
    free: tuple[str, ...]
    needs: str
    starts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    held: Mapping[str, Any] = field(default_factory=dict)
    tied: Callable[[Mapping[str, float]], dict[str, float]] = lambda _: {}

    def made(self, values: Sequence[float]) -> ToneModel:
        """Return the law with these values of its free parameters."""
        by_name = dict(zip(self.free, values, strict=True))
        return self.law(**self.held, **by_name, **self.tied(by_name))


_SPRING = ("stiffness", "damping")
_BRISTLE = (*_SPRING, "coulomb_torque", "bristle_travel")
_REFLEX = (
    "threshold",
    "threshold_slope",
    "reflex_stiffness",
    "delay",
    "passive_stiffness",
    "passive_damping",
)
_SPEEDS = "stretches beyond the threshold at different speeds"

LAWS: dict[str, FittableLaw] = {
    "spring-damper": FittableLaw(
        law=LeadPipe,
        free=_SPRING,
        held={"coulomb_torque": 0.0},
        needs="an angle and a speed that vary",
    ),
    LeadPipe.kind: FittableLaw(
        law=LeadPipe, free=_BRISTLE, needs="rests before stretches, or return movements"
    ),
    Cogwheel.kind: FittableLaw(
        law=Cogwheel,
        free=(*_BRISTLE, "gap_rate", "gap_depth", "gap_share"),
        needs="movements that last several gaps",
        starts={"gap_rate": (5.0, 6.0, 7.0, 8.0)},
        tied=lambda x: {"gap_edge": min(0.01, 0.5 * x["gap_share"] / x["gap_rate"])},
    ),
    ThresholdReflex.kind: FittableLaw(
        law=ThresholdReflex,
        free=_REFLEX,
        needs=_SPEEDS,
        starts={"threshold": (0.3, 0.7)},
    ),
    "stiffening-reflex": FittableLaw(
        law=ThresholdReflex,
        free=(*_REFLEX, "stiffening"),
        needs=_SPEEDS,
        starts={"threshold": (0.3, 0.7), "stiffening": (2.0,)},
    ),
    ClaspKnife.kind: FittableLaw(
        law=ClaspKnife,
        free=(
            "threshold",
            "threshold_slope",
            "reflex_stiffness",
            "firing_torque",
            "release_delay",
            "release_time",
            "residual_share",
            "passive_stiffness",
        ),
        needs="stretches in which the reflex gives way",
        starts={"threshold": (0.3, 0.6)},
        tied=lambda x: {"arming_angle": min(math.radians(50.0), x["threshold"])},
    ),
    Contracture.kind: FittableLaw(
        law=Contracture,
        free=(*_SPRING, "end_angle", "end_steepness"),
        needs="stretches that meet the end",
        starts={"end_angle": (0.7, 0.95)},
    ),
    Clonus.kind: FittableLaw(
        law=Clonus,
        free=(
            "beat_rate",
            "beat_torque",
            "beat_share",
            "fade_time",
            "trigger_angle",
            "delay",
        ),
        needs="fast stretches that are held",
        starts={"beat_rate": (4.0, 5.0, 6.0), "trigger_angle": (0.5,)},
    ),
}
"""The laws of tone that recordings of torque can identify, by name."""

UNFITTED = {
    Dystonia.kind: "its episodes follow a touch or a movement elsewhere, which "
    "recordings of torque and angle do not contain"
}
"""Those that they cannot, with the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LawFit:
    """One law of a comparison.

    Attributes
    ----------
    name : str
        Of `LAWS`, or the elbow's.
    estimates : tuple of FittedParameter
        Its parameters, clustered by recording; of the elbow's law by trial.
    rms : float
        Root mean square of the residual torque in the recordings it is fitted to, N·m.
    squares : ndarray, shape (n_recordings,)
        Per recording, the mean square error of its torque predicted from the others'
        parameters, (N·m)²; ``nan`` if undefined.
    reason : str or None
        Why the law is not scored.
    remarks : tuple of str
        What to look at before the law is believed.
    """

    name: str
    estimates: tuple[FittedParameter, ...] = ()
    rms: float = math.nan
    squares: Floats = field(compare=False, repr=False)
    reason: str | None = None
    remarks: tuple[str, ...] = ()

    @property
    def n_parameters(self) -> int:
        """How many parameters all recordings share."""
        return sum(not math.isnan(e.value) for e in self.estimates)

    @property
    def error(self) -> float:
        """Root mean square error of prediction, all recordings alike, N·m."""
        return math.sqrt(float(self.squares.mean()))


@dataclass(frozen=True, slots=True, kw_only=True)
class LawComparison:
    """Laws that were fitted to the same recordings.

    Attributes
    ----------
    fits : tuple of LawFit
        The elbow's law first.
    elbow : ElbowFit or None
        The fit of the elbow's law to all recordings, if there is one.
    worse, worse_se : ndarray, shape (n_laws,)
        Mean over recordings of the squared error less that of the best law, and its
        standard error, (N·m)²; ``nan`` where undefined.
    recordings : tuple of str
        Their names.
    simulated : bool
        Whether any recording is.
    """

    fits: tuple[LawFit, ...]
    elbow: ElbowFit | None
    worse: Floats = field(compare=False, repr=False)
    worse_se: Floats = field(compare=False, repr=False)
    recordings: tuple[str, ...]
    simulated: bool

    @property
    def chosen(self) -> str | None:
        """The law of fewest parameters within one standard error of the best."""
        near = np.flatnonzero(self.worse <= self.worse_se).tolist()
        least = min(near, key=lambda i: self.fits[i].n_parameters, default=None)
        return None if least is None else self.fits[least].name

    @property
    def sentence(self) -> str:
        """Which law predicts best, and whether that is more than chance."""
        order = [i for i in np.argsort(self.worse) if not math.isnan(self.worse[i])]
        if not order:
            return "No law can be scored, for the reasons below."
        best = self.fits[order[0]]
        text = f"{best.name} predicts left-out recordings best ({best.error:.3g} N·m)"
        if len(order) == 1:
            return f"{text}; no other law can be scored."
        second, worse = self.fits[order[1]], self.worse[order[1]]
        if worse > self.worse_se[order[1]]:
            return (
                f"{text}; the second best, {second.name} ({second.error:.3g} N·m), is "
                "worse by more than the standard error of the difference."
            )
        return (
            f"{text}, but {second.name} ({second.error:.3g} N·m) is not worse by more "
            "than the standard error of the difference, so these recordings do not "
            "decide between them. Among the laws within one standard error of the "
            f"best, {self.chosen} has the fewest parameters."
        )


class _Binned(NamedTuple):
    # one recording: its motion and times of it; means of torque, and what an arm adds
    motion: Recorded
    times: Floats  # (n_means * _WITHIN,)
    torque: Floats
    arm: Floats  # (n_means, n_terms), for 1

    def left(self, law: Floats, arm: Floats) -> Floats:
        # its torque less that of a law up to a constant, as one of equal recordings
        means = law.reshape(-1, _WITHIN).mean(axis=1)
        left = self.torque - means - self.arm @ arm
        return np.asarray((left - left.mean()) / math.sqrt(left.size))


def compare_laws(
    recordings: Sequence[Movement | Path | str],
    *,
    laws: Sequence[str] | None = None,
    progress: Callable[[int, int], object] = lambda _made, _all: None,
    **options: Any,
) -> LawComparison:
    """Fit laws of tone beside the elbow's, and predict each recording from the others.

    Parameters
    ----------
    recordings : sequence of Movement or path
        As for `fit`; each begins at rest.
    laws : sequence of str, optional
        Which of `LAWS`, and of those that cannot be fitted; all by default.
    progress : callable, optional
        Called after each law with how many are fitted, and how many there are.
    **options
        Those of `fit`. Weight and inertia of the arm, fitted or fixed, count for every
        law; what else an arm has for the elbow's alone.

    Returns
    -------
    LawComparison
        A recording left out keeps its own constant and nothing else. Every law is
        fitted again without it. Laws of tone start from their fit to all recordings,
        and take at most ten evaluations.

    Raises
    ------
    ParameterError
        If an option is outside its range, a lag above 0 or a drift is asked for, or a
        law is not known.
    RecordingError
        If a recording is not usable.
    """
    names = [*LAWS, *UNFITTED] if laws is None else laws
    for name in names:
        check_option("laws", name, (*LAWS, *UNFITTED))
    lag, drift = options.pop("lag", "off"), options.get("drift", "off")
    late = 0.0 if lag == "off" else lag
    if late == "fitted" or late > 0.0 or drift != "off":
        raise ParameterError(
            "laws: only the elbow's law can have a lag above 0 or a drift; needs "
            f"--lag off or below 0 and --drift off, got {lag} and {drift}"
        )
    movements = aligned(
        [
            entry if isinstance(entry, Movement) else read_movement(Path(entry))
            for entry in recordings
        ],
        late,
    )
    binned = [_binned(movement, options) for movement in movements]
    elbow, first = _elbow_fit(movements, binned, options)
    progress(1, 1 + len(names))
    nothing, fits = np.full(len(binned), math.nan), [first]
    for name in names:
        fits.append(
            LawFit(name=name, squares=nothing, reason=UNFITTED[name])
            if name in UNFITTED
            else _law_fit(name, binned, options)
        )
        progress(len(fits), 1 + len(names))
    worse, ses = against_best(np.array([each.squares for each in fits]))[1:]
    return LawComparison(
        fits=tuple(fits),
        elbow=elbow,
        worse=worse,
        worse_se=ses,
        recordings=tuple(movement.name for movement in movements),
        simulated=any(movement.simulated for movement in movements),
    )


def _binned(movement: Movement, options: Mapping[str, Any]) -> _Binned:
    samples = even_samples(movement)
    smooth = differentiate(samples.angle, samples.period, _WINDOW_S)
    lost = samples.in_gap | samples.saturated
    n = max(1, round(_BIN_S / samples.period))
    table = np.stack([samples.time, *smooth, samples.torque, lost])
    whole = table[:, : table.shape[1] // n * n]
    time, angle, speed, push, torque, lost = whole.reshape(6, -1, n).mean(axis=2)
    part = Part(time, angle, speed, push, 0.0 * push, torque, torque)
    arm: dict[str, Any] = {
        "constants": STANDARD_MODELS["HM1"],
        "fitted": (),
        "gravity_angle": options.get("gravity_angle", 0.0),
    }
    units = [Law(**(arm | {name: 1.0})).arm(part, "") for name in _ARM]
    used, motion = lost == 0.0, Recorded(time=time, angle=angle)
    within = n * samples.period * ((np.arange(_WITHIN) + 0.5) / _WITHIN - 0.5)
    times = (time - time[0])[used][:, None] + within
    return _Binned(
        motion=motion,
        times=np.clip(times, 0.0, motion.duration).ravel(),
        torque=torque[used],
        arm=np.stack(units, axis=1)[used],
    )


def _elbow_fit(
    movements: Sequence[Movement], binned: Sequence[_Binned], options: dict[str, Any]
) -> tuple[ElbowFit | None, LawFit]:
    # the law of the paper as `fit` has it, refitted without each recording in turn
    squares, made = np.full(len(binned), math.nan), None
    estimates: tuple[FittedParameter, ...] = ()
    rms, reason = math.nan, None
    try:
        made = fit(movements, **options)
        estimates = tuple(e for e in made.estimates if not math.isnan(e.value))
        rms = math.sqrt(float(np.mean([_elbow_left(made, each) for each in binned])))
        with warnings.catch_warnings():  # of all recordings they were given
            warnings.simplefilter("ignore", MasrelWarning)
            for i, each in enumerate(binned):
                reason = f"without {movements[i].name}: "
                rest = fit([*movements[:i], *movements[i + 1 :]], **options)
                squares[i] = _elbow_left(rest, each)
        reason = None
    except MasrelError as error:
        squares[:], reason = math.nan, f"{reason or ''}{error}"
    left = LawFit(
        name=ELBOW, estimates=estimates, rms=rms, squares=squares, reason=reason
    )
    return made, left


def _elbow_left(made: ElbowFit, each: _Binned) -> float:
    # mean square that a fitted joint and arm leave of a recording
    highest = float(each.motion.angle(each.times).max()) + _SMALL
    joint = made.joint()
    joint = replace(joint, range_end=max(joint.range_end, min(highest, math.pi)))
    terms = dict(made.arm) | {e.name: e.value for e in made.estimates}
    arm = [0.0 if terms[name] == "off" else terms[name] for name in _ARM]
    left = each.left(torque(joint, each.motion, each.times), np.array(arm))
    return float(left @ left)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _LawOfArm:
    """A law of tone and the terms of an arm, and how they are fitted together."""

    row: FittableLaw
    fixed: Floats  # (n_terms,) of the arm; 0 for one that is fitted, or off
    fits: NDArray[np.bool_]  # (n_terms,)

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.row.free, *compress(_ARM, self.fits))

    def left(self, x: Floats, each: _Binned) -> Floats:
        n, arm = len(self.row.free), self.fixed.copy()
        arm[self.fits] = x[n:]
        torques = self.row.made(x[:n].tolist()).torque(each.motion, each.times)
        return each.left(torques, arm)

    def all_left(self, x: Floats, binned: Sequence[_Binned]) -> Floats:
        return np.concatenate([self.left(x, each) for each in binned])

    def search(
        self, binned: Sequence[_Binned], start: Floats, most: int
    ) -> OptimizeResult:
        quantities = self.row.law.quantities()
        bounds = [_BOUNDS[quantities[name].needs] for name in self.row.free]
        bounds += [(-math.inf, math.inf)] * int(self.fits.sum())
        return least_squares(
            self.all_left,
            start,
            args=(binned,),
            bounds=tuple(np.array(bounds).T),
            x_scale="jac",
            max_nfev=most,
            ftol=_PRECISE,
            xtol=_PRECISE,
        )

    def best(self, binned: Sequence[_Binned]) -> OptimizeResult:
        of_arm = np.zeros(int(self.fits.sum()))
        starts = (np.append(start, of_arm) for start in _starts(self.row, binned))
        tried = [self.search(binned, start, _TRIED) for start in starts]
        nearest = min(tried, key=lambda each: float(each.cost))
        return self.search(binned, nearest.x, _EVALUATIONS)


def _law_fit(
    name: str, binned: Sequence[_Binned], options: Mapping[str, Any]
) -> LawFit:
    terms = [options.get(term, "off") for term in _ARM]
    law = _LawOfArm(
        row=LAWS[name],
        fixed=np.array([0.0 if isinstance(term, str) else term for term in terms]),
        fits=np.array([term == "fitted" for term in terms]),
    )
    best = law.best(binned)
    # what is at an end of its range moves no more, and the others beside it
    is_free = best.active_mask == 0
    cuts = np.cumsum([each.torque.size for each in binned])[:-1]
    pairs = zip(np.split(best.jac, cuts), np.split(best.fun, cuts), strict=True)
    rows = [Rows(-slopes * is_free, residuals) for slopes, residuals in pairs]
    estimates = _estimates(law.names, best.x, is_free, rows, options, law.row.needs)
    lone = [e for e in estimates if e.n_trials < 2]
    squares = np.full(len(binned), math.nan)
    for i, each in enumerate(binned) if not lone else ():
        rest = law.search([*binned[:i], *binned[i + 1 :]], best.x, _AGAIN)
        error = law.left(rest.x, each)
        squares[i] = error @ error
    return LawFit(
        name=name,
        estimates=estimates,
        rms=math.sqrt(2.0 * best.cost / len(binned)),
        squares=squares,
        reason=f"{lone[0].name}: {lone[0].reason}" if lone else None,
        remarks=tuple(_remarks(estimates, binned)),
    )


def _remarks(
    estimates: Sequence[FittedParameter], binned: Sequence[_Binned]
) -> Iterator[str]:
    farthest = max(float(each.motion.angle(each.times).max()) for each in binned)
    for e in estimates:
        if e.name == "threshold" and e.value > farthest - _NEAR_END:
            yield (
                f"its threshold, {math.degrees(e.value):.1f} deg, is where the "
                f"recorded movements end ({math.degrees(farthest):.1f} deg); look at "
                "the torque there, which may be that of a stop and not of a reflex"
            )


def _estimates(
    names: Sequence[str],
    values: Floats,
    is_free: NDArray[np.bool_],
    rows: Sequence[Rows],
    options: Mapping[str, Any],
    needs: str,
) -> tuple[FittedParameter, ...]:
    # clustered by recording, each with a constant of its own
    fit, level = solve(rows, n_local=len(rows)), options.get("level", 0.95)
    known = np.where(np.isnan(fit.values), math.nan, values)
    unknown = f"these recordings do not determine it: they need {needs}"
    made = fitted(
        names, replace(fit, values=known), level, dict.fromkeys(names, unknown)
    )
    return tuple(
        e
        if free and e.n_trials > 1
        else FittedParameter(
            name=e.name,
            value=math.nan if free else float(value),
            level=level,
            n_trials=e.n_trials if free else len(rows),
            reason=unknown if free else "at an end of its range",
        )
        for e, value, free in zip(made, values, is_free, strict=True)
    )


def _starts(row: FittableLaw, binned: Sequence[_Binned]) -> list[list[float]]:
    angles = np.concatenate([each.motion.angle(each.times) for each in binned])
    first, span = float(angles.min()), float(np.ptp(angles))
    defaults = row.law(**row.held)
    quantities = row.law.quantities()

    def of(name: str) -> list[float]:
        values = row.starts.get(name, ())
        if quantities[name].needs == "angle" and values:
            return [first + span * share for share in values]
        return list(values) or [getattr(defaults, name)]

    return [list(values) for values in product(*map(of, row.free))]
