"""The protocol of a study: its types, and reading it with every error at once.

Goes in: ``protocol.toml``. Comes out: a :class:`Protocol`, and from it the scale,
the joint parameters of each model in SI units, and two hashes.
"""

from masrel.lab.protocol._gates import Gate, GateKeys, gates_of, parse_gate
from masrel.lab.protocol._occasions import Occasions
from masrel.lab.protocol._questions import Question, Questionnaire
from masrel.lab.protocol._sample_sizes import SampleSize
from masrel.lab.protocol.content import (
    elbow_parameters,
    joint_model,
    presented_content,
    presented_hash,
    protocol_hash,
    report_sections,
    scale_of,
)
from masrel.lab.protocol.definition import (
    Analysis,
    DeviceSettings,
    ElbowConstants,
    EstimatePlan,
    Model,
    ModelConstants,
    PresentationRules,
    Protocol,
    Rater,
    RaterField,
    Report,
    ScaleDefinition,
    ScheduleScheme,
    Session,
    SimulatedRaters,
    Stretch,
    Study,
    Training,
)
from masrel.lab.protocol.read import read_model_file, read_protocol
from masrel.lab.protocol.study import StudyPaths, copy_template, template_names

__all__ = [
    "Analysis",
    "DeviceSettings",
    "ElbowConstants",
    "EstimatePlan",
    "Gate",
    "GateKeys",
    "Model",
    "ModelConstants",
    "Occasions",
    "PresentationRules",
    "Protocol",
    "Question",
    "Questionnaire",
    "Rater",
    "RaterField",
    "Report",
    "SampleSize",
    "ScaleDefinition",
    "ScheduleScheme",
    "Session",
    "SimulatedRaters",
    "Stretch",
    "Study",
    "StudyPaths",
    "Training",
    "copy_template",
    "elbow_parameters",
    "gates_of",
    "joint_model",
    "parse_gate",
    "presented_content",
    "presented_hash",
    "protocol_hash",
    "read_model_file",
    "read_protocol",
    "report_sections",
    "scale_of",
    "template_names",
]
