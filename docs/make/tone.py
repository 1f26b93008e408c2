"""Draw the figures of docs/tone: each law, and what the simulated device makes of it.

``python -m docs.make.tone``
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from docs.make.evidence import FIGURES
from docs.make.tone_figures import ToneLine, ToneView, draw
from masrel.lab.elbow import Hold, Joined, MinimumJerk, Reversed
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
from masrel.lab.hess import Rendering, render

START = math.radians(30.0)

STRETCH_S, BACK_S = 1.6, 2.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What the figure of one law shows."""

    models: dict[str, ToneModel]  # by the label of their line
    shown: str  # the one that is rendered
    events: tuple[tuple[str, int], ...]  # of it that are marked: name, which of them
    hold: float = 0.6  # s


SCENES = {
    "tone_lead_pipe": Scene(
        models={f"UPDRS {n}": LeadPipe.of_updrs(n) for n in (1, 2, 3, 4)},
        shown="UPDRS 3",
        events=(("slip", 0), ("stick", 0), ("slip", 1)),
    ),
    "tone_cogwheel": Scene(
        models={"UPDRS 3": Cogwheel.of_updrs(3)},
        shown="UPDRS 3",
        events=(("slip", 0), ("gap", 3), ("gap ends", 3), ("stick", 0)),
    ),
    "tone_clasp_knife": Scene(
        models={
            "default": ClaspKnife(),
            "one that never gives way": replace(ClaspKnife(), residual_share=1.0),
        },
        shown="default",
        events=(("reflex", 0), ("fire", 0), ("release", 0), ("arm", 0)),
    ),
    "tone_contracture": Scene(
        models={f"severity {n}": Contracture.of_severity(n) for n in (1, 2, 3, 4)},
        shown="severity 3",
        events=(("end", 0), ("end left", 0)),
    ),
    "tone_dystonia": Scene(
        models={
            "with an episode": Dystonia(),
            "without": replace(Dystonia(), episode_duration=0.0),
        },
        shown="with an episode",
        events=(("episode", 0), ("episode ends", 0)),
    ),
    "tone_clonus": Scene(
        models={
            "Tardieu 4": Clonus.of_tardieu(4),
            "Tardieu 3": Clonus.of_tardieu(3),
        },
        shown="Tardieu 3",
        events=(("trigger", 0), ("stop", 0)),
        hold=2.0,
    ),
    "tone_threshold_reflex": Scene(
        models={
            f"MAS {grade}": ThresholdReflex.of_mas(grade)
            for grade in ("1", "2", "3", "4")
        },
        shown="MAS 2",
        events=(("threshold", 0), ("reflex ends", 0)),
    ),
    "tone_stiffening_reflex": Scene(
        models={"stiffening": ThresholdReflex.stiffening_with_speed()},
        shown="stiffening",
        events=(("threshold", 0), ("reflex ends", 0)),
    ),
}


def motion(model: ToneModel, hold: float) -> Joined:
    """A stretch to 130 deg or the end of range, a hold, and back."""
    end = min(math.radians(130.0), model.range_end - math.radians(1.0))
    there, back = (
        MinimumJerk(start=START, end=end, mean_speed=(end - START) / duration)
        for duration in (STRETCH_S, BACK_S)
    )
    return Joined([there, Hold(start=end, duration=hold), Reversed(motion=back)])


def line(label: str, model: ToneModel, hold: float) -> ToneLine:
    """The exact torque, with both sides of every event."""
    along = motion(model, hold)
    events = [event.time for event in model.events(along)]
    near = [time + side for time in events for side in (-1e-9, 1e-9)]
    grid = np.linspace(0.0, along.duration, 3000)
    times = np.clip(np.union1d(grid, near), 0.0, along.duration)
    return ToneLine(
        label=label,
        time=times,
        angle=np.degrees(along.angle(times)),
        torque=model.torque(along, times),
    )


def rendering(scene: Scene) -> Rendering:
    """One law on the simulated device."""
    model = scene.models[scene.shown]
    result = render(model, motion(model, scene.hold))
    if result.presented.fault is not None:
        raise SystemExit(f"{model.kind}: {result.presented.fault.message}")
    return result


def view(scene: Scene) -> ToneView:
    """What the figure of one law shows."""
    model = scene.models[scene.shown]
    events = model.events(motion(model, scene.hold))
    times = {
        name: [e.time for e in events if e.name == name] for name, _ in scene.events
    }
    columns = rendering(scene).presented.recording.columns
    held = STRETCH_S + scene.hold
    return ToneView(
        lines=tuple(line(label, m, scene.hold) for label, m in scene.models.items()),
        shown=list(scene.models).index(scene.shown),
        parts=(
            ("stretch", 0.0, STRETCH_S),
            ("hold", STRETCH_S, held),
            ("back", held, held + BACK_S),
        ),
        events=tuple((name, times[name][n]) for name, n in scene.events),
        rendered=ToneLine(
            label=scene.shown,
            time=columns["time_s"],
            angle=columns["angle_deg"],
            torque=columns["model_torque_nm"],
        ),
    )


def figures() -> None:
    """Draw the figure of every law."""
    for name, scene in SCENES.items():
        (FIGURES / f"{name}.png").write_bytes(draw(view(scene)))


if __name__ == "__main__":
    figures()
