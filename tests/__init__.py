"""Tests of masrel.

One thread a process: tests run in as many processes as there are cores, and threads of
BLAS that wait for each other would cost several times what the small matrices do. The
last bits of a sum also follow the number of threads.
"""

import os

for library in ("OPENBLAS", "MKL", "OMP"):  # before numpy is loaded
    os.environ[f"{library}_NUM_THREADS"] = "1"
