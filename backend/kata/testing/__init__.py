"""Tests and simulated drives for the authors of driver packages (docs/how-to/write-a-driver.md). They need pytest."""

import pytest

# Failed assertions show their values, as those of a test file do.
pytest.register_assert_rewrite("kata.testing.conformance")
