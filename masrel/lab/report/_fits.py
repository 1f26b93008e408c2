"""The table, the JSON and the figures of an identified joint or device."""

import math
from collections.abc import Sequence

from masrel.lab.analysis._results import as_plain
from masrel.lab.elbow._model_file import (
    ALL_QUANTITIES,
    ARM_QUANTITIES,
    DEGREES,
    Quantity,
)
from masrel.lab.elbow.identification import (
    ComparedFit,
    ElbowFit,
    FittedParameter,
    FrictionFit,
    LackOfFit,
    LawComparison,
    LawFit,
)
from masrel.lab.elbow.identification._catches import Trial
from masrel.lab.elbow.identification._laws import LAWS
from masrel.lab.protocol._kinds import keys_of
from masrel.plots._drawn_values import Drawn, Form
from masrel.tables._tables import (
    ABSENT,
    SIMULATED,
    Column,
    Table,
    interval_text,
    number,
    percent,
)

FRICTION = {
    "inertia": Quantity(symbol="I", key="inertia_kg_m2", unit="kg·m²"),
    "viscous": Quantity(symbol="B", key="viscous_nms_rad", unit="N·m·s/rad"),
    "coulomb": Quantity(symbol="β", key="coulomb_nm", unit="N·m"),
}
"""Parameters of the friction law (7), as a reader sees them."""


def fit_table(fit: ElbowFit | FrictionFit) -> Table:
    """Return the table of an identified joint, or of a device's friction."""
    is_joint = isinstance(fit, ElbowFit)
    alone, quantities = {}, FRICTION
    error = f"{number(100.0 * fit.relative_error, 1)} %"
    if isinstance(fit, ElbowFit):
        alone = {e.name: e for step in fit.steps for e in step.estimates}
        quantities = ALL_QUANTITIES
        slow = sum(trial.stretch.pace == "slow" for trial in fit.trials)
        notes = (
            fit.lack_of_fit.sentence,
            f"{slow} slow and {len(fit.trials) - slow} fast trials; intervals are "
            "clustered by trial.",
            f"Torque in slow trials differs from equation (1) by {error} of its mean "
            "on average; the residual of all trials has a standard deviation of "
            f"{number(fit.torque_sd, 3)} N·m.",
            "Step alone: estimate of one step, which treats earlier results as known.",
            "To compare this law with other laws of tone, add --laws all.",
            *fit.remarks,
        )
    else:
        notes = (
            f"{len(fit.strokes)} strokes; intervals are clustered by stroke.",
            f"Torque differs from equation (7) by {error} of its mean on average.",
        )
    return Table(
        name="joint" if is_joint else "friction",
        caption="Parameters of the joint" if is_joint else "Friction of the device",
        columns=(
            Column(key="parameter", heading="Parameter", align="left"),
            Column(key="unit", heading="Unit", align="left"),
            Column(key="value", heading="Value"),
            Column(key="standard_error", heading="SE"),
            Column(key="interval", heading=f"{percent(fit.level)} % interval"),
            Column(key="step", heading="Step alone"),
            Column(key="n_trials", heading="Trials"),
        ),
        rows=tuple(
            _row(e, alone.get(e.name), quantities[e.name]) for e in fit.estimates
        ),
        notes=notes,
        data=_data_of(fit),
    )


def _data_of(fit: ElbowFit | FrictionFit) -> str:
    return "simulated" if fit.simulated else "recorded"


def residual_tables(fit: ElbowFit | FrictionFit) -> tuple[Table, ...]:
    """Return the table of the residual torque of a fitted joint, phase by phase."""
    if not isinstance(fit, ElbowFit):
        return ()
    lack = fit.lack_of_fit
    notes = [
        "Runs: number of runs of one sign, divided by the number expected for "
        "independent samples. Autocorrelation: between neighbouring samples."
    ]
    if not math.isnan(lack.after_to_before):
        ratio = number(lack.after_to_before, 2)
        notes.append(
            f"The residual after the onset of the catch is {ratio} times that before "
            "it."
        )
    if not math.isnan(lack.rest_sd):
        notes.append(f"Noise at rest: {number(lack.rest_sd, 3)} N·m.")
    table = Table(
        name="residuals",
        caption="Residual torque by phase",
        columns=(
            Column(key="phase", heading="Phase", align="left"),
            Column(key="n_samples", heading="Samples"),
            Column(key="sd", heading="Root mean square (N·m)"),
            Column(key="runs", heading="Runs"),
            Column(key="autocorrelation", heading="Autocorrelation"),
        ),
        rows=tuple(
            (
                phase.phase,
                phase.n_samples,
                number(phase.sd, 3),
                number(phase.runs, 2),
                number(phase.autocorrelation, 2),
            )
            for phase in lack.phases
        ),
        notes=tuple(notes),
        data=_data_of(fit),
    )
    return (table,)


def comparison_tables(compared: Sequence[ComparedFit]) -> tuple[Table, ...]:
    """Return the table of a comparison of fits, if there is one."""
    first = compared[0].fit if compared else None
    if first is None:
        return ()
    rows = tuple(
        (
            _with_text(each),
            number(each.error, 4) if each.fit else ABSENT,
            number(1e3 * each.worse, 3) if each.fit else ABSENT,
            number(1e3 * each.worse_se, 3) if each.fit else ABSENT,
            each.fit.lack_of_fit.verdict if each.fit else "refused",
            "chosen" if each.is_chosen else "",
        )
        for each in compared
    )
    columns = (
        Column(key="fit", heading="Fit", align="left"),
        Column(key="error", heading="Error (N·m)"),
        Column(key="worse", heading="Worse (10⁻³ N²·m²)"),
        Column(key="worse_se", heading="SE"),
        Column(key="verdict", heading="Verdict", align="left"),
        Column(key="chosen", heading="", align="left"),
    )
    notes = (
        "Error: root mean square error of a trial's torque predicted from the "
        "parameters of all other trials, with the trial's own constant, peak, residual "
        "and travel.",
        "Worse: mean square error minus that of the best fit, with its standard error "
        "over trials. The first fit within one standard error of the best is chosen.",
        *(f"{_with_text(each)}: {each.reason}" for each in compared if each.reason),
    )
    return (
        Table(
            name="comparison",
            caption="Fits compared by leaving trials out",
            columns=columns,
            rows=rows,
            notes=notes,
            data=_data_of(first),
        ),
    )


def _with_text(each: ComparedFit) -> str:
    words = ", ".join(name.replace("_", " ") for name in each.fitted)
    return f"with {words}" if words else "as given"


def comparison_document(compared: Sequence[ComparedFit]) -> dict[str, object]:
    """Return a comparison of fits as plain values for JSON; empty without one."""
    if not compared:
        return {}
    return {
        "comparison": as_plain(
            [
                {
                    "fitted": list(each.fitted),
                    "error_nm": each.error,
                    "worse_nm2": each.worse,
                    "worse_se_nm2": each.worse_se,
                    "chosen": each.is_chosen,
                    "verdict": each.fit.lack_of_fit.verdict if each.fit else None,
                    "reason": each.reason,
                    "estimates": [
                        _estimate(e, ALL_QUANTITIES[e.name])
                        for e in (each.fit.estimates if each.fit else ())
                    ],
                }
                for each in compared
            ]
        )
    }


def law_tables(laws: LawComparison | None) -> tuple[Table, ...]:
    """Return the table of laws that were fitted to the same recordings, if any."""
    if laws is None:
        return ()
    columns = (
        Column(key="law", heading="Law", align="left"),
        Column(key="n_parameters", heading="Parameters"),
        Column(key="rms", heading="Residual (N·m)"),
        Column(key="error", heading="Error (N·m)"),
        Column(key="worse", heading="Worse (10⁻³ N²·m²)"),
        Column(key="worse_se", heading="SE"),
    )
    rows = tuple(
        (
            each.name,
            each.n_parameters or ABSENT,
            *(
                ABSENT if math.isnan(value) else number(value, 3)
                for value in (each.rms, each.error, 1e3 * worse, 1e3 * error)
            ),
        )
        for each, worse, error in zip(laws.fits, laws.worse, laws.worse_se, strict=True)
    )
    notes = (
        laws.sentence,
        f"{len(laws.recordings)} recordings with equal weight; in addition to its "
        "parameters, each law has one constant per recording.",
        "Residual: root mean square of the torque after the fit. Error: root mean "
        "square error of a recording's torque predicted from all other recordings.",
        "Worse: mean square error minus that of the best law, with its standard error "
        "over recordings.",
        *(f"{each.name}: {each.reason}" for each in laws.fits if each.reason),
        *(f"{each.name}: {text}" for each in laws.fits for text in each.remarks),
    )
    return (
        Table(
            name="laws",
            caption="Laws compared by leaving recordings out",
            columns=columns,
            rows=rows,
            notes=notes,
            data="simulated" if laws.simulated else "recorded",
        ),
    )


def law_document(laws: LawComparison | None) -> dict[str, object]:
    """Return such a comparison as plain values for JSON; empty without one."""
    if laws is None:
        return {}
    rows = [
        {
            "law": each.name,
            "n_parameters": each.n_parameters,
            "rms_nm": each.rms,
            "error_nm": each.error,
            "worse_nm2": float(worse),
            "worse_se_nm2": float(error),
            "chosen": each.name == laws.chosen,
            "reason": each.reason,
            "remarks": each.remarks,
            "estimates": [_estimate(e, _law_quantity(each, e)) for e in each.estimates],
        }
        for each, worse, error in zip(laws.fits, laws.worse, laws.worse_se, strict=True)
    ]
    return {"laws": as_plain(rows), "laws_sentence": laws.sentence}


def _law_quantity(fit: LawFit, estimate: FittedParameter) -> Quantity:
    # the key is that of [models.parameters] in a protocol
    if estimate.name in ALL_QUANTITIES and fit.name not in LAWS:
        return ALL_QUANTITIES[estimate.name]
    if estimate.name in ARM_QUANTITIES:
        return ARM_QUANTITIES[estimate.name]
    keys = keys_of(LAWS[fit.name].law.kind).items()
    key, known = next((k, v) for k, v in keys if v.parameter == estimate.name)
    return Quantity(estimate.name, key, "", DEGREES if known.is_angle else 1.0)


def _row(
    estimate: FittedParameter, alone: FittedParameter | None, quantity: Quantity
) -> tuple[str, str, str, str, str, str, int]:
    factor = quantity.factor
    value, error = estimate.value * factor, estimate.standard_error * factor
    # two digits of the error, or four of the value
    size, n = (error, 1) if error > 0.0 else (abs(value), 3)
    digits = max(0, n - math.floor(math.log10(size))) if size > 0.0 else 3
    ends = interval_text(estimate.low * factor, estimate.high * factor, digits)
    has_step = alone is not None and not math.isnan(alone.value)
    return (
        quantity.symbol,
        quantity.unit,
        number(value, digits),
        ABSENT if math.isnan(error) else number(error, digits),
        ABSENT if math.isnan(error) else ends,
        number(alone.value * factor, digits) if alone and has_step else ABSENT,
        estimate.n_trials,
    )


def fit_document(fit: ElbowFit | FrictionFit) -> dict[str, object]:
    """Return a fit as plain values for JSON, units in the keys, ``nan`` as None."""
    document: dict[str, object] = as_plain(
        _joint_values(fit) if isinstance(fit, ElbowFit) else _friction_values(fit)
    )
    return document


def _joint_values(fit: ElbowFit) -> dict[str, object]:
    return {
        "simulated": fit.simulated,
        "level": fit.level,
        "relative_error": fit.relative_error,
        "torque_sd_nm": fit.torque_sd,
        "lack_of_fit": _lack_of_fit(fit.lack_of_fit),
        "arm": dict(fit.arm),
        "estimates": [_estimate(e, ALL_QUANTITIES[e.name]) for e in fit.estimates],
        "correlation": fit.correlation.tolist(),
        "steps": [
            {
                "name": step.name,
                "estimates": [
                    _estimate(e, ALL_QUANTITIES[e.name]) for e in step.estimates
                ],
            }
            for step in fit.steps
        ],
        "trials": [
            _trial(trial) | {"offset_nm": offset, "drift_nm_s": drift}
            for trial, offset, drift in zip(
                fit.trials, fit.offsets, fit.drifts, strict=True
            )
        ],
        "recordings": [
            {"name": name, "sha256": sha256} for name, sha256 in fit.sources.items()
        ],
        "remarks": list(fit.remarks),
    }


def _lack_of_fit(lack: LackOfFit) -> dict[str, object]:
    return {
        "verdict": lack.verdict,
        "sentence": lack.sentence,
        "level": lack.level,
        "tests": [
            {
                "structure": test.name,
                "t": test.t,
                "degrees_of_freedom": test.df,
                "p_value": test.p_value,
                "adjusted_p_value": test.adjusted,
            }
            for test in lack.tests
        ],
        "explained": lack.explained,
        "phases": [
            {
                "phase": phase.phase,
                "n_samples": phase.n_samples,
                "sd_nm": phase.sd,
                "runs": phase.runs,
                "autocorrelation": phase.autocorrelation,
            }
            for phase in lack.phases
        ],
        "after_to_before": lack.after_to_before,
        "rest_sd_nm": lack.rest_sd,
    }


def _friction_values(fit: FrictionFit) -> dict[str, object]:
    return {
        "simulated": fit.simulated,
        "level": fit.level,
        "n_strokes": len(fit.strokes),
        "relative_error": fit.relative_error,
        "torque_sd_nm": fit.torque_sd,
        "estimates": [_estimate(e, FRICTION[e.name]) for e in fit.estimates],
        "correlation": fit.correlation.tolist(),
    }


def _estimate(estimate: FittedParameter, quantity: Quantity) -> dict[str, object]:
    factor = quantity.factor
    return {
        "key": quantity.key,
        "value": estimate.value * factor,
        "standard_error": estimate.standard_error * factor,
        "degrees_of_freedom": estimate.df,
        "low": estimate.low * factor,
        "high": estimate.high * factor,
        "n_trials": estimate.n_trials,
        "reason": estimate.reason,
    }


def _trial(trial: Trial) -> dict[str, object]:
    stretch, time = trial.stretch, trial.stretch.samples.time
    document: dict[str, object] = {
        "name": stretch.name,
        "pace": stretch.pace,
        "start_s": float(time[0]),
        "duration_s": float(time[-1] - time[0]),
        "peak_speed_deg_s": math.degrees(stretch.peak_speed),
        "remark": trial.remark,
    }
    catch = trial.catch
    if catch is not None:
        document |= {
            "catch_s": catch.time,
            "catch_angle_deg": math.degrees(catch.angle),
            "catch_speed_deg_s": math.degrees(catch.speed),
            "mean_speed_deg_s": math.degrees(catch.mean_speed),
            "catch_end_s": catch.end,
            "catch_travel_deg": math.degrees(catch.travel),
        }
    return document


def fit_figures(fit: ElbowFit | FrictionFit) -> dict[str, dict[Form, bytes]]:
    """Return the figures of a fit by the names of their files, in every form."""
    # Imported here: a table loads nothing that draws.
    from masrel.plots import draw

    views = {"fit_slow": "slow", "fit_residuals": "residuals"}
    if isinstance(fit, FrictionFit):
        views = {"fit_friction": "friction"}
    elif any(trial.after is not None for trial in fit.trials):
        views |= {"fit_trials": "fast", "fit_catches": "catches"}
    return {
        name: draw(
            Drawn(f"masrel.lab.report._fit_figures:{view}_figure", (fit,)),
            stamp=SIMULATED * fit.simulated,
        )
        for name, view in views.items()
    }
