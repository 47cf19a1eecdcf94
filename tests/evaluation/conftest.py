"""A short motion for all tests of the evaluation."""

import numpy as np
import pytest

from kata.motion.taught import Taught


@pytest.fixture(scope="session")
def short() -> Taught:
    """Return a motion of every axis, there and back in three seconds."""
    times = np.linspace(0.0, 3.0, 301)
    rest = np.array([0.0, 0.0, 10.0, 5.0, 0.0])
    reach = np.array([6.0, -5.0, 25.0, 30.0, -20.0])
    return Taught("short", times, rest + reach * ((1 - np.cos(2 * np.pi * times / 3.0)) / 2)[:, None])
