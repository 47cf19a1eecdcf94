"""The ``kata`` command."""
