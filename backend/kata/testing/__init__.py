"""Provides tests and simulated drives for authors of driver packages (docs/how-to/write-a-driver.md). They need pytest."""

import pytest

# Let failed assertions show their values, as in a test file.
pytest.register_assert_rewrite("kata.testing.conformance")
