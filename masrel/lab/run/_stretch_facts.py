"""The stretches of a presentation: what the protocol asks for, and what came of it."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.lab.elbow import JointModel
from masrel.lab.elbow.laws import _caught
from masrel.lab.hess import PresentationStatus, StretchRules
from masrel.lab.protocol import PresentationRules, Protocol, joint_model
from masrel.lab.recording import Recording, Stretch, _Fact, stretches
from masrel.lab.run._state import Felt


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchFacts:
    """What the log keeps of the stretches of one presentation."""

    stretches: list[dict[str, _Fact]]  # of each, with its cue
    felt: Felt
    # of cued stretches: where a fast one catches, how far a slow one goes, deg
    r1_deg: float | None
    r2_deg: float | None


class StatusOfHand(PresentationStatus):
    """Of a presentation to a simulated hand, which is done when it has made its way.

    One that holds is done when it brings the arm back after the last stretch.
    """

    __slots__ = ("_holds", "_is_armed", "_n_over", "_n_planned")

    def __init__(self, n_planned: int, *, holds: bool = False) -> None:
        self._n_planned = n_planned
        self._holds = holds
        super().__init__()

    @property
    def is_armed(self) -> bool:
        """Whether the next extension begins a stretch."""
        return self._is_armed

    @is_armed.setter
    def is_armed(self, is_armed: bool) -> None:
        self._is_armed = is_armed
        if is_armed and self._n_over >= self._n_planned:
            self.done()

    @property
    def n_stretches(self) -> int:
        """Stretches that are over."""
        return self._n_over

    @n_stretches.setter
    def n_stretches(self, n_over: int) -> None:
        self._n_over = n_over
        if n_over >= self._n_planned and not self._holds:
            self.done()


def stretch_rules(rules: PresentationRules, slowest_s: float) -> StretchRules:
    """Return the rules of the loop; a hand that needs longer for a stretch gets it."""
    n: int | None = None
    if isinstance(rules.stretches, int):
        n = rules.stretches
    elif isinstance(rules.stretches, tuple):
        n = len(rules.stretches)
    return StretchRules(
        n=n,
        time_limit=rules.time_limit_s,
        stretch_limit=max(rules.stretch_limit_s, slowest_s),
    )


def stretch_facts(protocol: Protocol, model: str, recording: Recording) -> StretchFacts:
    """Say what came of the stretches that were made."""
    made = stretches(recording)
    cues: tuple[str, ...] = ()
    if isinstance(protocol.presentation.stretches, tuple):
        cues = protocol.presentation.stretches
    cued = dict(enumerate(cues, start=1))
    r1_deg, r2_deg = _tardieu_angles(made, cued, recording)
    start = math.radians(protocol.stretch.start_deg)
    return StretchFacts(
        stretches=[
            {
                **dataclasses.asdict(stretch),
                "phases": ", ".join(stretch.phases),
                "cue": cued.get(stretch.number),
            }
            for stretch in made
        ],
        felt=_felt(made, joint_model(protocol, model), start),
        r1_deg=r1_deg,
        r2_deg=r2_deg,
    )


def _felt(made: Sequence[Stretch], joint: JointModel, start: float) -> Felt:
    if not any(stretch.reached_threshold for stretch in made):
        return "below-threshold"
    if any(stretch.catch_angle_deg is not None for stretch in made):
        return "felt"
    speeds = (s.mean_speed_deg_s for s in made if s.mean_speed_deg_s is not None)
    if any(_caught(joint, start, math.radians(speed)) for speed in speeds):
        return "no-catch"
    return "felt"  # a model without a catch at such a speed has nothing to miss


def _tardieu_angles(
    made: Sequence[Stretch], cues: dict[int, str], recording: Recording
) -> tuple[float | None, float | None]:
    # -> R1 and R2, deg, as `elbow.Tardieu` has them: R1 is R2 without a catch
    angle, number = recording.columns["angle_deg"], recording.columns["stretch"]
    slow = [stretch.number for stretch in made if cues.get(stretch.number) == "slow"]
    fast = [stretch for stretch in made if cues.get(stretch.number) == "fast"]
    r2_deg = max((float(angle[number == n].max()) for n in slow), default=None)
    caught = (s.catch_angle_deg for s in fast if s.catch_angle_deg is not None)
    return next(caught, r2_deg) if fast else None, r2_deg
