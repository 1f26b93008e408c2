"""Printed sheets: what stands on them, what does not, and where they are cut."""

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.errors import ScheduleError
from masrel.lab.paper._printing import write_sheets
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.schedule.sheets import write_schedules
from tests.lab.paper.conftest import QUESTIONS
from tests.lab.report.test_in_chromium import CHROMIUM, WORDS, printed

Small = tuple[StudyPaths, Protocol]
New = Callable[..., Small]

MODELS = ("HM1", "HM3", "D1")


def codes(study: StudyPaths, rater: str = "R1", session: str = "test") -> list[str]:
    schedule = read_schedule(study.schedule_file(rater, session))
    return [shown.code for shown in schedule.presentations]


def test_every_sheet_has_its_codes_and_no_file_names_a_model(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))
    made = write_sheets(study, protocol)
    page = made.html.read_text(encoding="utf-8")
    sheets = page.split('<section class="sheet">')[1:]
    places = [("R1", "test"), ("R2", "test"), ("R1", "retest")]
    for sheet, place in zip(sheets, places, strict=True):
        shown = re.findall(r'<td class="code">(\w+)</td>', sheet)
        assert shown == codes(study, *place)
    typed = [path.read_text(encoding="utf-8") for path in made.typed]
    for text in (page, *typed):
        assert not any(model in text for model in MODELS)


def test_the_page_asks_nothing_of_the_network_and_runs_nothing(new_study: New) -> None:
    study, protocol = new_study(('"Three models"', '"<script>1</script> & more"'))
    first = write_sheets(study, protocol).html.read_text(encoding="utf-8")
    assert "default-src 'none'" in first
    assert not re.search(r"https?:|src=|href=|url\(|@import|<script", first)
    assert "&lt;script&gt;1&lt;/script&gt; &amp; more" in first
    # the same sheets are the same bytes, and sheets differ
    assert write_sheets(study, protocol).html.read_text(encoding="utf-8") == first
    ids = re.findall(r"<span>Sheet</span><strong>([^<]+)<", first)
    assert len(ids) == len(set(ids)) == 3


def test_a_sheet_is_typed_into_a_file_with_a_column_a_question(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))
    write_sheets(study, protocol, raters=["R1"], sessions=["test"])
    text = study.typed_file("R1", "test").read_text(encoding="utf-8")
    _, head, *rows, last = text.splitlines()
    assert head == "sheet,position,code,grade,arm.realism,end.tired,end.words"
    (sheet,) = {row.split(",")[0] for row in (*rows, last)}
    assert re.fullmatch(r"S[0-9A-F]{4}-[0-9A-F]{4}", sheet)
    assert rows == [
        f"{sheet},{place},{code},,,,"
        for place, code in enumerate(codes(study), start=1)
    ]
    assert last == f"{sheet},session,,,,,"
    assert not study.typed_file("R2", "test").exists()


def test_what_has_been_typed_stays_and_a_blank_file_is_made_anew(
    small: Small,
) -> None:
    study, protocol = small
    write_sheets(study, protocol)
    filled, blank = study.typed_file("R1", "test"), study.typed_file("R2", "test")
    filled.write_text("position,code,grade\n1,77X,2\n", encoding="utf-8")
    blank.write_text("sheet;position;code;grade\r\nS0;1;77X;\r\n;;;\r\n", "utf-8")
    made = write_sheets(study, protocol)
    assert made.unchanged == (filled,)
    assert "77X,2" in filled.read_text(encoding="utf-8")
    assert codes(study, "R2")[0] in blank.read_text(encoding="utf-8")


def test_a_schedule_whose_sheet_was_printed_is_not_drawn_anew(small: Small) -> None:
    study, protocol = small
    write_sheets(study, protocol, raters=["R1"], sessions=["test"])
    text = study.protocol.read_text("utf-8").replace("= 0.60", "= 0.55")
    study.protocol.write_text(text, encoding="utf-8")
    changed = read_protocol(study.protocol)
    with pytest.raises(ScheduleError) as caught:
        write_schedules(changed, study, redraw=True)
    assert "because its sheet was printed" in str(caught.value)
    assert f"Move {study.typed_file('R1', 'test')} out of the study" in str(
        caught.value
    )


def test_all_that_a_rater_must_know_is_printed(new_study: New) -> None:
    rules = (
        '[occasions]\ninstructions = """Sit.\n\nMove the arm."""\nbreak_after = 2\n'
        'break_minutes = 7.5\npractice = ["HM3", "D1"]\n\n[presentation]\n'
        'stretches = ["slow", "fast"]\n\n[schedule]'
    )
    study, protocol = new_study(("[schedule]", rules))
    made = write_sheets(study, protocol, raters=["R1"], sessions=["test"])
    page = made.html.read_text(encoding="utf-8")
    for words in (
        "<p>Sit.</p><p>Move the arm.</p>",
        "Modified Ashworth Scale",
        "masrel’s own words",
        "<dt>1+</dt><dd>tone slightly up",
        "Stretch 1: slow, at most 10 deg/s (V1). Stretch 2: fast",
    ):
        assert words in page
    assert page.count("Break of 7.5 min") == 1  # none after the last
    assert not [words for words in ("HM3", "then press Enter") if words in page]
    # practice comes first, no rating comes of it, and none is typed
    places = [page.index(code) for code in (">P1<", ">P2<", f">{codes(study)[0]}<")]
    assert places == sorted(places)
    assert page.count('class="box none"') == 2 + 3
    (typed,) = made.typed
    assert "P1" not in typed.read_text(encoding="utf-8")


def test_the_words_of_a_study_stand_in_the_place_of_masrels(new_study: New) -> None:
    anchors = 'name = "MAS"\nanchors = {"1+" = "a catch & more"}'
    page = write_sheets(*new_study(('name = "MAS"', anchors))).html.read_text("utf-8")
    assert "<dl><div><dt>1+</dt><dd>a catch &amp; more</dd></div></dl>" in page
    assert "words of masrel" not in page


def test_sheets_are_of_the_schedules_that_are_drawn(new_study: New) -> None:
    study, protocol = new_study(
        ('[[raters]]\nid = "R2"', '[[raters]]\nid = "R2"\nsite = "north"')
    )
    made = write_sheets(study, protocol, sites=["north"])
    assert made.typed == (study.typed_file("R2", "test"),)
    study.schedule_file("R2", "test").unlink()
    assert len(write_sheets(study, protocol).typed) == 2
    with pytest.raises(ScheduleError, match="needed a schedule file"):
        write_sheets(study, protocol, raters=["R2"])


TALL = """
[[questionnaires]]
id = "{0}"
title = "{0}"
when = "presentation"

[[questionnaires.questions]]
id = "{0}"
text = "On a line of its own?"
type = "visual-analogue"
high_label = "ends-here"

"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to print with")
@pytest.mark.skipif(WORDS is None, reason="there is no pdftotext to read a PDF with")
@pytest.mark.parametrize("repeats", [1, 13])
def test_in_chromiums_pdf_no_row_is_split_and_no_code_is_missing(
    repeats: int, new_study: New, tmp_path: Path
) -> None:
    tall = "".join(TALL.format(name) for name in "abcd") if repeats > 1 else ""
    study, _ = new_study(("[schedule]", f"{tall}[schedule]\nrepeats = {repeats}"))
    protocol = read_protocol(study.protocol)
    made = write_sheets(study, protocol)
    sheets = printed(made.html, tmp_path)
    for word in (word for sheet in sheets for word in sheet):
        # nothing reaches into the margin of A4, pt
        assert 28 < word.left < word.right < 595 - 28, word
        assert 28 < word.top < word.bottom < 842 - 28, word
    pages = [[word.text for word in sheet] for sheet in sheets]
    if repeats == 1:  # a page a session
        assert len(pages) == 3
    else:
        assert len(pages) > 6
    places = (("R1", "test"), ("R2", "test"), ("R1", "retest"))
    expected = Counter(code for place in places for code in codes(study, *place))
    words = Counter(word for page in pages for word in page)
    assert {code: words[code] for code in expected} == expected
    for page in pages:  # a row begins with its code, and ends with its question
        n_rows = sum(word in expected for word in page)
        assert page.count("NA") == n_rows
        assert page.count("ends-here") == (4 * n_rows if repeats > 1 else 0)
