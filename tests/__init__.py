"""Settings that apply before any module of the tests is imported."""

import os

import pytest

# As `kata` itself sets it. pytest's workers and every process of a test inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# The shared helpers assert too: pytest shows the values of what failed there.
pytest.register_assert_rewrite("tests.support")
