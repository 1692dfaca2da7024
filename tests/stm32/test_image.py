# `host_tools flash --target stm32`: what it refuses, what its cache goes by, and the image itself.

import ast
import json
import shutil
import subprocess
import threading
import time

import pytest

from host_tools import stm32_build, stm32_check, stm32_core, stm32_image, stm32_source
from host_tools.cli import main
from host_tools.linker import Linked
from host_tools.stm32_tools import ImageError
from tests.house.tree import PROJECT, core_files, name_of

KIB = 1024
BUILDS = pytest.mark.timeout(600)


def flash(capsys, *words):
    """-> (exit code, stdout, stderr)"""
    try:
        code = main(["flash", *words])
    except SystemExit as stop:
        code = stop.code
    said = capsys.readouterr()
    return code, said.out, said.err


# --- arguments and tools ---

@pytest.mark.parametrize("words, cause", [
    ((), "--target"),
    (("--target", "stm33"), "stm33"),
    (("--target", "stm32", "--heap", "lots"), "lots"),
    (("--target", "stm32", "--heap", "200k"), "128 KB"),
    (("--target", "stm32", "--heap", "0"), "0"),
])
def test_a_bad_argument_is_one_sentence(capsys, words, cause):
    code, _, err = flash(capsys, *words)
    assert code == 2 and cause in err and err.count("\n") == 1, err


@pytest.mark.parametrize("gone, package", [("make", "make"), ("arm-none-eabi-gcc", "gcc-arm-none-eabi"), ("gcc", "build-essential")])
def test_a_missing_tool_is_named_with_its_package(capsys, monkeypatch, tmp_path, gone, package):
    for name in {"make", "gcc", "arm-none-eabi-gcc", "arm-none-eabi-size", "arm-none-eabi-nm"} - {gone}:
        (tmp_path / name).write_text("#!/bin/sh\necho /there/nosys.specs\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    code, _, err = flash(capsys, "--target", "stm32")
    assert code == 2 and err.count("\n") == 1, err
    assert f"needs {gone}," in err and f"apt install {package}." in err, err


def test_a_compiler_without_headers_is_named_too(capsys, monkeypatch, tmp_path):
    for name in ("make", "gcc", "arm-none-eabi-gcc", "arm-none-eabi-size", "arm-none-eabi-nm"):
        (tmp_path / name).write_text("#!/bin/sh\necho nosys.specs\n")  # as the compiler answers for what it does not find
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    code, _, err = flash(capsys, "--target", "stm32")
    assert code == 2 and "apt install libnewlib-arm-none-eabi." in err, err


def test_what_is_no_source_tree_is_refused(capsys, stm32_tools_here, tmp_path):
    old = a_tree(tmp_path / "old", board="OTHER")
    for folder, cause in ((tmp_path / "none", "no folder"), (tmp_path, "no source tree"), (old, "1.25")):
        code, _, err = flash(capsys, "--target", "stm32", "--micropython", str(folder))
        assert code == 2 and cause in err and err.count("\n") == 1, err


# --- what the cache goes by ---

def a_tree(folder, board="NETDUINO2", recipe="all:\n\t@echo built > $(BUILD)\n"):
    for name, text in {"py/mpconfig.h": "#define MICROPY_VERSION_MAJOR 1\n", "py/vm.c": "int a;\n", "mpy-cross/Makefile": recipe,
                       "ports/qemu/Makefile": recipe, "ports/qemu/boards/%s/mpconfigboard.mk" % board: "\n"}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_the_key_of_an_image_changes_with_every_file_and_option():
    files = stm32_core.core_files(PROJECT)
    base = stm32_core.image_key("vm", files, 27 * KIB)
    assert base == stm32_core.image_key("vm", dict(reversed(files.items())), 27 * KIB)
    others = {stm32_core.image_key("vm", {**files, name: content + b"\n"}, 27 * KIB) for name, content in files.items()}
    others |= {stm32_core.image_key("vm2", files, 27 * KIB), stm32_core.image_key("vm", files, 28 * KIB)}
    assert len(others) == len(files) + 2 and base not in others


def test_the_hash_of_a_tree_goes_by_its_sources_alone(tmp_path):
    tree = a_tree(tmp_path)
    before = stm32_source.tree_hash(tree)
    (tree / "ports/qemu/build-NETDUINO2").mkdir()
    (tree / "ports/qemu/build-NETDUINO2/main.c").write_text("left by another build")
    (tree / "py/vm.c").touch()
    assert stm32_source.tree_hash(tree) == before
    (tree / "py/vm.c").write_text("int b;\n")
    assert stm32_source.tree_hash(tree) != before


def test_the_manifest_holds_the_whole_core():
    frozen = set(stm32_core.modules(stm32_core.core_files(PROJECT)))
    elsewhere = {"firmware_py/" + n for n in ("__main__.py", "main.py", "main_can.py", "manifest.py", "ports/host.py", "ports/unix.py",
                                              "main_board.py", "ports/machine.py", "ports/pins.py")}
    assert {name_of(p) for p in core_files()} - elsewhere <= frozen
    assert not any(name.startswith(("host_tools", "sim_device")) for name in frozen)


def test_a_file_that_the_manifest_forgets_is_named(tmp_path):
    shutil.copytree(PROJECT / "firmware_py", tmp_path / "firmware_py", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(PROJECT / "protocol", tmp_path / "protocol", ignore=shutil.ignore_patterns("__pycache__"))
    stm32_core.core_files(tmp_path)
    (tmp_path / "firmware_py/storage/new_store.py").write_text("")
    with pytest.raises(ImageError, match="does not name firmware_py/storage/new_store.py"):
        stm32_core.core_files(tmp_path)
    (tmp_path / "firmware_py/storage/new_store.py").unlink()
    (tmp_path / "protocol/cobs.py").unlink()
    with pytest.raises(ImageError, match="not there: protocol/cobs.py"):
        stm32_core.core_files(tmp_path)


# --- Debian's source package ---

STANZAS = """# the machine's own
Types: deb
URIs: http://mirror.example/debian
Suites: bookworm bookworm-updates
Components: main contrib
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg

Types: deb
URIs: http://mirror.example/security
Suites: bookworm-security
Components: main
"""


def test_the_source_comes_from_where_the_machine_gets_its_packages():
    other = ("other.sources", "Types: deb\nURIs: http://vendor.example/\nSuites: nodistro\nComponents: main\n")
    made = stm32_source.debian_sources([other, ("debian.sources", STANZAS)])
    assert made == {"debian.sources": "Types: deb-src\nURIs: http://mirror.example/debian\nSuites: trixie\nComponents: main\n"
                                      "Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\n"}
    lines = "# deb http://no.example bookworm main\ndeb http://a.example/security bookworm-security main\n" \
            "deb [signed-by=/k.gpg] http://mirror.example/debian bookworm main contrib\n"
    assert stm32_source.debian_sources([("sources.list", lines)]) == {
        "debian.list": "deb-src [signed-by=/k.gpg] http://mirror.example/debian trixie main\n"}
    with pytest.raises(ImageError, match="--micropython DIR"):
        stm32_source.debian_sources([other, ("ubuntu.list", "deb http://mirror.example/ubuntu noble main\n")])


# --- what the checks read ---

def test_the_flash_of_a_file_is_the_sum_of_its_symbols():
    content = 'const char mp_frozen_names[] = {\n    #ifdef X\n    X\n    #endif\n    "tvslam.py\\0"\n    "b.py\\0"\n    "\\0"\n};'
    assert stm32_check.frozen_modules(content) == ["tvslam.py", "b.py"]
    core = Linked(modules=["a/fit.py", "a/limits.py"], owners={"Fit": "a/fit.py", "fit_more": "a/fit.py"})
    symbols = "00000010 00000008 t fun_data_tvslam_Fit_add\n00000020 00000010 t const_qstr_table_data_tvslam\n" \
              "00000030 00000020 t raw_code_tvslam_fit_more\n00000040 00000100 T mp_obj_new_int\n         U abort\n"
    assert stm32_check.module_bytes(core, symbols) == {"a/fit.py": 40, "a/limits.py": 0, "tvslam.py": 16}


def test_an_address_is_that_of_the_whole_name():
    symbols = "20000010 B _ebss_old\n200104b0 B _ebss\n2000048c 00010000 b gc_heap\n"
    assert stm32_check.address(symbols, "_ebss") == 0x200104B0 and stm32_check.address(symbols, "gc_heap") == 0x2000048C
    with pytest.raises(ImageError, match="no symbol _estack"):
        stm32_check.address(symbols, "_estack")


def test_a_heap_that_overflows_the_part_says_what_fits():
    with pytest.raises(ImageError, match="largest is --heap 114k") as caught:
        stm32_build._complain("ld: region `RAM' overflowed by 40 bytes", 130048)
    assert caught.value.code == 2


def test_a_build_that_fails_shows_the_compilers_words_and_leaves_no_trace(capsys, monkeypatch, stm32_tools_here, tmp_path):
    tree = a_tree(tmp_path / "tree", recipe="all:\n\t@echo 'vm.c:7: error: no such thing'; exit 1\n")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    before = sorted(tree.rglob("*"))
    code, _, err = flash(capsys, "--target", "stm32", "--micropython", str(tree))
    assert code == 3 and "mpy-cross did not build" in err and "vm.c:7: error: no such thing" in err, err
    assert sorted(tree.rglob("*")) == before
    assert [p.name for p in (tmp_path / "cache" / "tvslam").iterdir()] == ["lock"]


# --- the image ---

@BUILDS
def test_the_image_fits_the_part_and_holds_the_core(stm32_elf):
    head = stm32_elf.read_bytes()[:20]
    assert head[:4] == b"\x7fELF" and head[4] == 1 and head[18] == 40, "no 32-bit ELF file for Arm"
    facts = stm32_image.facts(stm32_elf)
    core = stm32_core.linked(stm32_core.core_files(PROJECT))
    assert set(facts["modules"]) == {*core.modules, stm32_core.LINKED}
    with_classes = {core.owners[node.name] for node in ast.parse(core.source).body if isinstance(node, ast.ClassDef)
                    and any(isinstance(part, ast.FunctionDef) for part in node.body)}
    assert len(with_classes) > 10 and all(facts["modules"][name] > 0 for name in with_classes), facts["modules"]
    assert sum(facts["modules"].values()) < facts["text_bytes"]
    assert facts["ram_heap_bytes"] == 27648 and facts["flash_bytes"] < 600_000
    assert 0x20000000 < facts["stack_bottom"] < facts["stack_top"] == 0x20000000 + 128 * KIB
    assert facts["ram_static_bytes"] + facts["ram_heap_bytes"] + facts["ram_left_for_stack_bytes"] == 128 * KIB
    assert facts["ram_left_for_stack_bytes"] >= stm32_build.STACK_BYTES


@BUILDS
def test_a_second_call_only_looks_it_up(capsys, stm32_elf):
    begun = time.monotonic()
    code, out, err = flash(capsys, "--target", "stm32", "--heap", "27k")
    assert code == 0 and not err and time.monotonic() - begun < 5
    assert "the image is in the cache" in out and stm32_image.facts(stm32_elf)["sha256"] in out and str(stm32_elf) in out


@BUILDS
def test_a_damaged_image_is_built_again_to_the_same_bytes(stm32_elf):
    tree = stm32_image.cache_folder() / "micropython-debian-trixie"
    before = {p: p.stat().st_mtime_ns for p in tree.rglob("*")}
    said = []
    elf = stm32_image.image(31 * KIB + 5, progress=said.append)  # a heap that no other test asks for
    sha256 = stm32_image.facts(elf)["sha256"]
    elf.write_bytes(elf.read_bytes()[:1000])
    said.clear()
    assert stm32_image.image(31 * KIB, progress=said.append) == elf
    assert said == ["Building the image with the core ..."]
    assert stm32_image.facts(elf)["sha256"] == sha256
    assert {p: p.stat().st_mtime_ns for p in tree.rglob("*")} == before, "the source tree was written to"


@BUILDS
def test_the_largest_heap_that_fits_is_told_and_fits(stm32_elf):
    with pytest.raises(ImageError, match="largest is --heap") as caught:
        stm32_image.image(120 * KIB)
    largest = int(str(caught.value).rpartition("--heap ")[2].rstrip("k.")) * KIB
    assert stm32_image.facts(stm32_image.image(largest))["ram_left_for_stack_bytes"] >= stm32_build.STACK_BYTES
    with pytest.raises(ImageError, match="largest is --heap"):
        stm32_image.image(largest + KIB)


def said_until(process, end, count):
    said = b""
    while said.count(end) < count:
        byte = process.stdout.read(1)
        assert byte, said
        said += byte
    return said


@BUILDS
def test_the_image_boots_and_the_core_is_in_it(stm32_elf):
    script = "import gc, sys\nimport tvslam\ntvslam.main\ngc.collect()\n" \
             "print('{\"small_int\": %d, \"heap\": %d, \"used\": %d}' % (sys.maxsize, gc.mem_alloc() + gc.mem_free(), gc.mem_alloc()))\n"
    qemu = subprocess.Popen(["qemu-system-arm", "-M", "netduino2", "-display", "none", "-monitor", "none", "-semihosting",
                             "-serial", "stdio", "-kernel", str(stm32_elf)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    watch = threading.Timer(20, qemu.kill)  # a board that says nothing ends the test, not the day
    watch.start()
    try:
        said_until(qemu, b">>> ", 1)
        for typed, end, count in ((b"\x01", b"exit\r\n>", 1), (script.encode() + b"\x04", b"\x04", 2)):  # the raw REPL's control-A, -D
            qemu.stdin.write(typed)
            qemu.stdin.flush()
            said = said_until(qemu, end, count)
    finally:
        watch.cancel()
        qemu.kill()
        qemu.wait()
        qemu.stdin.close()
        qemu.stdout.close()
    output, error = said.split(b"OK", 1)[1].split(b"\x04")[:2]
    assert not error, error.decode()
    figures = json.loads(output)
    assert figures["small_int"] == 2**31 - 1 and 26000 < figures["heap"] <= 27648, figures
