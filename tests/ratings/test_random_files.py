"""Files of random tables give the table's own numbers, or say why they may not."""

import json
import math
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from masrel.agreement import fleiss_kappa, percent_agreement
from masrel.errors import UndefinedStatisticWarning
from tests.cli.process import Caller
from tests.ratings.random_tables import Table, WrittenTable, written_tables

QUICK = settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
ALL = settings(QUICK, max_examples=1000)


def true_values(table: Table) -> dict[str, float | None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        estimates = (percent_agreement(table), fleiss_kappa(table))
    return {
        estimate.coefficient: None if math.isnan(estimate.value) else estimate.value
        for estimate in estimates
    }


def check(written: WrittenTable, folder: Path, masrel: Caller) -> None:
    file = folder / f"ratings{written.ending}"
    file.write_bytes(written.data)
    expected = true_values(written.table)
    for options in (written.options, ()):
        done = masrel("agree", file, *options, "--json", "-")
        assert done.code in (0, 2), done
        if done.code == 2:
            assert not done.out
            assert len(done.err.splitlines()) == 1, done
            assert not options, done  # with all that says what it is, it is read
            continue
        estimates = json.loads(done.out)["estimates"]
        values = {e["coefficient"]: e["value"] for e in estimates}
        if options or not (written.needs_options or "warning:" in done.err):
            assert values == pytest.approx(expected, abs=1e-14), done


@given(written=written_tables())
@QUICK
def test_some_files(written: WrittenTable, tmp_path: Path, masrel: Caller) -> None:
    check(written, tmp_path, masrel)


@pytest.mark.long
@given(written=written_tables())
@ALL
def test_a_thousand_files(
    written: WrittenTable, tmp_path: Path, masrel: Caller
) -> None:
    check(written, tmp_path, masrel)
