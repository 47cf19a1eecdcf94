"""Parts of numpy are imported when they are used."""

import subprocess
import sys

PROGRAM = """
import sys
from kata.system.lazy_modules import delay_unused_numpy
delay_unused_numpy()
import numpy as np, scipy.interpolate, scipy.optimize
print("unittest" in sys.modules, "charset_normalizer" in sys.modules)
print(np.polynomial.Polynomial([1.0, 2.0])(3.0), np.ma.masked_equal([1, 2], 2).sum())
np.testing.assert_allclose(1.0, 1.0)
delay_unused_numpy()
print("unittest" in sys.modules, np.polynomial.__name__)
"""


def test_part_is_imported_only_when_it_is_used() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.splitlines() == ["False False", "7.0 1", "True numpy.polynomial"]
