"""The ``kata`` command, and ``python -m kata``.

A spawned worker process imports the main module of its parent again. This module therefore imports nothing at its top, because importing
the whole command line takes seconds.
"""


def main() -> None:
    """Run the command. Invalid settings end every command with one sentence for each and status 2."""
    import os

    from kata.system import scheduling
    from kata.system.gc_freeze import permanent_objects
    from kata.system.private_files import UMASK

    # This applies to every file of this process and its children.
    os.umask(UMASK)
    # OpenBLAS's threads spin while they wait for each other. On two busy cores that makes a fit ten times slower, and it delays an apparatus.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Set this before any thread starts. All commands do so, because a benchmark or an evaluation beside the service must not delay an
    # apparatus.
    scheduling.set_time_slice(scheduling.LONG_NS)
    with permanent_objects():
        from pydantic import ValidationError

        from kata.cli.main import app
        from kata.settings import Settings, describe_errors
        from kata.system import realtime
        from kata.system.console import fail

    realtime.refuse_huge_pages()
    try:
        app()
    except ValidationError as error:
        if error.title != Settings.__name__:
            raise
        fail(describe_errors(error), status=2)


if __name__ == "__main__":
    main()
