"""The figures of ``masrel trace``."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from masrel.cli.output import figure_form
from masrel.cli.trace_scene import Scene
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.report.figures import CatchCurve, CatchSchematic, StretchPanel

__all__ = ["VIEWS", "check_figure", "write_figure"]

VIEWS = ("angle", "time", "catch", "schematic")

N_PIXELS = 800
"""Points a line has: a panel is less wide than that."""


def check_figure(file: Path, view: str, scenes: Sequence[Scene]) -> None:
    """Check that a figure can be made, before anything is computed for it."""
    figure_form(file)
    models = _by_model(scenes)
    most = max(len(own) for own in models.values())
    if len(models) > 5 or (view != "catch" and (len(models) > 4 or most > 5)):
        raise ParameterError(
            "--figure: shows 4 models at 5 speeds at most, or with --view catch 5 "
            f"models, got {len(models)} and {most}"
        )
    if view == "catch":
        _check_catches(models)
    if view == "schematic":
        if len(scenes) != 1:
            raise ParameterError(
                f"--view schematic: shows one scene, got {len(scenes)}"
            )
        if not _n_caught(scenes):
            raise ParameterError("--view schematic: needs a stretch that catches")


def _check_catches(models: dict[str, list[Scene]]) -> None:
    for name, own in models.items():
        if len(own) < 2:
            raise ParameterError(
                f"--view catch: needs two or more speeds, got {len(own)}"
            )
        if (n_caught := _n_caught(own)) < 2:
            raise ParameterError(
                f"--view catch: needs two or more speeds at which {name} catches, got "
                f"{n_caught} of {len(own)}"
            )


def _n_caught(scenes: Sequence[Scene]) -> int:
    import numpy as np

    from masrel.elbow import evaluate

    joints = [scene.parameters for scene in scenes]
    found = evaluate(joints, [scene.motion for scene in scenes], ["catch"])
    return int(np.isfinite(found.column("catch")).sum())


def write_figure(scenes: Sequence[Scene], view: str, file: Path) -> None:
    """Draw scenes."""
    from masrel.report import figures

    form = figure_form(file)
    stamp = "computed from the joint model, not measured"
    if view == "catch":
        curves = [_curve(name, own) for name, own in _by_model(scenes).items()]
        drawn = figures.draw_catches(curves, form=form, stamp=stamp)
    elif view == "schematic":
        drawn = figures.draw_schematic(_schematic(scenes[0]), form=form, stamp=stamp)
    else:
        against: Literal["angle", "time"] = "angle" if view == "angle" else "time"
        panels = [_panel(name, own) for name, own in _by_model(scenes).items()]
        drawn = figures.draw_stretches(panels, against=against, form=form, stamp=stamp)
    file.write_bytes(drawn)


def _by_model(scenes: Sequence[Scene]) -> dict[str, list[Scene]]:
    models: dict[str, list[Scene]] = {}
    for scene in scenes:
        models.setdefault(scene.model, []).append(scene)
    return models


def _panel(name: str, own: Sequence[Scene]) -> "StretchPanel":
    import numpy as np

    from masrel.elbow import outline
    from masrel.report.figures import StretchLine, StretchPanel

    lines = []
    for scene in own:
        made = outline(scene.parameters, scene.motion, n_points=N_PIXELS)
        speed = scene.speed_deg_s
        lines.append(
            StretchLine(
                label=scene.kind if speed is None else f"{speed:g} deg/s",
                time=made.time,
                angle=np.degrees(made.angle),
                torque=made.torque,
                phases=tuple((s.name, s.start, s.end) for s in made.events.phases),
            )
        )
    return StretchPanel(title=name, lines=tuple(lines))


def _schematic(scene: Scene) -> "CatchSchematic":
    from masrel.elbow import outline, residual_torque
    from masrel.report.figures import CatchSchematic

    made = outline(scene.parameters, scene.motion, n_points=N_PIXELS)
    found = made.events
    if found.catch is None or found.catch_speed is None or found.peak_end is None:
        raise ParameterError("--view schematic: needs a stretch that catches")
    rise = scene.parameters.catch_torque_constant * found.catch_speed
    residual = residual_torque(scene.parameters, scene.motion)
    pre_end = residual - scene.parameters.residual_share * rise
    return CatchSchematic(
        title=scene.title,
        time=made.time,
        torque=made.torque,
        phases=tuple((s.name, s.start, s.end) for s in found.phases),
        catch=found.catch,
        peak_end=found.peak_end,
        catch_end=found.end if found.catch_end is None else found.catch_end,
        pre_end=pre_end,
        peak=pre_end + rise,
        residual=residual,
        residual_name=(
            r"$Q\,H\,v_c$"
            if scene.parameters.residual_reading == "residual"
            else r"$(1-Q)\,H\,v_c$"
        ),
    )


def _curve(name: str, own: Sequence[Scene]) -> "CatchCurve":
    import numpy as np

    from masrel.elbow import evaluate
    from masrel.report.figures import CatchCurve

    joints = [scene.parameters for scene in own]
    motions = [scene.motion for scene in own]
    outputs = ("mean_speed", "catch_angle", "catch", "catch_end")
    found = evaluate(joints, motions, outputs)
    caught = found.values[np.isfinite(found.column("catch"))]
    mean, angle, catch, end = caught[np.argsort(caught[:, 0])].T
    joint = joints[0]
    duration = end - catch
    which = np.flatnonzero(np.isfinite(found.column("catch")))
    ordered = which[np.argsort(caught[:, 0])].tolist()
    gone = [
        float(motions[i].angle(until, origin)) if np.isfinite(until) else np.nan
        for i, until, origin in zip(ordered, end.tolist(), angle.tolist(), strict=True)
    ]
    return CatchCurve(
        label=name,
        mean_speed=np.degrees(mean),
        catch_angle=np.degrees(angle),
        catch_speed=np.degrees(np.array(gone) / duration),
        duration=duration,
        clamps=(
            math.degrees(joint.slowest_mean_speed),
            math.degrees(joint.fastest_mean_speed),
        ),
    )
