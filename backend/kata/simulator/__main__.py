"""``python -m kata.simulator``: starts the simulated apparatus. The service, the demonstration or a test runs this."""

import sys

from kata.simulator.process import main

sys.exit(main())
