"""Logs of conduct that came with merged studies, held against what was recorded."""

from collections.abc import Iterator
from pathlib import Path

from masrel.lab._event_log import line_hashes
from masrel.lab.conduct._study_log import read_conduct
from masrel.lab.protocol import StudyPaths


def merged_log_problems(study: StudyPaths) -> Iterator[tuple[Path, str]]:
    """Yield what is wrong with the logs in ``conduct/``, each with its file."""
    named = set()
    for event in read_conduct(study):
        if event.kind != "merged" or event.fields["log"] is None:
            continue
        log = study.root / str(event.fields["log"])
        named.add(log)
        if not log.is_file():
            yield log, "needed the log of a merged study, got no file"
            continue
        hashes = line_hashes(log)
        sha256 = hashes[-1] if hashes else None
        if (len(hashes), sha256) != (event.fields["n_lines"], event.fields["sha256"]):
            yield (
                log,
                f"needed {event.fields['n_lines']} lines, the last with SHA-256 "
                f"{event.fields['sha256']}, as they were merged, got {len(hashes)} and "
                f"{sha256}",
            )
    for log in sorted(study.merged_conduct.glob("*")):
        if log not in named:
            yield log, "is in conduct/, and no merged study has it"
