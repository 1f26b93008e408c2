"""The types a protocol file decodes into; each key of the file is a field here.

Every field has its unit in its name, its range in its type, and its meaning in
``docs/reference/protocol.md``.
"""

import re
import sys
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from masrel.estimates import IntervalMethod, Target
from masrel.lab.elbow.parameters import PostCatch, ResidualReading

_Identifier = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,31}\Z")]
_Text = Annotated[str, Meta(min_length=1)]

# TOML has inf and nan, no key of a protocol does: every float here has its limits.
_LARGEST = sys.float_info.max

_Angle = Annotated[float, Meta(gt=0, le=180)]
_RestAngle = Annotated[float, Meta(ge=0, le=180)]
_Positive = Annotated[float, Meta(gt=0, le=_LARGEST)]
_Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST)]
_NonNegative = Annotated[float, Meta(ge=0, le=_LARGEST)]


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the protocol file; unknown keys are errors."""


class Study(_Table, frozen=True, kw_only=True):
    """``[study]``: what the study is."""

    id: _Identifier
    title: _Text
    source: str = ""
    notes: str = ""
    language: Literal["en", "de", "fr", "es"] = "en"


class ScaleDefinition(_Table, frozen=True, kw_only=True):
    """``[scale]``: the grades a rater may give, least first, and what raters read."""

    name: _Text
    grades: Annotated[tuple[_Text, ...], Meta(min_length=2)]
    anchors: dict[str, _Text] = {}


class ElbowConstants(_Table, frozen=True, kw_only=True):
    """``[elbow]``: the constants all models share (Table III's last column)."""

    inertia_kg_m2: _NonNegative = 0.0
    damping_nms_rad: _NonNegative = 1.26
    stiffness_nm_rad: _NonNegative = 3.15
    catch_slope_s: _Positive = 0.35
    peak_duration_s: _Positive = 0.1
    post_catch_stiffness_nm_rad: _NonNegative = 5.8
    speed_threshold_deg_s: _Positive = 20.0
    slowest_mean_speed_deg_s: _NonNegative = 60.0
    smallest_catch_angle_deg: _Angle = 60.0
    range_end_deg: _Angle = 146.0
    rest_angle_deg: _RestAngle | None = None
    post_catch: PostCatch = "continuous"
    residual_reading: ResidualReading = "residual"
    catch_rise_s: _NonNegative = 0.0


class ModelConstants(_Table, frozen=True, kw_only=True):
    """``[models.constants]``: what a model does not share with the others."""

    inertia_kg_m2: _NonNegative | None = None
    damping_nms_rad: _NonNegative | None = None
    stiffness_nm_rad: _NonNegative | None = None
    catch_slope_s: _Positive | None = None
    post_catch_stiffness_nm_rad: _NonNegative | None = None
    rest_angle_deg: _RestAngle | None = None
    post_catch: PostCatch | None = None
    residual_reading: ResidualReading | None = None
    catch_rise_s: _NonNegative | None = None


class Model(_Table, frozen=True, kw_only=True):
    """``[[models]]``: one haptic model.

    L, H, Q, D and `constants` are those of a spastic elbow, which has no `parameters`;
    every other kind has these alone.
    """

    id: _Identifier
    role: Literal["standard", "dummy"] = "standard"
    intended_grade: str | None = None
    kind: str = "spastic-elbow"
    catch_angle_constant_deg: _Angle | None = None  # L
    catch_torque_nms_rad: _NonNegative | None = None  # H
    residual_ratio: Annotated[float, Meta(ge=0, lt=1)] | None = None  # Q
    catch_travel_deg: _Angle | None = None  # D
    file: _Text | None = None
    simulated: bool = False
    constants: ModelConstants = ModelConstants()
    parameters: dict[str, _Finite] = {}

    @property
    def overrides(self) -> dict[str, Any]:
        """The constants that it does not share with the others, by their keys."""
        constants = msgspec.structs.asdict(self.constants)
        return {key: value for key, value in constants.items() if value is not None}


class Rater(_Table, frozen=True, kw_only=True):
    """``[[raters]]``: one rater."""

    id: _Identifier
    note: str = ""
    site: _Identifier | None = None
    fields: dict[str, object] = {}


# What a field of raters may be called: a column of a table of raters
_FIELD_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")


class RaterField(_Table, frozen=True, kw_only=True):
    """``[rater_fields.NAME]``: something that is known of each rater."""

    type: Literal["text", "whole", "number", "choice", "date"]
    title: str = ""
    unit: str = ""
    choices: tuple[_Text, ...] = ()
    public: bool = False


class Session(_Table, frozen=True, kw_only=True):
    """``[[sessions]]``: one occasion on which raters meet every model."""

    id: _Identifier
    raters: Annotated[tuple[str, ...], Meta(min_length=1)]
    note: str = ""
    after: str | None = None
    at_least_days: Annotated[int, Meta(ge=0, le=36_500)] | None = None
    at_most_days: Annotated[int, Meta(ge=0, le=36_500)] | None = None
    order_policy: Literal["refuse", "warn"] = "refuse"


class ScheduleScheme(_Table, frozen=True, kw_only=True):
    """``[schedule]``: how the order of presentations is drawn."""

    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)]
    scheme: Literal[
        "random-order",
        "williams",
        "latin-square",
        "blocks",
        "no-immediate-repeat",
        "restricted",
    ] = "random-order"
    repeats: Annotated[int, Meta(ge=1, le=20)] = 1
    blocks_by: Literal["repeat", "role"] = "repeat"
    standards_apart: bool = False
    max_same_grade: Annotated[int, Meta(ge=1)] | None = None
    strata: Literal["none", "site"] = "none"


class Stretch(_Table, frozen=True, kw_only=True):
    """``[stretch]``: the movement a rater is asked to make."""

    start_deg: Annotated[float, Meta(ge=0, lt=180)] = 30.0
    end_deg: _Angle = 146.0
    largest_speed_deg_s: Annotated[float, Meta(gt=0, le=600)] = 131.0


# What a rater is asked for: V1 or V3 of the Tardieu scale
_Cue = Literal["slow", "fast"]


class PresentationRules(_Table, frozen=True, kw_only=True):
    """``[presentation]``: how often a rater may stretch the arm, and who says done."""

    stretches: (
        Literal["free"]
        | Annotated[int, Meta(ge=1, le=100)]
        | Annotated[tuple[_Cue, ...], Meta(min_length=1, max_length=100)]
    ) = 1
    time_limit_s: Annotated[float, Meta(gt=0, le=3600)] = 60.0
    stretch_limit_s: Annotated[float, Meta(gt=0, le=600)] = 20.0
    slow_speed_deg_s: Annotated[float, Meta(ge=1, le=600)] = 10.0  # V1
    fast_speed_deg_s: Annotated[float, Meta(ge=1, le=600)] = 120.0  # V3
    done_with: Literal["enter", "button"] = "enter"


class Occasions(_Table, frozen=True, kw_only=True):
    """``[occasions]``: practice, instructions, breaks, and coming back to a session."""

    instructions: Annotated[str, Meta(max_length=10_000)] = ""
    practice: Annotated[tuple[str, ...], Meta(max_length=100)] = ()
    break_after: Annotated[int, Meta(ge=1)] | None = None
    break_minutes: Annotated[float, Meta(gt=0, le=1440)] = 5.0
    resume: Literal["always", "same-day", "restart", "ask"] = "always"


class Blinding(_Table, frozen=True, kw_only=True):
    """``[blinding]``: what the files of a study that goes on say of its orders."""

    sealed: bool = False


# What questions are about, and so when they are asked
_When = Literal["presentation", "session", "study"]

_Whole = Annotated[int, Meta(ge=-1_000_000, le=1_000_000)]

_ANALOGUE_RANGE = (0, 100)  # the ends of a visual analogue scale


class Question(_Table, frozen=True, kw_only=True):
    """``[[questionnaires.questions]]``: one question and what can answer it."""

    id: _Identifier
    text: _Text
    type: Literal["whole", "visual-analogue", "choice", "text"]
    low: _Whole | None = None
    high: _Whole | None = None
    low_label: str = ""
    high_label: str = ""
    choices: tuple[_Text, ...] = ()
    required: bool = True
    public: bool = False

    @property
    def range(self) -> tuple[int, int] | None:
        """The least and the largest answer; None if answers are not numbers."""
        if self.type == "visual-analogue":
            return _ANALOGUE_RANGE
        if self.low is None or self.high is None:
            return None
        return self.low, self.high

    @property
    def needed(self) -> str:
        """What an answer is, in words."""
        if self.type == "text":
            return "text"
        if self.type == "choice":
            return f"one of {', '.join(self.choices)}"
        low, high = self.range or _ANALOGUE_RANGE
        kind = "a whole number" if self.type == "whole" else "a number"
        return f"{kind}, {low} to {high}"


class Questionnaire(_Table, frozen=True, kw_only=True):
    """``[[questionnaires]]``: questions that are asked together."""

    id: _Identifier
    title: _Text
    when: _When
    questions: Annotated[tuple[Question, ...], Meta(min_length=1)]


class DeviceSettings(_Table, frozen=True, kw_only=True):
    """``[device]``: which device, and the limits around it."""

    backend: _Identifier = "simulated"
    rate_hz: Annotated[int, Meta(ge=100, le=4000)] = 1000
    torque_limit_nm: Annotated[float, Meta(gt=0, le=28)] = 20.0
    torque_rate_limit_nm_s: _Positive = 12_000.0
    active_torque_limit_nm: Annotated[float, Meta(gt=0, le=28)] = 10.0
    active_energy_limit_j: Annotated[float, Meta(gt=0, le=100)] = 1.0
    active_speed_limit_deg_s: Annotated[float, Meta(gt=0, le=600)] = 180.0
    speed_limit_deg_s: Annotated[float, Meta(gt=0, le=600)] = 400.0
    lowest_angle_deg: Annotated[float, Meta(ge=-30, lt=180)] = -5.0
    highest_angle_deg: Annotated[float, Meta(gt=0, le=210)] = 185.0
    soft_stop_deg: Annotated[float, Meta(gt=0, le=30)] = 5.0
    soft_stop_torque_nm: Annotated[float, Meta(ge=0, le=28)] = 10.0
    missed_ticks_limit: Annotated[int, Meta(ge=0)] = 20
    missed_replies_limit: Annotated[int, Meta(ge=0, le=20)] = 2
    missed_replies_per_100_limit: Annotated[int, Meta(ge=0, le=100)] = 10
    stale_limit_ms: Annotated[float, Meta(gt=0, le=50)] = 5.0
    frozen_limit_ms: Annotated[float, Meta(gt=0, le=100)] = 10.0
    standing_limit_ms: Annotated[float, Meta(gt=0, le=5000)] = 500.0
    standing_torque_nm: Annotated[float, Meta(gt=0, le=28)] = 2.0
    actuator_limit_nm: Annotated[float, Meta(gt=0, le=28)] = 1.5
    jump_limit_deg: Annotated[float, Meta(gt=0, le=5)] = 0.3
    drift_limit_deg: Annotated[float, Meta(gt=0, le=180)] = 3.0
    drift_speed_deg_s: Annotated[float, Meta(gt=0, le=600)] = 25.0
    encoder_noise_deg: Annotated[float, Meta(ge=0, le=1)] = 0.0
    arrival_deg: Annotated[float, Meta(ge=0, le=180)] = 3.0
    arrival_speed_deg_s: Annotated[float, Meta(gt=0, le=600)] = 5.0
    arrival_ms: Annotated[float, Meta(gt=0, le=5000)] = 100.0
    watchdog_ms: Annotated[float, Meta(gt=0, le=100)] = 50.0
    ramp_ms: Annotated[float, Meta(ge=0, le=100)] = 50.0
    end_ramp_ms: Annotated[float, Meta(ge=0, le=1000)] = 100.0
    post_catch_ramp_ms: Annotated[float, Meta(ge=0, le=1000)] = 100.0
    friction_compensation: Annotated[float, Meta(ge=0, le=1)] = 0.9
    friction_viscous_nms_rad: _NonNegative = 0.168
    friction_coulomb_nm: _NonNegative = 0.189
    dead_zone_deg_s: _NonNegative = 0.1
    full_speed_deg_s: _Positive = 2.0
    slip_speed_drop_deg_s: _Positive = 40.0
    loose_inertia_kg_m2: _Positive = 0.06
    calibration_max_days: Annotated[int, Meta(ge=0)] | None = None
    torque_sensor: bool = False
    puck_interface: _Text = "socketcan"
    puck_channel: _Text = "can0"
    puck_node: Annotated[int, Meta(ge=1, le=7)] = 1
    puck_direction: Literal[1, -1] = 1
    puck_gear_ratio: _Positive = 18.8
    puck_checks_torque: bool = True
    puck_properties: dict[str, int] | None = None
    backends: dict[str, dict[str, Any]] = {}  # a table [device.NAME] by its name


class SimulatedRaters(_Table, frozen=True, kw_only=True):
    """``[simulated_raters]``: the raters of ``--grades simulated``."""

    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    accuracy: Annotated[float, Meta(ge=0, le=1)] = 0.84
    retest_agreement: Annotated[float, Meta(ge=0, le=1)] = 0.85
    mean_speed_deg_s: Annotated[float, Meta(ge=1, le=_LARGEST)] = 85.0
    speed_sd_deg_s: _NonNegative = 15.0
    hold_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    hand: Literal["clamp", "person"] = "clamp"


class Training(_Table, frozen=True, kw_only=True):
    """``[training]``: when ``masrel train`` has taught a rater enough."""

    kappa_insufficient: Annotated[float, Meta(ge=0, lt=1)] = 0.6
    kappa_sufficient: Annotated[float, Meta(gt=0, le=1)] = 0.8
    weights: Literal["identity", "linear", "quadratic"] = "linear"
    false_pass: Annotated[float, Meta(ge=0.001, le=0.5)] = 0.05
    false_fail: Annotated[float, Meta(ge=0.001, le=0.5)] = 0.1
    window: Annotated[int, Meta(ge=2, le=500)] = 60
    order: Literal["blocked", "adaptive"] = "blocked"
    max_presentations: Annotated[int, Meta(ge=2, le=500)] = 120
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0


class EstimatePlan(_Table, frozen=True, kw_only=True):
    """``[[analysis.estimates]]``: one line of the analysis plan."""

    id: _Identifier
    title: str = ""
    kind: Literal["inter-rater", "test-retest"]
    coefficient: _Text
    weights: Literal[
        "identity",
        "linear",
        "quadratic",
        "ordinal",
        "radical",
        "ratio",
        "circular",
        "bipolar",
    ] = "identity"
    models: Literal["standard", "dummy", "all"] = "standard"
    sessions: Annotated[tuple[str, ...], Meta(min_length=1, max_length=2)]
    target: Target
    interval: Literal["none", IntervalMethod] = "none"


class JudgeKeys(_Table, frozen=True, kw_only=True):
    """``[[analysis.judges]]``: a rater who may replace one of the others."""

    id: _Identifier
    judge: _Identifier
    session: str
    epsilon: Annotated[float, Meta(ge=0, le=1)]
    humans: tuple[str, ...] = ()
    min_items: Annotated[int, Meta(ge=1)] = 30


_Coefficient = Annotated[float, Meta(ge=-1, le=1)]
_Chance = Annotated[float, Meta(ge=0, le=1)]
_Width = Annotated[float, Meta(ge=0, le=100)]
_End = Annotated[float, Meta(ge=-100, le=100)]


class SampleSize(_Table, frozen=True, kw_only=True):
    """``[[analysis.sample_sizes]]``: what was taken to be true, and what it showed."""

    estimate: _Identifier
    n_items: Annotated[int, Meta(ge=2, le=10_000_000)]
    n_raters: Annotated[int, Meta(ge=1, le=1_000_000)]
    value: _Coefficient
    model: Literal["mixture", "dirichlet-multinomial", "latent", "table", "normal"]
    prevalences: tuple[_Chance, ...] = ()
    table: tuple[tuple[_Chance, ...], ...] = ()
    p_missing: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    sides: Literal[1, 2] = 2
    half_width: Annotated[float, Meta(gt=0, le=1)] | None = None
    lower: _Coefficient | None = None
    upper: _Coefficient | None = None
    null: _Coefficient | None = None
    expected_half_width: _Width | None = None
    expected_low: _End | None = None
    expected_high: _End | None = None
    assurance: _Chance | None = None
    power: _Chance | None = None
    coverage: _Chance | None = None
    method: Literal["exact", "simulation", "wald", "goodness-of-fit"] | None = None
    n_studies: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] | None = None


class Analysis(_Table, frozen=True, kw_only=True):
    """``[analysis]``: the plan, written before the data."""

    level: Annotated[float, Meta(gt=0.5, lt=1)] = 0.95
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    n_resamples: Annotated[int, Meta(ge=100, le=1_000_000)] = 10_000
    estimates: tuple[EstimatePlan, ...] = ()
    judges: tuple[JudgeKeys, ...] = ()
    sample_sizes: tuple[SampleSize, ...] = ()


class GateKeys(_Table, frozen=True, kw_only=True):
    """``[[report.gates]]``: one requirement and why there is one."""

    require: _Text
    why: str = ""


# Sections of a report, in the order in which a paper tells them
_Section = Literal[
    "design",
    "sample-size",
    "grades",
    "agreement",
    "test-retest",
    "categories",
    "intended",
    "confusion",
    "in-person",
    "order",
    "speeds",
    "traces",
    "questionnaires",
    "claims",
    "methods",
]


class Report(_Table, frozen=True, kw_only=True):
    """``[report]``: which sections the report has, in order."""

    title: str = ""
    # None leaves them to masrel: `report_sections` says which
    sections: tuple[_Section, ...] | None = None
    gates: tuple[GateKeys, ...] = ()
    formats: Annotated[
        tuple[Literal["html", "markdown", "latex", "docx"], ...], Meta(min_length=1)
    ] = ("html", "markdown")


class Protocol(_Table, frozen=True, kw_only=True):
    """A whole protocol file."""

    study: Study
    scale: ScaleDefinition
    elbow: ElbowConstants = ElbowConstants()
    models: Annotated[tuple[Model, ...], Meta(min_length=1)]
    raters: Annotated[tuple[Rater, ...], Meta(min_length=1)]
    rater_fields: dict[str, RaterField] = {}
    sessions: Annotated[tuple[Session, ...], Meta(min_length=1)]
    schedule: ScheduleScheme
    stretch: Stretch = Stretch()
    presentation: PresentationRules = PresentationRules()
    occasions: Occasions = Occasions()
    blinding: Blinding = Blinding()
    questionnaires: tuple[Questionnaire, ...] = ()
    device: DeviceSettings = DeviceSettings()
    simulated_raters: SimulatedRaters = SimulatedRaters()
    training: Training = Training()
    analysis: Analysis = Analysis()
    report: Report = Report()

    @property
    def rater_sessions(self) -> list[tuple[str, str]]:
        """Ids of every rater and session that come together, session by session."""
        return [(rater, each.id) for each in self.sessions for rater in each.raters]
