"""Halflight beside Mitsuba 3 and Radiance: CPU seconds for a view of 512 × 512 pixels at equal error.

Prints a page for data/record/; data/record/README.md says how to install the peers. What the peers and the truth give is
kept in a folder, so that another build of Halflight can be measured in seconds:

    python benches/peers/peers.py --cache FOLDER > data/record/DATE-peers.md
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np

from radiance_peer import Radiance
from scene_file import read_scene
from view_error import Price, Run, View, price

ROOT = Path(__file__).resolve().parents[2]
SIZE = "512x512"
# Paths a pixel of the two parts of the truth. The product of a picture's differences to both is as noisy as the product of
# their noises, so that one of them may be cheap.
TRUTH_SPP = [1024, 256]
MITSUBA_SPP = [4, 16, 64, 256]
# More rays for each cached point (-ad) pay more than more points (-aa, -ar): the last rung shows it.
RADIANCE_LADDER = [
    "-ab 3 -ad 128 -as 32 -aa .2 -ar 32 -ds .2 -dj 0",
    "-ab 5 -ad 512 -as 128 -aa .15 -ar 64 -ds .1 -dj 0",
    "-ab 7 -ad 512 -as 128 -aa .2 -ar 64 -ds .05 -dj 0",
    "-ab 7 -ad 1024 -as 256 -aa .2 -ar 64 -ds .05 -dj 0",
    "-ab 7 -ad 2048 -as 512 -aa .2 -ar 64 -ds .05 -dj 0",
    "-ab 7 -ad 2048 -as 512 -aa .15 -ar 64 -ds .05 -dj 0",
    "-ab 7 -ad 1024 -as 256 -aa .1 -ar 128 -ds .05 -dj 0",
]
# The error that the figure asked for is given at.
ASKED = 0.01


def children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Kept:
    """Pictures in a folder, each with the CPU seconds that it took; made where they are missing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def picture(self, name: str, make) -> tuple[np.ndarray, float]:
        """`make` takes the path to write to and returns the seconds."""
        name = re.sub(r"[^\w.]+", "-", name).strip("-")
        picture, seconds = self.folder / f"{name}.npy", self.folder / f"{name}.cpu"
        if not seconds.exists() or not seconds.read_text().strip():
            print(f"{self.folder.name}: {name}", file=sys.stderr)
            seconds.write_text(f"{make(picture)}\n")
        return np.load(picture), float(seconds.read_text())


def mitsuba(*arguments) -> float:
    """Runs the other program of this folder; the CPU seconds that it counted itself."""
    command = [sys.executable, str(Path(__file__).with_name("mitsuba_peer.py")), *map(str, arguments)]
    return float(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.split()[-1])


def view_of(scene: Path, kept: Kept) -> View:
    parts = [
        kept.picture(f"mitsuba-centres-{spp}-{seed}", lambda picture: mitsuba("centres", scene, spp, seed, picture))[0]
        for seed, spp in enumerate(TRUTH_SPP, start=1)
    ]
    lamps, _ = kept.picture("lamps", lambda picture: mitsuba("lamps", scene, picture))
    return View(parts, TRUTH_SPP, lamps)


def runs_of_mitsuba(scene: Path, kept: Kept, view: View) -> list[Run]:
    """Every rung twice, since an unbiased picture's error is its noise; the seconds are those of one."""
    runs = []
    for spp in MITSUBA_SPP:
        seeds = (10 * spp + 1, 10 * spp + 2)
        (one, seconds), (two, seconds_again) = (
            kept.picture(
                f"mitsuba-render-{spp}-{seed}", lambda picture: mitsuba("render", scene, spp, seed, picture)
            )
            for seed in seeds
        )
        runs.append(Run(f"{spp} paths a pixel", (seconds + seconds_again) / 2, view.noise(one, two)))
    return runs


def runs_of_radiance(scene: Path, kept: Kept, view: View, radiance: Radiance) -> list[Run]:
    def draw(settings: str, picture: Path) -> float:
        start = children_seconds()
        with tempfile.TemporaryDirectory() as folder:
            drawn = radiance.draw(read_scene(scene), settings.split(), Path(folder))
        np.save(picture, drawn)
        return children_seconds() - start

    runs = []
    for settings in RADIANCE_LADDER:
        picture, seconds = kept.picture(f"radiance {settings}", lambda picture: draw(settings, picture))
        runs.append(Run(settings, seconds, view.error(picture)))
    return runs


def run_of_halflight(program: Path, scene: Path, settings: str, view: View, turns: int) -> Run:
    """Bake and picture together; the median of a few turns."""
    with tempfile.TemporaryDirectory() as folder:
        bake, picture, read = (Path(folder) / name for name in ("bake.hlf", "picture.exr", "picture.npy"))
        times = []
        for _ in range(turns):
            start = children_seconds()
            quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            subprocess.run([program, "bake", scene, "-o", bake, *settings.split()], **quiet)
            subprocess.run([program, "shot", bake, "-o", picture, "--size", SIZE, "--backend", "cpu"], **quiet)
            times.append(children_seconds() - start)
        mitsuba("exr", picture, read)
        return Run(settings or "defaults", sorted(times)[turns // 2], view.error(np.load(read)))


def settings_of(program: Path) -> list[str]:
    """A tolerance where the program takes one."""
    said = subprocess.run([program, "bake", "--help"], check=True, capture_output=True, text=True).stdout
    return ["--tolerance 0.01"] if "--tolerance" in said else [""]


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(": ", 1)[1]
    return "unknown processor"


def print_scene(name: str, ours: list[Run], peers: dict[str, tuple[list[Run], bool]], view: View) -> None:
    print(f"\n## {name}\n")
    print(f"Blocks compared: {int(view.kept.sum())} of {view.kept.size}.\n")
    print("| program | settings | CPU s | relative RMSE |\n|---|---|---|---|")
    for program, runs in [("Halflight", ours), *((peer, runs) for peer, (runs, _) in peers.items())]:
        for run in runs:
            print(f"| {program} | {run.settings} | {run.cpu_seconds:.2f} | {100 * run.error:.2f} % |")

    def told(found: Price | None) -> str:
        return "not reached" if found is None else f"{found.cpu_seconds:.1f}{' (x)' if found.extrapolated else ''}"

    print(f"\n| CPU s for | {' | '.join(peers)} | Halflight | the better peer ÷ Halflight |")
    print(f"|---|{'---|' * len(peers)}---|---|")
    for run in ours:
        for error, at in [(run.error, "its own error"), (ASKED, f"{100 * ASKED:g} %")]:
            prices = [price(runs, error, unbiased) for runs, unbiased in peers.values()]
            best = min((found.cpu_seconds for found in prices if found), default=float("nan"))
            # A picture that is not as good as the error asked for has no place beside those that are.
            within = run.error <= error
            own = f"{run.cpu_seconds:.2f}" if within else f"misses it ({100 * run.error:.2f} %)"
            ratio = f"{best / run.cpu_seconds:.1f}" if within else "–"
            what = f"{run.settings}: {at}" + (f", {100 * error:.2f} %" if at == "its own error" else "")
            print(f"| {what} | {' | '.join(map(told, prices))} | {own} | {ratio} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, required=True, help="folder that keeps the peers' pictures and the truth")
    parser.add_argument("--halflight", type=Path, default=ROOT / "target/release/halflight", help="the program")
    ours_help = "flags of a bake, such as --ours=--tolerance=0.01; once for each rung"
    parser.add_argument("--ours", action="append", metavar="FLAGS", help=ours_help)
    parser.add_argument("--scenes", nargs="+", default=["office", "cornell_box"], help="names in data/scenes/")
    parser.add_argument("--turns", type=int, default=3, help="runs of Halflight of which the median counts")
    flags = parser.parse_args()
    ours, radiance = flags.ours if flags.ours is not None else settings_of(flags.halflight), Radiance()

    program = subprocess.run([flags.halflight, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    print(f"# A view at equal error: Halflight, Mitsuba, Radiance, {date.today()}\n")
    print(f"Machine: {processor()}, {os.cpu_count()} threads.")
    print(f"Programs: {program}; Mitsuba {version('mitsuba')}, path, llvm; {radiance.version()}, rpict.")
    print("Command: `python benches/peers/peers.py --cache FOLDER`; data/record/README.md says how to install the peers.\n")
    print(PREFACE.format(truth=" and ".join(map(str, TRUTH_SPP))))
    for name in flags.scenes:
        scene = ROOT / "data/scenes" / f"{name}.obj"
        kept = Kept(flags.cache / name)
        view = view_of(scene, kept)
        peers = {
            "Mitsuba": (runs_of_mitsuba(scene, kept, view), True),
            "Radiance": (runs_of_radiance(scene, kept, view, radiance), False),
        }
        runs = [run_of_halflight(flags.halflight, scene, settings, view, flags.turns) for settings in ours]
        print_scene(name, runs, peers, view)


PREFACE = """\
512 × 512 pixels from the scene's own camera. CPU seconds are user and system time: of Halflight bake, file and picture on the
CPU, everything included; of Mitsuba without Python's start and import and with its kernels compiled already; of Radiance
oconv, an overture that fills the ambient cache, and rpict. The error is the relative RMSE of radiance averaged over 4 × 4
pixels, ((L − L_true) ÷ max(own, mean))², blocks within a pixel of a lamp left out. The truth is Mitsuba's path tracer
along the rays through the pixels' centres, which Halflight and rpict draw, in two parts of {truth} paths a pixel:
a difference's square has one part in one factor and the other in the other, so that the truth's noise falls out. Mitsuba itself
samples all over each pixel, so its error is its noise, from the difference of two pictures. Between the rungs of a ladder
seconds are interpolated in both logarithms; (x) is extrapolated as noise falls, with the root of the paths."""


if __name__ == "__main__":
    main()
