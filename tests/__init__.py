"""The shared helpers assert too: pytest shows the values of what failed there."""

import pytest

pytest.register_assert_rewrite("tests.support")
