"""The ``kata`` command, and ``python -m kata``.

A spawned worker process imports its parent's main module again. So this module imports nothing at its top: importing the whole command
line takes seconds.
"""


def main() -> None:
    """Run the command. Invalid settings end every command with one sentence each and status 2."""
    import os

    from kata.system import scheduling
    from kata.system.gc_freeze import frozen_imports
    from kata.system.private_files import UMASK

    # For every file of this process and its children.
    os.umask(UMASK)
    # Before any thread starts. All commands do so: a benchmark or an evaluation beside the service must not delay an apparatus.
    scheduling.set_time_slice(scheduling.LONG_NS)
    with frozen_imports():
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
