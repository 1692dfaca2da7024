# What is fuzzed: whatever takes bytes that somebody else made. A target takes any bytes and must survive them; it raises
# where a promise is broken. Its seeds are made by the code, so that the fuzzer begins behind the first checks.
#
#   run, seeds = TARGETS["frames"]
#   run(b"...")                 for one input;  seeds() -> a list of inputs

from tests.fuzz.frame_targets import can, can_seeds, frame_seeds, frames, slcan, slcan_seeds
from tests.fuzz.schema_target import schema, schema_seeds
from tests.fuzz.file_targets import fault_seeds, faults, home, home_seeds, log, log_seeds

TARGETS = {
    "frames": (frames, frame_seeds),    # the host's link and the core's, their reader, codec and messages
    "can": (can, can_seeds),            # CAN frames joined to frames
    "slcan": (slcan, slcan_seeds),      # the text of a CAN adapter, on the core and on the bus between processes
    "home": (home, home_seeds),         # the loader of home files
    "log": (log, log_seeds),            # the reader of logs, and what replays and scores them
    "schema": (schema, schema_seeds),   # what a core tells of its messages
    "faults": (faults, fault_seeds),    # the text of --faults
}
