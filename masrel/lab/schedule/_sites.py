"""The sites of a study, where they are strata, and copies of a study for its sites."""

from pathlib import Path

from masrel._files import make_folder, write_files
from masrel.errors import ScheduleError
from masrel.lab._bounded_files import MAX_SMALL, read_regular
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol.study import _check_new_folder
from masrel.lab.schedule._secret import find_secret, new_secret, site_secret_text


def site_of(protocol: Protocol, rater: str) -> str | None:
    """Return the site of a rater where sites are strata; else None."""
    if protocol.schedule.strata == "none":
        return None
    return {each.id: each.site for each in protocol.raters}[rater]


def checked_site(protocol: Protocol, site: str | None) -> str | None:
    """Return a site that the protocol has, and by which it draws; refuse any other."""
    if site is None:
        return None
    if protocol.schedule.strata != "site":
        raise ScheduleError(
            'site: needed schedule.strata = "site" in the protocol, got '
            f'"{protocol.schedule.strata}"'
        )
    sites = dict.fromkeys(rater.site for rater in protocol.raters if rater.site)
    if site not in sites:
        raise ScheduleError(f"site: needed one of {', '.join(sites)}, got {site!r}")
    return site


def site_of_copy(study: StudyPaths) -> str | None:
    """Return the site that a study is the copy of.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    str or None
        The site whose secret alone the study has; None of a whole study.

    Raises
    ------
    ScheduleError
        If the file of the secret is damaged.
    """
    key = find_secret(study)
    return None if key is None else key.site


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
    write_files(secret | contents, within=destination, mode=0o600)
