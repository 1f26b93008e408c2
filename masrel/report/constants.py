"""Tables of the joint's constants: those all models share, and those of one model."""

from masrel.report._tables import Column, Table, Value
from masrel.report.material import Material

__all__ = ["constants_tables", "reading_of_q"]

_NUMBERS = {
    "inertia_kg_m2": ("m", "inertia (kg·m²)"),
    "damping_nms_rad": ("b", "damping (N·m·s/rad)"),
    "stiffness_nm_rad": ("k", "stiffness (N·m/rad)"),
    "catch_slope_s": ("α", "catch slope (s)"),
    "peak_duration_s": ("ΔT_peak", "duration of the peak (s)"),
    "post_catch_stiffness_nm_rad": ("k_post", "post-catch stiffness (N·m/rad)"),
    "speed_threshold_deg_s": ("ν_th", "speed threshold (deg/s)"),
    "slowest_mean_speed_deg_s": ("ν_L", "slowest mean speed (deg/s)"),
    "smallest_catch_angle_deg": ("θ_L", "smallest catch angle (deg)"),
    "rest_angle_deg": ("θ_rest", "angle without elastic torque (deg)"),
    "catch_rise_s": ("ΔT_rise", "rise of the catch to its peak (s)"),
}
"""Keys of ``[elbow]`` whose value is a number: symbol and meaning."""

_READINGS = {
    "post_catch": ("τ post-catch", "reading of the torque after the catch"),
    "residual_reading": ("Q", "reading of Q"),
}
"""Keys whose value is a word."""

_WORDS = {
    "continuous": "continuous: from the residual torque on",
    "additive": "additive: to the torque of pre-catch",
    "residual": "residual over peak torque",
    "decrease": "decrease after the peak over the rise",
}

_SILENT = {"rest_angle_deg": None, "catch_rise_s": 0.0}
"""Variants that a table does not name where no model has them."""


def constants_tables(material: Material) -> tuple[Table, ...]:
    """Show the constants of the joint models."""
    own = _own_rows(material)
    return (_shared(material, others=bool(own)), *_own(material, own))


def reading_of_q(material: Material) -> str:
    """Say what Q is a share of."""
    protocol = material.protocol
    shared = protocol.elbow.residual_reading
    own = {m.constants.residual_reading or shared for m in protocol.models}
    if own == {"residual"}:
        return "residual over peak torque of the catch"
    if own == {"decrease"}:
        return "decrease after the peak of the catch over the rise to it"
    return "share of the peak of the catch, as each model reads it (see below)"


def _shared(material: Material, *, others: bool) -> Table:
    elbow, stretch = material.protocol.elbow, material.protocol.stretch
    rows: list[tuple[Value, ...]] = [
        (*named, float(value))
        for key, named in _NUMBERS.items()
        if (value := getattr(elbow, key)) != _SILENT.get(key, "")
    ]
    rows += [
        ("θ_start", "start of a stretch (deg)", float(stretch.start_deg)),
        ("θ_end", "end of the range of motion (deg)", float(elbow.range_end_deg)),
    ]
    if elbow.post_catch != "continuous":
        rows.append((*_READINGS["post_catch"], _WORDS[elbow.post_catch]))
    if elbow.residual_reading != "residual":
        rows.append((*_READINGS["residual_reading"], _WORDS[elbow.residual_reading]))
    return Table(
        name="constants",
        caption=(
            "Constants all models share, but for those in the table below"
            if others
            else "Constants all models share"
        ),
        columns=_COLUMNS,
        rows=tuple(rows),
        data=material.data,
    )


_COLUMNS = (
    Column(key="symbol", heading="Symbol", align="left"),
    Column(key="meaning", heading="Meaning", align="left"),
    Column(key="value", heading="Value"),
)


def _own_rows(material: Material) -> tuple[tuple[Value, ...], ...]:
    rows: list[tuple[Value, ...]] = []
    for model in material.protocol.models:
        for key in model.constants.__struct_fields__:
            value = getattr(model.constants, key)
            if value is None or value == getattr(material.protocol.elbow, key):
                continue
            if key in _READINGS:
                rows.append((model.id, *_READINGS[key], _WORDS[value]))
            else:
                rows.append((model.id, *_NUMBERS[key], float(value)))
    return tuple(rows)


def _own(material: Material, rows: tuple[tuple[Value, ...], ...]) -> tuple[Table, ...]:
    if not rows:
        return ()
    table = Table(
        name="own_constants",
        caption="Constants that single models have of their own",
        columns=(Column(key="model", heading="Model", align="left"), *_COLUMNS),
        rows=rows,
        data=material.data,
    )
    return (table,)
