"""``python -m kata.simulator``: the simulated apparatus, started by the service, the demonstration or a test."""

import sys

from kata.simulator.process import main

sys.exit(main())
