"""The command line as ``python -m exugear``, where the command itself is not on the path."""

from exugear.cli.app import main

if __name__ == "__main__":
    main()
