"""How far a picture is from the truth, and what it takes to be that near."""

import math
from dataclasses import dataclass

import numpy as np

# Pixels along the side of a block.
BLOCK = 4


def blocks(picture: np.ndarray) -> np.ndarray:
    """The means of 4 × 4 pixels."""
    height, width = picture.shape[0] // BLOCK, picture.shape[1] // BLOCK
    return picture.astype(float).reshape(height, BLOCK, width, BLOCK, -1).mean(axis=(1, 3))


class View:
    """The truth of one view: two parts with independent noise, so that the noise can be told from the error.

    Blocks within a pixel of a lamp are left out: a lamp's own radiance is known, and its edge would own the figure.
    """

    def __init__(self, parts: list[np.ndarray], weights: list[float], lamps: np.ndarray) -> None:
        near = np.pad(lamps > 0, 1)
        rows, columns = lamps.shape
        near = np.any([near[y : y + rows, x : x + columns] for y in range(3) for x in range(3)], axis=0)
        self.kept = blocks(near[..., np.newaxis])[..., 0] == 0
        self.parts = [blocks(part)[self.kept] for part in parts]
        own = np.average(self.parts, axis=0, weights=weights).mean(axis=-1, keepdims=True)
        self.scale = np.maximum(own, own.mean())

    def error(self, picture: np.ndarray) -> float:
        """Root of the mean of ((L − L_true) ÷ max(own, mean))²; what noise the truth has falls out of the product."""
        seen = blocks(picture)[self.kept]
        differences = [(seen - part) / self.scale for part in self.parts]
        return math.sqrt(max(0.0, float(np.mean(differences[0] * differences[1]))))

    def noise(self, picture: np.ndarray, again: np.ndarray) -> float:
        """The same of an unbiased picture that was made twice, from the difference of the two."""
        difference = (blocks(picture)[self.kept] - blocks(again)[self.kept]) / self.scale
        return math.sqrt(float(np.mean(difference**2)) / 2)


@dataclass(frozen=True)
class Run:
    """One picture of one program."""

    settings: str
    cpu_seconds: float
    error: float


@dataclass(frozen=True)
class Price:
    """CPU seconds for an error; extrapolated where the ladder of settings ends before it."""

    cpu_seconds: float
    extrapolated: bool


def price(runs: list[Run], error: float, unbiased: bool) -> Price | None:
    """Between the two runs around an error, straight in both logarithms.

    Below the last run an unbiased program goes on as its noise does, with the root of the samples; of another nobody
    knows where it ends: none.
    """
    front: list[Run] = []
    for run in sorted(runs, key=lambda run: run.cpu_seconds):
        if not front or run.error < front[-1].error:
            front.append(run)
    if not front:
        return None
    if error >= front[0].error:
        # The cheapest run is better than what is asked for, and that is all it tells.
        return Price(front[0].cpu_seconds, False)
    for coarse, fine in zip(front, front[1:]):
        if error >= fine.error:
            way = math.log(coarse.error / error) / math.log(coarse.error / fine.error)
            return Price(coarse.cpu_seconds * (fine.cpu_seconds / coarse.cpu_seconds) ** way, False)
    return Price(front[-1].cpu_seconds * (front[-1].error / error) ** 2, True) if unbiased else None
