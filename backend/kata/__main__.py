"""The ``kata`` command, and ``python -m kata``.

A worker process that is spawned reads its parent's main module once more, so this one has nothing in it: all of the command line
is seconds of imports.
"""


def main() -> None:
    """Entry of both. Settings that cannot be used end every command alike: a sentence for each, status 2."""
    from kata.system import scheduling
    from kata.system.gc_freeze import staying

    # Before anything has threads of its own. Not the service's alone: also a benchmark or an evaluation beside it is not to
    # make an apparatus late.
    scheduling.ask_for(scheduling.LONG_NS)
    with staying():
        from pydantic import ValidationError

        from kata.cli.main import app
        from kata.settings import Settings, complaint
        from kata.system import realtime
        from kata.system.console import fail

    realtime.refuse_huge_pages()
    try:
        app()
    except ValidationError as error:
        if error.title != Settings.__name__:
            raise
        fail(complaint(error), status=2)


if __name__ == "__main__":
    main()
