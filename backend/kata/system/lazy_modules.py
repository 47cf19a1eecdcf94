"""Delays the import of parts of numpy until they are used.

scipy copies every name of numpy when it is imported. That imports numpy's tools for tests and Fortran, and through them unittest, email and
charset_normalizer: 8 MB in each process that calculates with scipy, and a tenth of a second of processor time.
"""

import importlib.util
import sys
from typing import Final

_UNUSED_BY_SCIPY: Final = ("f2py", "testing", "ctypeslib", "polynomial", "ma")


def delay_unused_numpy() -> None:
    """Let numpy import these parts when one of their names is used. Call this before the first import of scipy.

    Do not use it in a process in which two threads may use such a part for the first time.
    """
    import numpy as np

    for part in _UNUSED_BY_SCIPY:
        name = f"numpy.{part}"
        spec = None if name in sys.modules else importlib.util.find_spec(name)
        if spec is None or spec.loader is None:
            continue
        spec.loader = importlib.util.LazyLoader(spec.loader)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        setattr(np, part, module)
