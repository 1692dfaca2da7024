"""Folders that are made once and kept in the user's cache: where that is, and which stay."""

import contextlib
import os
import shutil
from pathlib import Path


def cache_folder():
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (named if named.is_absolute() else Path.home() / ".cache") / "tvslam"  # the XDG specification: a relative one is ignored


def asked_for(folder):
    """It was wanted just now: prune() leaves it."""
    with contextlib.suppress(OSError):  # a cache that others made may be read-only
        os.utime(folder)


def prune(cache, pattern, kept):
    """Leaves, of the folders of this pattern, so many that were asked for last."""
    folders = sorted(cache.glob(pattern), key=_asked_for_at)
    for old in folders[:-kept]:
        shutil.rmtree(old, ignore_errors=True)


def _asked_for_at(folder):
    with contextlib.suppress(OSError):  # another run was faster
        return folder.stat().st_mtime
    return 0
