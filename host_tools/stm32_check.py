"""What an image holds: its size against the part, its hash, the modules that are frozen in it and what each costs."""

import hashlib
import re

from host_tools import stm32_tools
from host_tools.stm32_build import FLASH_BYTES, RAM_BYTES, STACK_BYTES, too_large
from host_tools.stm32_core import LINKED
from host_tools.stm32_tools import ImageError

FROZEN_NAMES = re.compile(r"mp_frozen_names\[\] = \{(.*?)\};", re.S)
# mpy-tool names the data of a module KIND_MODULE_FUNCTION, both with _ for what is no letter.
KINDS = re.compile(r"^(?:fun_data|children|const_qstr_table_data|const_obj_table_data|const_obj|raw_code|proto_fun|frozen_module|"
                   r"rom_names|rom_make|rom)_(.*)$")


def examine(elf, frozen_content, core, heap_bytes):
    """-> the figures as a dict that JSON takes. Raises ImageError when the image is not what was asked for."""
    text, data, bss = sections(stm32_tools.output(["arm-none-eabi-size", str(elf)]))
    if LINKED not in frozen_modules(frozen_content.read_text(encoding="utf-8")):
        raise ImageError("The image lacks the core: make froze no %s." % LINKED, code=3)
    static = data + bss
    if static + STACK_BYTES > RAM_BYTES:
        raise ImageError(too_large(heap_bytes, RAM_BYTES - STACK_BYTES - (static - heap_bytes)))
    if text + data > FLASH_BYTES:
        raise ImageError("The image takes %d bytes, the part has %d of flash." % (text + data, FLASH_BYTES), code=3)
    symbols = stm32_tools.output(["arm-none-eabi-nm", "-S", str(elf)])
    return {"text_bytes": text, "data_bytes": data, "bss_bytes": bss, "flash_bytes": text + data, "flash_of_bytes": FLASH_BYTES,
            "ram_static_bytes": static - heap_bytes, "ram_heap_bytes": heap_bytes, "ram_left_for_stack_bytes": RAM_BYTES - static,
            "ram_of_bytes": RAM_BYTES, "sha256": hashlib.sha256(elf.read_bytes()).hexdigest(),
            "stack_bottom": address(symbols, "_ebss"), "stack_top": address(symbols, "_estack"), "modules": module_bytes(core, symbols)}


def sections(said):
    """(text, data, bss) out of what `size` prints."""
    match = re.search(r"^\s*(\d+)\s+(\d+)\s+(\d+)\s+\d+", said, re.M)
    if not match:
        raise ImageError("arm-none-eabi-size does not know the image that was built: is it whole?", code=3)
    return tuple(int(n) for n in match.groups())


def address(symbols, name):
    match = re.search(r"^([0-9a-f]+) (?:[0-9a-f]+ )?\w %s$" % name, symbols, re.M)
    if not match:
        raise ImageError("The image has no symbol %s: is its linker script another than MicroPython's?" % name, code=3)
    return int(match[1], 16)


def frozen_modules(content):
    """The names in frozen_content.c, like protocol/codec.py, in its order."""
    match = FROZEN_NAMES.search(content)
    return re.findall(r'"([^"\\]+)\\0"', match[1]) if match else []


def module_bytes(core, symbols):
    """{file: bytes of flash}, out of what `nm -S` prints; what the files share stands under the linked module's own name."""
    top = LINKED.removesuffix(".py")
    stems = sorted(((top + "_" + name, path) for name, path in core.owners.items()), key=lambda stem: -len(stem[0]))
    bytes_of = dict.fromkeys([*sorted(core.modules), LINKED], 0)
    for line in symbols.splitlines():
        words = line.split()
        found = KINDS.match(words[3]) if len(words) == 4 else None
        if found and (found[1] == top or found[1].startswith(top + "_")):
            path = next((path for stem, path in stems if found[1] == stem or found[1].startswith(stem + "_")), LINKED)
            bytes_of[path] += int(words[1], 16)
    return bytes_of
