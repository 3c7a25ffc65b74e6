"""Types of the installed package, by mypy: those in it, and its stub beside the native module."""

import importlib.util
import subprocess
import sys

import pytest

from conftest import ROOT

SETTINGS = ROOT / "pyproject.toml"

pytestmark = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="needs mypy")


def finds_nothing(folder, *arguments):
    """A module of mypy, run in a folder of its own, where its cache stays."""
    done = subprocess.run(
        [sys.executable, "-m", *arguments, SETTINGS], cwd=folder, capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_installed_package_is_strictly_typed(tmp_path):
    finds_nothing(tmp_path, "mypy", "--strict", "-p", "clutch", "--config-file")


def test_the_stub_agrees_with_the_native_module_at_run_time(tmp_path):
    finds_nothing(tmp_path, "mypy.stubtest", "clutch._clutch", "--mypy-config-file")
