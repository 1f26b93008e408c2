"""docs/reference/protocol.md has every table and key, with the default the code has."""

import json
import re
from pathlib import Path

import msgspec
import pytest

from masrel.lab import protocol as definition
from masrel.lab.protocol import Protocol, read_protocol, report_sections
from masrel.lab.protocol.definition import Blinding

PAGE = (Path(__file__).parents[3] / "docs/reference/protocol.md").read_text("utf-8")

TABLES = {
    "[study]": definition.Study,
    "[scale]": definition.ScaleDefinition,
    "[elbow]": definition.ElbowConstants,
    "[[models]]": definition.Model,
    "[models.constants]": definition.ModelConstants,
    "[[raters]]": definition.Rater,
    "[rater_fields.NAME]": definition.RaterField,
    "[[sessions]]": definition.Session,
    "[schedule]": definition.ScheduleScheme,
    "[stretch]": definition.Stretch,
    "[presentation]": definition.PresentationRules,
    "[occasions]": definition.Occasions,
    "[blinding]": Blinding,
    "[[questionnaires]]": definition.Questionnaire,
    "[[questionnaires.questions]]": definition.Question,
    "[device]": definition.DeviceSettings,
    "[simulated_raters]": definition.SimulatedRaters,
    "[training]": definition.Training,
    "[analysis]": definition.Analysis,
    "[[analysis.estimates]]": definition.EstimatePlan,
    "[[analysis.judges]]": definition.JudgeKeys,
    "[[analysis.sample_sizes]]": definition.SampleSize,
    "[report]": definition.Report,
    "[[report.gates]]": definition.GateKeys,
}


def documented(heading: str) -> dict[str, str]:
    """Key to default of the table under a heading of the page."""
    pattern = rf"^#+ `{re.escape(heading)}`.*?(?=^#|\Z)"
    found = re.search(pattern, PAGE, flags=re.DOTALL | re.MULTILINE)
    assert found, heading
    rows = re.findall(
        r"^\| `(\w+)` \|.*\| ([^|]+) \| [^|]+ \|$", found[0], re.MULTILINE
    )
    return dict(rows)


def said(field: msgspec.structs.FieldInfo) -> str:
    """The default of a field as the page says it."""
    if field.required:
        return "required"
    if field.default is None:
        return "none"
    if field.name == "sections":
        return 'all but `"in-person"` and `"questionnaires"`'
    if isinstance(field.default, msgspec.Struct) or field.default_factory is dict:
        return "`{}`"
    return f"`{json.dumps(field.default)}`"


@pytest.mark.parametrize("heading", TABLES)
def test_every_key_is_there_with_its_default(heading: str) -> None:
    fields = msgspec.structs.fields(TABLES[heading])
    # "backends" is no key: it has the tables [device.NAME], whose keys are not ours
    assert documented(heading) == {
        field.name: said(field) for field in fields if field.name != "backends"
    }


def test_every_table_of_a_protocol_is_there() -> None:
    names = {heading.strip("[]").removesuffix(".NAME") for heading in TABLES}
    fields = {field.name for field in msgspec.structs.fields(Protocol)}
    inner = {
        "analysis.estimates",
        "analysis.judges",
        "analysis.sample_sizes",
        "models.constants",
        "questionnaires.questions",
        "report.gates",
    }
    assert names == fields | inner


def test_the_default_sections_are_all_that_every_study_has() -> None:
    (union,) = (
        field.type
        for field in msgspec.inspect.type_info(definition.Report).fields
        if field.name == "sections"
    )
    study = Path(__file__).parents[3] / "studies/hess2012"  # it has something for each
    protocol = read_protocol(study / "protocol.toml")
    report = msgspec.structs.replace(protocol.report, sections=None)
    default = report_sections(msgspec.structs.replace(protocol, report=report))
    known = set(union.types[0].item_type.values)
    assert {*default, "in-person", "claims", "sample-size"} == known
