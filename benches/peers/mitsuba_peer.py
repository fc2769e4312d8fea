"""Mitsuba 3: the path tracer, and the truth that all are measured against.

Run as a program of its own for every picture, so that its CPU seconds can be told from the caller's:

    mitsuba_peer.py render SCENE.obj SPP SEED OUT.npy      a picture as Mitsuba makes it, samples all over each pixel
    mitsuba_peer.py centres SCENE.obj SPP SEED OUT.npy     radiance along the rays through the pixels' centres
    mitsuba_peer.py lamps SCENE.obj OUT.npy                1 where the ray through a pixel's centre meets a lamp's front
    mitsuba_peer.py exr PICTURE.exr OUT.npy                a picture of another program

Each prints the CPU seconds that it took without Python's start and the import of Mitsuba. Compiled kernels come from
Mitsuba's own cache where it has them. Both favour Mitsuba.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from scene_file import SceneFile, read_scene

SIZE = 512
# Paths that are followed at once when radiance is asked for ray by ray: bounds the memory.
WAVEFRONT = 1 << 23


def mitsuba_scene(mi, scene: SceneFile, folder: Path):
    """One mesh a material: diffuse on the front, black on the back; lamps emit from the front alone."""
    camera = scene.camera
    target = [e + d for e, d in zip(camera.eye, camera.direction)]
    parts = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1},
        "sensor": {
            "type": "perspective",
            "fov_axis": "y",
            "fov": camera.vertical_angle,
            "near_clip": 1e-3,
            "to_world": mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=target, up=list(camera.up)),
            "film": {
                "type": "hdrfilm",
                "width": SIZE,
                "height": SIZE,
                "pixel_format": "rgb",
                "rfilter": {"type": "box"},
            },
        },
    }
    for name in {material for material, _ in scene.polygons}:
        mesh = folder / f"{name}.obj"
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in scene.vertices]
        for material, corners in scene.polygons:
            if material == name:
                fan = zip(corners[1:], corners[2:])
                lines += [f"f {corners[0] + 1} {b + 1} {c + 1}" for b, c in fan]
        mesh.write_text("\n".join(lines) + "\n")
        material = scene.materials[name]
        shape = {
            "type": "obj",
            "filename": str(mesh),
            "face_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(material.reflectance)}},
        }
        if material.emits:
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": list(material.radiance)}}
        parts[f"mesh_{name}"] = shape
    return mi.load_dict(parts)


def centre_rays(mi, dr, scene: SceneFile, copies: int):
    """The rays through all pixels' centres, rows from the top, each `copies` times in succession."""
    eye, forward, up = (np.array(v, dtype=float) for v in (scene.camera.eye, scene.camera.direction, scene.camera.up))
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = np.tan(np.radians(scene.camera.vertical_angle) / 2)
    index = dr.arange(mi.UInt32, SIZE * SIZE * copies) // copies
    x = (2 * (mi.Float(index % SIZE) + 0.5) / SIZE - 1) * half
    y = (1 - 2 * (mi.Float(index // SIZE) + 0.5) / SIZE) * half
    forward, right, up = (mi.Vector3f(axis.tolist()) for axis in (forward, right, up))
    direction = dr.normalize(forward + right * x + up * y)
    return mi.Ray3f(mi.Point3f(eye.tolist()), direction)


def radiance_at_centres(mi, dr, scene_file: SceneFile, scene, spp: int, seed: int) -> np.ndarray:
    total = np.zeros((SIZE, SIZE, 3))
    copies = min(spp, WAVEFRONT // (SIZE * SIZE))
    for turn in range(spp // copies):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * 100_003 + turn, SIZE * SIZE * copies)
        rays = centre_rays(mi, dr, scene_file, copies)
        radiance, _, _ = scene.integrator().sample(scene, sampler, mi.RayDifferential3f(rays))
        # Before the sums: each of them alone would trace all paths again.
        dr.eval(radiance)
        sums = [dr.block_sum(channel, copies) for channel in (radiance.x, radiance.y, radiance.z)]
        dr.eval(sums)
        total += np.stack([np.array(channel).reshape(SIZE, SIZE) for channel in sums], axis=-1)
    return total / (spp // copies * copies)


def main() -> None:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    start = time.process_time()
    task, source, output = sys.argv[1], Path(sys.argv[2]), sys.argv[-1]
    if task == "exr":
        picture = np.array(mi.Bitmap(str(source)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    else:
        scene_file = read_scene(source)
        with tempfile.TemporaryDirectory() as folder:
            scene = mitsuba_scene(mi, scene_file, Path(folder))
        if task == "lamps":
            hit = scene.ray_intersect(centre_rays(mi, dr, scene_file, 1))
            lamp = hit.is_valid() & (hit.emitter(scene) != None) & (hit.wi.z > 0)  # noqa: E711, a lane-wise comparison
            picture = np.array(dr.select(lamp, mi.Float(1), mi.Float(0))).reshape(SIZE, SIZE)
        elif task == "centres":
            picture = radiance_at_centres(mi, dr, scene_file, scene, int(sys.argv[3]), int(sys.argv[4]))
        else:
            picture = np.array(mi.render(scene, spp=int(sys.argv[3]), seed=int(sys.argv[4])))
    np.save(output, picture.astype(np.float32))
    print(time.process_time() - start)


if __name__ == "__main__":
    main()
