"""Every deliberate fault can be put in, and has tests."""

from collections import Counter

from tests.mutants import faults


def test_every_fault_fits_the_package():
    listed = faults()
    misfits = [f"{fault.name}: {why}" for fault in listed if (why := fault.misfit())]
    twice = [name for name, n in Counter(f.name for f in listed).items() if n > 1]
    assert (misfits, twice) == ([], [])
