"""A scene as Halflight's OBJ files have it: polygons, materials, and the camera in a comment."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Material:
    """Linear RGB reflectance and emitted radiance (W/(sr m²)), both of the front side."""

    name: str
    reflectance: tuple[float, float, float]
    radiance: tuple[float, float, float]

    @property
    def emits(self) -> bool:
        return max(self.radiance) > 0


@dataclass(frozen=True)
class Camera:
    """Metres; the angle is the full vertical one, degrees."""

    eye: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float]
    vertical_angle: float


@dataclass(frozen=True)
class SceneFile:
    """Polygons are counter-clockwise seen from their front, and convex."""

    name: str
    vertices: list[tuple[float, float, float]]
    polygons: list[tuple[str, list[int]]]
    materials: dict[str, Material]
    camera: Camera


def read_scene(path: Path) -> SceneFile:
    """Reads what the scenes of data/scenes/ are written with, and no more of OBJ than that."""
    vertices, polygons, materials, camera, material = [], [], {}, None, ""
    for line in path.read_text().splitlines():
        match line.split():
            case ["#", "camera", "eye", *numbers] if camera is None:
                camera = _camera(numbers)
            case ["mtllib", name]:
                materials = _materials(path.with_name(name))
            case ["v", *numbers]:
                vertices.append(_colour(numbers))
            case ["usemtl", name]:
                material = name
            case ["f", *corners]:
                polygons.append((material, [int(corner.split("/")[0]) - 1 for corner in corners]))
    if camera is None:
        raise ValueError(f"{path}: no camera stands in its comments")
    return SceneFile(path.stem, vertices, polygons, materials, camera)


def _colour(words: list[str]) -> tuple[float, float, float]:
    x, y, z = (float(word) for word in words[:3])
    return x, y, z


def _camera(words: list[str]) -> Camera:
    """`X Y Z dir X Y Z up X Y Z fov_deg D`, whatever follows."""
    if (words[3], words[7], words[11]) != ("dir", "up", "fov_deg"):
        raise ValueError(f"no camera: {' '.join(words)}")
    return Camera(_colour(words), _colour(words[4:]), _colour(words[8:]), float(words[12]))


def _materials(path: Path) -> dict[str, Material]:
    values: dict[str, dict[str, tuple[float, float, float]]] = {}
    name = ""
    for line in path.read_text().splitlines():
        match line.split():
            case ["newmtl", name]:
                values[name] = {"Kd": (0, 0, 0), "Ke": (0, 0, 0)}
            case [("Kd" | "Ke") as key, *numbers]:
                values[name][key] = _colour(numbers)
    return {name: Material(name, value["Kd"], value["Ke"]) for name, value in values.items()}
