"""Tables of an identified joint or device: values, intervals, what is not known."""

import math
from collections.abc import Sequence

from masrel.elbow.identification.friction import FrictionFit
from masrel.elbow.identification.quantities import QUANTITIES, Quantity
from masrel.elbow.identification.results import ElbowFit, FittedParameter
from masrel.report._tables import ABSENT, Column, Table, interval_text, number, percent

__all__ = ["fit_table", "friction_table"]

FRICTION = {
    "inertia": Quantity(symbol="I", key="inertia_kg_m2", unit="kg·m²"),
    "viscous": Quantity(symbol="B", key="viscous_nms_rad", unit="N·m·s/rad"),
    "coulomb": Quantity(symbol="β", key="coulomb_nm", unit="N·m"),
}


def fit_table(fit: ElbowFit) -> Table:
    """Make the table of an identified joint."""
    alone = {e.name: e for step in fit.steps for e in step.estimates}
    rows = tuple(_row(e, alone.get(e.name), QUANTITIES[e.name]) for e in fit.estimates)
    slow = sum(trial.pace == "slow" for trial in fit.trials)
    fast = len(fit.trials) - slow
    notes = (
        f"{slow} slow and {fast} fast trials; intervals are clustered by trial.",
        f"Slow trials differ from (1) by {number(100.0 * fit.relative_error, 1)} % of "
        f"their mean torque; all trials from the law by {number(fit.torque_sd, 3)} N·m "
        "(standard deviation).",
        "The column of a step takes what earlier steps found as known.",
        *fit.remarks,
    )
    return _table("joint", "Parameters of the joint", rows, notes, fit)


def friction_table(fit: FrictionFit) -> Table:
    """Make the table of an identified device."""
    rows = tuple(_row(e, None, FRICTION[e.name]) for e in fit.estimates)
    notes = (
        f"{len(fit.strokes)} strokes; intervals are clustered by stroke.",
        f"Torque differs from (7) by {number(100.0 * fit.relative_error, 1)} % of its "
        "mean.",
    )
    return _table("friction", "Friction of the device", rows, notes, fit)


def _row(
    estimate: FittedParameter, alone: FittedParameter | None, quantity: Quantity
) -> tuple[str, str, str, str, str, str, int]:
    factor = quantity.factor
    value, error = estimate.value * factor, estimate.standard_error * factor
    digits = _digits(value, error)
    interval, step = ABSENT, ABSENT
    if not math.isnan(error):
        low, high = estimate.low * factor, estimate.high * factor
        interval = interval_text(low, high, digits)
    if alone is not None and not math.isnan(alone.value):
        step = number(alone.value * factor, digits)
    return (
        quantity.symbol,
        quantity.unit,
        number(value, digits),
        number(error, digits) if not math.isnan(error) else ABSENT,
        interval,
        step,
        estimate.n_trials,
    )


def _digits(value: float, error: float) -> int:
    # two digits of the error, or four of the value
    if math.isnan(value):
        return 0
    size, wanted = (error, 1) if error > 0.0 else (abs(value), 3)
    return max(0, wanted - math.floor(math.log10(size))) if size > 0.0 else 3


def _table(
    name: str,
    caption: str,
    rows: Sequence[tuple[str | int, ...]],
    notes: tuple[str, ...],
    fit: ElbowFit | FrictionFit,
) -> Table:
    return Table(
        name=name,
        caption=caption,
        columns=(
            Column(key="parameter", heading="Parameter", align="left"),
            Column(key="unit", heading="Unit", align="left"),
            Column(key="value", heading="Value"),
            Column(key="standard_error", heading="SE"),
            Column(key="interval", heading=f"{percent(fit.level)} % interval"),
            Column(key="step", heading="Step alone"),
            Column(key="n_trials", heading="Trials"),
        ),
        rows=tuple(rows),
        notes=notes,
        data="simulated" if fit.simulated else "recorded",
    )
