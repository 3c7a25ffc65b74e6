"""Draws every figure of ``clutch.plot`` from real runs, into docs/gallery/.

Run it in any folder, with the package installed: ``python docs/gallery.py``. The same version of clutch and
matplotlib gives the same files.
"""

from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import clutch
from clutch import plot

FOLDER = Path(__file__).parent / "gallery"


def keep(drawing, name, colours=256):
    """Save at 110 dots per inch with few colours, and without the version that would change the file."""
    figure = getattr(drawing, "figure", drawing)
    whole = BytesIO()
    figure.savefig(whole, dpi=110)
    plt.close(figure)
    Image.open(whole).convert("RGB").quantize(colours).save(FOLDER / f"{name}.png", optimize=True)


def main():
    FOLDER.mkdir(exist_ok=True)
    laws = {"PD": "pd_2", "computed torque": "ctc_2", "sliding mode": "smc_2"}
    runs = [clutch.simulate(name) for name in laws.values()]
    pd, _, smc = runs
    keep(plot.tracking(runs, labels=list(laws)), "tracking")
    keep(plot.tracking(pd, stretch=pd.window), "tracking_stretch")
    keep(plot.phase_plane(smc), "phase_plane")
    keep(plot.run_overview(clutch.simulate("bench_pd_2")), "run_overview")

    observer = clutch.simulate("observer_smc_2")
    bench = [clutch.simulate(name) for name in ("bench_pd_2", "bench_smc_2")]
    keep(plot.comparison(bench, labels=["PD", "sliding mode"]), "comparison")
    labels = ["PD", "sliding mode", "… with observer", "PD, bench", "sliding mode, bench"]
    keep(plot.stick_slip([pd, smc, observer, *bench], labels=labels), "stick_slip")

    scenario = clutch.Scenario.load("smc_2")
    keep(plot.stribeck(scenario.rig.friction), "stribeck")
    keep(plot.friction(clutch.StribeckFriction(), clutch.LugreFriction(), clutch.ElastoPlasticFriction()), "friction")
    known = {
        "bounds.friction_percent": 20,
        "bounds.brake_gain_percent": 20,
        "bounds.drive_torque_percent": 10,
    }
    keep(plot.certificate_region(scenario.override(known)), "certificate_region")

    grid = {
        "law.smc.kp_v": np.linspace(2.4, 6.0, 13).tolist(),
        "law.smc.boundary_rad_s": np.geomspace(0.03, 0.6, 12).tolist(),
    }
    sweep = clutch.sweep("smc_2", grid, seeds=4, progress=False)
    keep(plot.sweep_map(sweep, *grid, "max_error_rad"), "sweep_map")

    with TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        clutch.simulate("bench_pd_2").save(log)
        keep(plot.log_overview(clutch.read_log(log)), "log_overview")

    for figure in clutch.reproduce(progress=False).figures:
        keep(plot.paper_figure(figure), f"paper_figure_{figure.number}", colours=64)


if __name__ == "__main__":
    main()
