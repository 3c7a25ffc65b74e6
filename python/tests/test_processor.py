"""The wheel has the native module twice on x86-64, and takes the one that the processor can run."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import clutch as package
from clutch import _processor

HERE = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="the second module is for x86-64 on Linux"
)
FLAGS = " ".join(sorted(_processor.NEEDS))

# Every built-in scenario, all samples: which module gave them, and their hash.
HASHED = """
import hashlib, clutch
from clutch import _clutch
hashed = hashlib.sha256()
for name in clutch.scenarios():
    run = clutch.simulate(clutch.Scenario.load(name).override({"run.duration_s": 3.0, "run.settle_s": 1.0}))
    for column in run.samples:
        hashed.update(run.samples[column].tobytes())
    hashed.update(repr(run.metrics).encode())
print(_clutch.__file__)
print(hashed.hexdigest())
"""


def python(code, choice=None):
    environment = {k: v for k, v in os.environ.items() if k != _processor.VARIABLE}
    if choice is not None:
        environment[_processor.VARIABLE] = choice
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, encoding="utf-8")


def installed():
    """The package's folder, if both modules lie there."""
    folder = Path(package.__file__).parent
    if not (folder / "x86_64_v3").is_dir():
        assert not os.environ.get("CI"), "CI builds the whole wheel: it has both modules"
        pytest.skip("this build has one module: maturin develop, or for one processor")
    return folder


@HERE
def test_both_modules_give_the_same_bits():
    folder = installed()
    if not _processor.has_level():
        pytest.skip("this processor cannot run code for x86-64-v3")
    told = {}
    for choice in (*_processor.CHOICES, None):
        done = python(HASHED, choice)
        assert done.returncode == 0, done.stderr
        module, told[choice] = done.stdout.split()
        expected = folder if choice == "x86-64" else folder / "x86_64_v3"
        assert Path(module).parent == expected, f"{choice}: {module}"
    assert len(set(told.values())) == 1, f"code for another processor gives other bits: {told}"


@HERE
def test_the_module_for_any_processor_is_for_any_processor():
    folder = installed()
    # AVX and AVX2 move data between vectors of 256 bits by these; in code for any x86-64 none may be reached.
    module = next(folder.glob("_clutch.*.so")).read_bytes()
    fast = next((folder / "x86_64_v3").glob("_clutch.*.so")).read_bytes()
    assert fast.count(b"\xc5\xfb\x59") > 100 * max(1, module.count(b"\xc5\xfb\x59")), "vmulsd"


def test_another_name_is_refused_with_what_is_expected():
    done = python("import clutch", "skylake")
    assert done.returncode != 0
    assert "CLUTCH_PROCESSOR = skylake: expected x86-64 or x86-64-v3" in done.stderr


@pytest.mark.parametrize(
    ("text", "has"),
    [
        (f"processor\t: 0\nflags\t\t: fpu {FLAGS} sse\n\nprocessor\t: 1\n", True),
        (f"processor\t: 0\nflags\t\t: fpu {FLAGS.replace('avx2', 'avx3')} sse\n", False),
        ("processor\t: 0\nFeatures\t: fp asimd\n", False),
        ("", False),
    ],
)
def test_a_processor_has_the_level_if_it_has_all_of_it(tmp_path, text, has):
    file = tmp_path / "cpuinfo"
    file.write_text(text)
    assert _processor.has_level(file) is has
    assert not _processor.has_level(tmp_path / "none")


def test_a_module_that_cannot_run_or_is_not_there_is_not_taken(tmp_path, monkeypatch):
    monkeypatch.delenv(_processor.VARIABLE, raising=False)
    monkeypatch.setattr(_processor, "has_level", lambda: False)
    assert _processor.folder(tmp_path) is None
    (tmp_path / "x86_64_v3").mkdir()
    assert _processor.folder(tmp_path) is None
    monkeypatch.setenv(_processor.VARIABLE, "x86-64-v3")
    with pytest.raises(ImportError, match="this processor cannot run it; expected x86-64"):
        _processor.folder(tmp_path)
    with pytest.raises(ImportError, match="this build has no module for it"):
        _processor.folder(tmp_path / "none")
    monkeypatch.setattr(_processor, "has_level", lambda: True)
    assert _processor.folder(tmp_path) == tmp_path / "x86_64_v3"
    monkeypatch.setenv(_processor.VARIABLE, "x86-64")
    assert _processor.folder(tmp_path) is None
