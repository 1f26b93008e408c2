"""Build reports in children of one process that has everything loaded.

Lines of JSON in, each a list of argument lists and seconds or null: all are begun at
once, and killed after so long. A line of JSON out: how each ended.
"""

import json
import os
import signal
import sys
import time

import masrel.cli


def build(arguments: list[str]) -> int:
    """Build a report in this process; the code it ends with."""
    sys.argv = ["masrel", "report", *arguments, "--quiet"]
    try:
        masrel.cli.main()
    except SystemExit as ended:
        return int(ended.code or 0)
    return 99


def begin(arguments: list[str]) -> int:
    """Build a report in a child, and return its id."""
    child = os.fork()
    if child == 0:
        os._exit(build(arguments))
    return child


def main() -> None:
    """Do what is asked until there is nothing more."""
    answers = os.fdopen(os.dup(1), "w")
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    build([sys.argv[1], "--check"])  # which loads everything
    for line in sys.stdin:
        calls, after_s = json.loads(line)
        children = [begin(arguments) for arguments in calls]
        if after_s is not None:
            time.sleep(after_s)
            for child in children:
                os.kill(child, signal.SIGKILL)
        ends = [os.waitstatus_to_exitcode(os.waitpid(c, 0)[1]) for c in children]
        print(json.dumps(ends), file=answers, flush=True)


if __name__ == "__main__":
    main()
