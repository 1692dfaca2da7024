# The target stm32 needs programs from outside: a cross compiler and an emulator. Without
# them its tests are left out, with the way to get them; with REQUIRE_STM32=1 they fail.

import os

import pytest

from host_tools import stm32_image, stm32_tools
from host_tools.stm32_tools import ImageError

HEAP_BYTES = 27648


def without(sentence):
    if os.environ.get("REQUIRE_STM32") == "1":
        pytest.fail(sentence)
    pytest.skip(sentence)


@pytest.fixture(scope="session")
def stm32_tools_here():
    try:
        stm32_tools.need(stm32_tools.TO_BUILD + stm32_tools.TO_RUN)
    except ImageError as error:
        without(str(error))


@pytest.fixture(scope="session")
def stm32_elf(stm32_tools_here):
    """The image with a heap of 27 KiB, from the cache where it can be; the first build takes a minute."""
    try:
        return stm32_image.image(HEAP_BYTES)
    except ImageError as error:
        if error.code == 3 and not any((stm32_image.cache_folder()).glob("micropython-debian-*")):
            without("%s %s" % (error, " ".join(error.lines)))  # no network, and no source yet
        raise
