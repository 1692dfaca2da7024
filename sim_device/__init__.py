# The virtual robot: a home as its world, a body that drives and bumps, sensors
# that err as real ones do. It imports protocol only.
