"""Settings of property tests: the same examples in every run, no time limit.

One thread a process: tests run in as many processes as there are cores, and threads of
BLAS that wait for each other would cost several times what the small matrices do.
"""

import os

for library in ("OPENBLAS", "MKL", "OMP"):  # before numpy is loaded
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from hypothesis import settings  # noqa: E402

# derandomize: a failure repeats; 50 examples a property; a slow machine is no failure.
settings.register_profile("masrel", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("masrel")
