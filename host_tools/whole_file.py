"""A result's file, written whole or left as it was."""

import contextlib
import errno
import json
import os
import shutil

FULL = (errno.ENOSPC, errno.EDQUOT)


def write_result(path, result):
    with whole_file(path) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write(json.dumps(result, indent=2, allow_nan=False) + "\n")


@contextlib.contextmanager
def whole_file(path):
    """A name to write to, which becomes `path` once all is written: a full disk leaves the old file or none, never half of one.

    It is `path` itself where nothing can be put in its place: a pipe, a folder that lets nobody in.
    """
    path, beside = os.fspath(path), None
    try:
        beside = _beside(path)
        yield beside or path
        if beside:
            _put(beside, os.path.realpath(path))
    except OSError as error:
        error.filename = path  # a full disk names no file
        raise
    finally:
        if beside:
            with contextlib.suppress(OSError):
                os.unlink(beside)


def _beside(path):
    real = os.path.realpath(path)
    if os.path.exists(path) and not os.path.isfile(real):
        return None  # a pipe, which has no name of its own, or /dev/full
    folder, name = os.path.split(real)
    beside = os.path.join(folder, ".%d-%s" % (os.getpid(), name))
    try:
        with open(beside, "wb"):
            return beside
    except OSError as error:
        if error.errno in FULL:
            raise
        return None  # a name that is too long, a folder of others'


def _put(beside, path):
    try:
        os.replace(beside, path)
    except OSError as error:
        if error.errno in FULL:
            raise
        shutil.copyfile(beside, path)  # a mount point, which cannot be replaced
