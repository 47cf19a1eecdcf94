"""The ``kata`` command, and ``python -m kata``.

A worker process that is spawned reads its parent's main module once more, so this one has nothing in it: all of the command line
is seconds of imports.
"""


def main() -> None:
    """Entry of both."""
    from kata.cli import app

    app()


if __name__ == "__main__":
    main()
