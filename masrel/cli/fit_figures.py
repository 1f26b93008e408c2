"""The figures of ``masrel fit``, as files in a folder."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from masrel.elbow.identification import ElbowFit, FrictionFit
    from masrel.report.figures.style import Drawn

__all__ = ["draw_friction_fit", "draw_joint_fit"]


def draw_joint_fit(found: "ElbowFit", folder: Path) -> None:
    """Draw an identified joint."""
    from masrel.report.figures.fit_catch import draw_catches
    from masrel.report.figures.fit_residuals import draw_residuals
    from masrel.report.figures.fit_slow import draw_slow_trials
    from masrel.report.figures.fit_trial import draw_fast_trials

    stamp = _stamp(found)
    drawn = {
        "fit_slow": draw_slow_trials(found, stamp=stamp),
        "fit_residuals": draw_residuals(found, stamp=stamp),
    }
    if any(trial.after is not None for trial in found.trials):
        drawn["fit_trials"] = draw_fast_trials(found, stamp=stamp)
        drawn["fit_catches"] = draw_catches(found, stamp=stamp)
    _write(drawn, folder)


def draw_friction_fit(found: "FrictionFit", folder: Path) -> None:
    """Draw the friction of a device."""
    from masrel.report.figures.fit_friction import draw_friction

    _write({"fit_friction": draw_friction(found, stamp=_stamp(found))}, folder)


def _stamp(found: "ElbowFit | FrictionFit") -> str:
    return "SIMULATED DATA" if found.simulated else ""


def _write(drawn: "dict[str, Drawn]", folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in drawn.items():
        (folder / f"{name}.png").write_bytes(figure.png)
        (folder / f"{name}.svg").write_bytes(figure.svg)
    click.echo(f"figures: {folder}", err=True)
