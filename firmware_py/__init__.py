# The core. `_NAME = const(value)` is MicroPython's: its compiler puts the value where the name stands and
# keeps no name, without an import. Elsewhere const() is this.

import sys

if sys.implementation.name != "micropython":
    import builtins

    builtins.const = int
