"""Copies of a study for its sites, and whether studies have one secret."""

from pathlib import Path

from masrel._files import make_folder, write_files
from masrel._input import MAX_SMALL, read_regular
from masrel.errors import ScheduleError
from masrel.protocol import Protocol, StudyPaths
from masrel.protocol.study import _check_new_folder
from masrel.schedule._secret import find_secret, new_secret, site_secret_text
from masrel.schedule._sites import checked_site
from masrel.schedule.sheets import read_schedule


def copy_for_site(
    protocol: Protocol, study: StudyPaths, site: str, destination: Path
) -> None:
    """Copy a study for one of its sites, whose secret alone the copy has.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol, whose sites are strata.
    study : StudyPaths
        Where the study is; its secret is drawn if there is none yet.
    site : str
        Whose copy.
    destination : Path
        A new or empty folder: it gets the protocol with its model files, and the
        secret of the site with the study's commitment. Neither schedules nor logs.

    Raises
    ------
    ScheduleError
        If there is no such site, the study has another site's secret alone, or a
        model file is not in the study.
    ParameterError
        If `destination` is a file or holds anything.
    OSError
        If the system refuses a folder or file.
    """
    checked_site(protocol, site)
    copy = StudyPaths(destination)
    files = [model.file for model in protocol.models if model.file is not None]
    for file in files:
        if not (study.root / file).resolve().is_relative_to(study.root.resolve()):
            raise ScheduleError(
                f"{study.protocol}: needed model files inside the study to copy it, "
                f"got {file}"
            )
    contents = {
        destination / file: read_regular(study.root / file, most=MAX_SMALL)
        for file in (*dict.fromkeys(files), study.protocol.name)
    }
    key = find_secret(study) or new_secret(study)
    secret = {copy.secret_file: site_secret_text(key, site).encode()}
    _check_new_folder(destination, secret | contents)
    make_folder(copy.secret_file.parent, mode=0o700)
    write_files(secret, within=destination, mode=0o600)
    write_files(contents, within=destination)


def check_commitments(*studies: StudyPaths) -> None:
    """Refuse studies whose schedules were not drawn from one secret.

    Parameters
    ----------
    *studies : StudyPaths
        Where they are. Sites of one study have one commitment, whatever secret each
        of them has.

    Raises
    ------
    ScheduleError
        If two schedules, or a schedule and a secret, have different commitments, or
        one was drawn without a secret and another with one; the message names both
        files. Or if one of them is damaged.
    """
    first: tuple[Path, str | None] | None = None
    for study in studies:
        commitments = {
            path: read_schedule(path).commitment
            for path in sorted(study.schedules.glob("*.csv"))
            if not path.stem.endswith("_sheet")
        }
        key = find_secret(study)
        if key is not None and None not in commitments.values():
            commitments[study.secret_file] = key.commitment
        for path, commitment in commitments.items():
            if first is None:
                first = (path, commitment)
            elif commitment != first[1]:
                raise ScheduleError(
                    f"{path}: needed commitment {first[1] or 'none'}, as {first[0]} "
                    f"has it, got {commitment or 'none'}"
                )
