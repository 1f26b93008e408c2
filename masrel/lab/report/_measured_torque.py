"""Measured torque beside the torque that was sent, in the section `traces`.

In: a study's recordings. Out: figures of one presentation of each model.
"""

import math
from pathlib import Path

import numpy as np

from masrel.lab.recording import MEASURED_TORQUE, Recording, read_recording, stretches
from masrel.lab.report._figure_data import FIGURES, MeasuredPanel
from masrel.lab.report._material import Material
from masrel.pages._sections import Drawing, Paragraph
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import SIMULATED, number

_PANELS_PER_FIGURE = 4
_AROUND_S = 0.25  # shown before and after a stretch


def measured_blocks(material: Material) -> tuple[Paragraph | Drawing, ...]:
    """Return figures of the first presentation of each model; none without a sensor."""
    folder = material.recordings
    if folder is None or not material.protocol.device.torque_sensor:
        return ()
    recordings = _first_of_each_model(material, folder)
    if not recordings:
        text = "Measured torque is not in these data: no recording has it."
        return (Paragraph(text=text, absent=True),)
    return tuple(
        _drawing(material, recordings[first : first + _PANELS_PER_FIGURE], nth)
        for nth, first in enumerate(
            range(0, len(recordings), _PANELS_PER_FIGURE), start=1
        )
    )


def _first_of_each_model(material: Material, folder: Path) -> list[Recording]:
    # by model, in the protocol's order; of the first session and rater that have one
    models = [model.id for model in material.protocol.models]
    first: dict[str, Recording] = {}
    for session in material.sessions:
        for rater in material.raters:
            for path in sorted((folder / f"{session}_{rater}").glob("*.npz")):
                recording = read_recording(path)
                has_torque = MEASURED_TORQUE in recording.channels
                if has_torque and recording.facts["fault"] is None:
                    first.setdefault(str(recording.facts["model"]), recording)
            if first.keys() >= set(models):
                break
    return [first[model] for model in models if model in first]


def measured_panel(recording: Recording, title: str) -> MeasuredPanel:
    """Return what is drawn of one presentation: its first stretch."""
    first, last = _shown(recording)
    time = recording.columns["time_s"]
    shown = (time >= first) & (time <= last)
    columns = {name: column[shown] for name, column in recording.columns.items()}
    return MeasuredPanel(
        title=title,
        time=columns["time_s"] - max(first, 0.0),
        angle=columns["angle_deg"],
        sent=columns["command_torque_nm"],
        measured=columns[MEASURED_TORQUE.column],
    )


def _shown(recording: Recording) -> tuple[float, float]:
    # when the first stretch that could catch begins and ends, s, with some time around
    made = stretches(recording)
    if not made:
        return 0.0, math.inf
    stretch = next((each for each in made if each.reached_threshold), made[0])
    return stretch.onset_s - _AROUND_S, stretch.end_s + _AROUND_S


def _drawing(material: Material, recordings: list[Recording], nth: int) -> Drawing:
    panels = tuple(
        measured_panel(
            recording,
            "{model}\n{rater}, {session}".format_map(recording.facts),
        )
        for recording in recordings
    )
    listed = ", ".join(str(recording.facts["model"]) for recording in recordings)
    largest = max(float(np.nanmax(panel.measured)) for panel in panels)
    simulated = any(recording.facts["simulated"] for recording in recordings)
    return Drawing(
        name=f"measured_{nth}",
        caption=(
            f"Torque that the device's sensor measured of {listed} (line), and torque "
            "that was sent (dashed), above the angle: of the first presentation of "
            "each the first stretch that was fast enough for a catch. The measured "
            "torque also has the device's friction and the inertia of its motor, and "
            "what was sent has the compensation of friction taken off."
        ),
        alt=(
            f"Measured and sent torque against time for {listed}; the largest "
            f"measured torque is {number(largest, 1)} N·m."
        ),
        content=Drawn(FIGURES + "_trace_figures:measured_figure", (panels,)),
        stamp=SIMULATED if simulated else material.stamp,
    )
