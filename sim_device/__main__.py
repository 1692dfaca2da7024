# `python -m sim_device HOME --link PATH`

import sys

from sim_device.cli import main

sys.exit(main())
