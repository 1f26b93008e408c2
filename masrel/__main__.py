"""``python -m masrel`` is ``masrel``."""

from masrel.cli import main

if __name__ == "__main__":
    main()
