"""The command `undertow` as `python -m undertow`, where its script is not on the path."""

from undertow.cli.main import main

if __name__ == "__main__":
    main()
