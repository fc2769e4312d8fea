"""Radiance: rpict, with an overture that fills its ambient cache first, as its manual advises for good pictures."""

import os
import subprocess
from pathlib import Path

import numpy as np

from scene_file import SceneFile

SIZE = 512
# Side of the overture's picture, pixels.
OVERTURE = 128
# One ray through every pixel's centre, and no light left out for being dim.
COMMON = "-ps 1 -pj 0 -dt 0 -dc 1 -st 1 -lr 12 -lw 1e-5 -av 0 0 0"


def radiance_text(scene: SceneFile) -> str:
    """Perfectly diffuse `plastic`, and `light`, which emits from the front alone.

    A plastic reflects on both sides, where ours are black behind. In these closed rooms no light gets behind a face to be
    seen: backs made black by a `mixfunc` changed errors by 0.0002, and made rpict no faster.
    """
    lines = []
    for name, material in scene.materials.items():
        if material.emits:
            lines += [f"void light {name}", "0", "0", "3 {} {} {}".format(*material.radiance)]
        else:
            # No gloss, no roughness.
            lines += [f"void plastic {name}", "0", "0", "5 {} {} {} 0 0".format(*material.reflectance)]
    for index, (material, corners) in enumerate(scene.polygons):
        lines += [f"{material} polygon p{index}", "0", "0", str(3 * len(corners))]
        lines += ["{!r} {!r} {!r}".format(*scene.vertices[corner]) for corner in corners]
    return "\n".join(lines) + "\n"


class Radiance:
    """The programs of one installation of Radiance."""

    def __init__(self) -> None:
        import pyradiance

        root = Path(pyradiance.__file__).parent
        self.programs = root / "bin"
        library = root / "lib"
        self.environment = os.environ | {"RAYPATH": f".:{library}", "PATH": f"{self.programs}:{os.environ['PATH']}"}

    def version(self) -> str:
        said = subprocess.run([self.programs / "rpict", "-version"], capture_output=True, text=True, env=self.environment)
        return said.stdout.strip()

    def draw(self, scene: SceneFile, settings: list[str], folder: Path) -> np.ndarray:
        """A picture, rows from the top."""
        text, octree, ambient = folder / "scene.rad", folder / "scene.oct", folder / "scene.amb"
        text.write_text(radiance_text(scene))
        ambient.unlink(missing_ok=True)
        camera = scene.camera
        view = ["-vtv", "-vp", *camera.eye, "-vd", *camera.direction, "-vu", *camera.up]
        view += ["-vh", camera.vertical_angle, "-vv", camera.vertical_angle, "-pa", 0]
        options = [*COMMON.split(), *settings, "-af", ambient, *view]
        octree.write_bytes(self._run("oconv", text))
        self._run("rpict", *options, "-x", OVERTURE, "-y", OVERTURE, octree)
        picture = self._run("rpict", *options, "-x", SIZE, "-y", SIZE, octree)
        # 8 bits of mantissa are what a picture of Radiance has; the mean of 16 pixels hides them.
        floats = self._run("pvalue", "-h", "-H", "-df", given=picture)
        return np.frombuffer(floats, dtype=np.float32).reshape(SIZE, SIZE, 3)

    def _run(self, program: str, *arguments, given: bytes | None = None) -> bytes:
        command = [str(self.programs / program), *map(str, arguments)]
        done = subprocess.run(command, input=given, capture_output=True, env=self.environment)
        if done.returncode != 0:
            raise RuntimeError(f"{program}: {done.stderr.decode(errors='replace')}")
        return done.stdout
