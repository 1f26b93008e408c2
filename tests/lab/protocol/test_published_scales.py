"""A protocol may call a scale of the literature by its name."""

import json
from pathlib import Path

import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import (
    Protocol,
    presented_content,
    protocol_hash,
    read_protocol,
    scale_of,
)
from masrel.scales import PUBLISHED_SCALES, Scale, published_scale

SMALL = Path(__file__).parents[3] / "studies" / "small" / "protocol.toml"
TABLE = '[scale]\nname = "MAS"\ngrades = ["0", "1", "1+", "2", "3", "4"]\n'


def with_scale(folder: Path, *, top: str = "", table: str = "") -> Protocol:
    text = SMALL.read_text(encoding="utf-8")
    assert TABLE in text
    text = text.replace('grade = "1+"', 'grade = "1"')  # which most scales lack
    path = folder / "protocol.toml"
    path.write_text(top + text.replace(TABLE, table), encoding="utf-8")
    return read_protocol(path)


@pytest.mark.parametrize("name", PUBLISHED_SCALES)
def test_a_name_hashes_as_the_table_that_it_stands_for(
    name: str, tmp_path: Path
) -> None:
    scale = PUBLISHED_SCALES[name].scale
    spelled_out = (
        f"[scale]\nname = {json.dumps(scale.name)}\n"
        f"grades = {json.dumps(list(scale.grades))}\n"
    )
    named = with_scale(tmp_path, top=f'scale = "{name}"\n')
    other = with_scale(tmp_path, table=spelled_out)
    assert presented_content(named) == presented_content(other)
    assert scale_of(named) == scale
    if not PUBLISHED_SCALES[name].angles:
        assert protocol_hash(named) == protocol_hash(other)


def test_anchors_are_words_that_make_no_schedule_stale(tmp_path: Path) -> None:
    plain, with_words = (
        with_scale(tmp_path, table=TABLE + anchors)
        for anchors in ("", 'anchors = {"1" = "a catch"}\n')
    )
    assert presented_content(plain) == presented_content(with_words)
    assert protocol_hash(plain) != protocol_hash(with_words)


def test_the_angles_of_a_scale_are_asked_after_each_presentation(
    tmp_path: Path,
) -> None:
    (angles,) = with_scale(tmp_path, top='scale = "tardieu"\n').questionnaires
    assert (angles.id, angles.when) == ("tardieu", "presentation")
    asked = [(q.id, q.type, q.low, q.high, q.required) for q in angles.questions]
    assert asked == [("R1", "whole", 0, 180, False), ("R2", "whole", 0, 180, False)]
    own = (
        '[[questionnaires]]\nid = "tardieu"\ntitle = "X"\nwhen = "presentation"\n'
        '[[questionnaires.questions]]\nid = "X"\ntext = "X, deg"\n'
        'type = "visual-analogue"\n\n'
    )
    protocol = with_scale(tmp_path, top='scale = "tardieu"\n', table=own)
    assert [q.title for q in protocol.questionnaires] == ["X"]


@pytest.mark.parametrize(
    ("top", "table", "problem"),
    [
        (
            'scale = "modified-ashwort"\n',
            "",
            'scale: needed a table [scale] or one of "modified-ashworth", "ashworth", '
            '"tardieu", "modified-tardieu", "updrs-rigidity", got "modified-ashwort"; '
            "did you mean modified-ashworth?",
        ),
        ("scale = 4\n", "", "scale: needed a table, got 4"),
        ("", "", "scale: needed a table [scale], got none"),
        (
            "",
            '[training]\nscale = "ashworth"\n',
            "training.scale: needed above the first table of the file, got it in "
            "[training]",
        ),
        (
            "",
            TABLE + 'anchors = {"1" = "a catch", "5" = "rigid"}\n',
            'scale.anchors: needed grades of the scale (0, 1, 1+, 2, 3, 4), got "5"',
        ),
    ],
)
def test_what_is_no_scale_is_refused_in_one_sentence(
    top: str, table: str, problem: str, tmp_path: Path
) -> None:
    with pytest.raises(ProtocolError) as caught:
        with_scale(tmp_path, top=top, table=table)
    assert caught.value.problems == (f"{tmp_path / 'protocol.toml'}: {problem}",)


def test_every_grade_has_a_meaning_or_none_has() -> None:
    for published in PUBLISHED_SCALES.values():
        known = set(published.scale.grades) if published.meanings else set()
        assert set(published.meanings) == known


def test_a_part_of_a_scale_is_recognized_and_a_longer_one_is_not() -> None:
    part = published_scale(Scale(name="MAS", grades=("1", "1+", "2", "3")))
    assert part is PUBLISHED_SCALES["modified-ashworth"]
    assert published_scale(Scale(name="MAS", grades=("1", "5"))) is None
