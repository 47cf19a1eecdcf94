"""The drivers. Conformance is no test module by its name, and is to tell what failed like one."""

import pytest

pytest.register_assert_rewrite("tests.device.bus.conformance")
