"""The command line, as `python -m tachometry`."""

from tachometry.cli.main import main

if __name__ == "__main__":
    main()
