# The core's modules with every number checked against 2**30, for the tests of its parts:
#   odometry = watched("firmware_py.collection.odometry")

from tests.house.integer_guard import guarded_core


def watched(*names):
    with guarded_core() as core:
        modules = [core(name) for name in names]
    return modules[0] if len(modules) == 1 else modules
