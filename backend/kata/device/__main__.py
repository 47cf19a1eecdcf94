"""``python -m kata.device``: the device process, started by the service."""

import sys

from kata.device.process import main

sys.exit(main())
