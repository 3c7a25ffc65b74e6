"""A package that is not installed: the error names the extra that brings it."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from clutch._extras import EXTRAS, needed

ROOT = Path(__file__).resolve().parents[2]
SWEEP = "clutch.sweep('smc_2', {'law.smc.kp_v': [3.0]}, progress=False)"
LOG = "clutch.simulate('smc_2').save('run.mcap'); log = clutch.read_log('run.mcap');"
TUNED = "clutch.tune('board_smc_2', candidates=2)"

#: Module that is hidden, and what a user then does.
USES = [
    ("matplotlib", "clutch.simulate('smc_2').plot()"),
    ("matplotlib", "clutch.plot.stribeck(clutch.StribeckFriction())"),
    ("matplotlib", "e = clutch.gym.TrackingEnv(render_mode='rgb_array'); e.reset(seed=1); e.render()"),
    ("pandas", "clutch.simulate('smc_2').to_pandas()"),
    ("pandas", f"{SWEEP}.to_pandas()"),
    ("pandas", f"{TUNED}.to_pandas()"),
    ("pyarrow", "clutch.simulate('smc_2').to_arrow()"),
    ("pyarrow", f"{LOG} log.export('run.parquet')"),
    ("polars", "clutch.simulate('smc_2').to_polars()"),
    ("xarray", "clutch.simulate('smc_2').to_xarray()"),
    ("xarray", f"{SWEEP}.to_xarray()"),
    ("scipy", "clutch.sobol({'law.smc.kp_v': (1, 2)}, 4)"),
    ("scipy", "clutch.latin_hypercube({'law.smc.kp_v': (1, 2)}, 4)"),
    ("ray", "clutch.executors.RayExecutor()"),
    ("gymnasium", "clutch.gym"),
    ("control", "clutch.dynamics.to_control('smc_2')"),
    ("control", "clutch.dynamics.sampled_rig('smc_2')"),
    ("control", "clutch.dynamics.sampled_law('smc_2')"),
]

HIDES = """
import sys, traceback
sys.modules[{module!r}] = None
import clutch
for use in {uses!r}:
    try:
        exec(use)
    except ModuleNotFoundError as error:
        print(error.name, "|", error)
    else:
        print("no error |", use)
"""


@pytest.mark.parametrize("module", dict.fromkeys(module for module, _ in USES))
def test_a_module_that_is_not_there_is_named_with_its_extra(module, tmp_path):
    uses = [use for name, use in USES if name == module]
    extra = next(extra for extra, modules in EXTRAS.items() if module in modules)
    code = HIDES.format(module=module, uses=uses)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == len(uses)
    for line in lines:
        assert line.startswith(f"{module} | ") and line.endswith(f"pip install 'clutch-control[{extra}]'"), line


def test_extras_are_those_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    listed = {
        extra: tuple(package.split(">")[0] for package in packages)
        for extra, packages in project["optional-dependencies"].items()
        if extra != "all"
    }
    assert listed == EXTRAS


def test_a_module_that_is_there_and_does_not_work_gives_its_own_error():
    with pytest.raises(ModuleNotFoundError, match="No module named 'no_such_part'"), needed("matplotlib", "a test"):
        raise ModuleNotFoundError("No module named 'no_such_part'", name="no_such_part")
    with pytest.raises(ImportError, match="wrong version"), needed("matplotlib", "a test"):
        raise ImportError("wrong version", name="matplotlib")
