"""How far two pictures are apart, beside their noise; and how noise falls with time."""

from dataclasses import dataclass

import numpy as np

BLOCK = 8
"""Pictures are compared by the means of blocks of so many pixels, which are less noisy than pixels,
so that a bias shows."""

TOLERANCE = 0.01
"""Largest root mean square of relative differences that is taken for none."""


def blocks(picture: np.ndarray) -> np.ndarray:
    height, width, channels = picture.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = picture[: rows * BLOCK, : columns * BLOCK]
    return cut.reshape(rows, BLOCK, columns, BLOCK, channels).mean(axis=(1, 3))


def relative_error(a: np.ndarray, b: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """relMSE by block and channel: (a - b)^2 / (r^2 + 0.01)."""
    return (a - b) ** 2 / (reference**2 + 0.01)


@dataclass
class Verdict:
    """What comparing two renderers' halves gave."""

    difference: float
    """relMSE between the two renderers' means."""
    noise: float
    """What it would be on average if they agreed."""
    uncertain: float
    """Three standard errors of the difference of both."""
    mean_ratio: float
    """Mean radiance of the first over that of the second."""

    @property
    def bias(self) -> float:
        """relMSE that noise does not explain."""
        return self.difference - self.noise

    @property
    def allowed(self) -> float:
        return TOLERANCE**2 + self.uncertain

    @property
    def agrees(self) -> bool:
        return self.bias <= self.allowed


def compare(ours: list[np.ndarray], peers: list[np.ndarray]) -> Verdict:
    """Compares two independent halves of each renderer."""
    a, b = ([blocks(half) for half in halves] for halves in (ours, peers))
    mean_a, mean_b = (a[0] + a[1]) / 2, (b[0] + b[1]) / 2
    reference = (mean_a + mean_b) / 2
    difference = relative_error(mean_a, mean_b, reference)
    # The mean of two halves has a quarter of the variance of their difference.
    noise = (relative_error(*a, reference) + relative_error(*b, reference)) / 4
    excess = (difference - noise).ravel()
    return Verdict(
        difference=float(difference.mean()),
        noise=float(noise.mean()),
        uncertain=float(3 * excess.std() / np.sqrt(excess.size)),
        mean_ratio=float(mean_a.mean() / mean_b.mean()),
    )


@dataclass
class Efficiency:
    """Error and time of one renderer on one scene."""

    mpaths_per_second: float
    seconds: float
    """Of one picture of `samples` a pixel."""
    samples: int
    mse: float
    relative_mse: float
    mean: float
    """Of all pictures and channels."""


def efficiency(pictures: list[np.ndarray], seconds: list[float], samples: int) -> Efficiency:
    """The error of single pictures against the mean of the others, which have seeds of their own.

    That mean is noisy as well: of n pictures, the squared distance of one to the mean of the others
    is n / (n - 1) times its variance.
    """
    n = len(pictures)
    total = sum(pictures)
    mse, relative = [], []
    for picture in pictures:
        others = (total - picture) / (n - 1)
        squared = (picture - others) ** 2 * (n - 1) / n
        mse.append(squared.mean())
        relative.append((squared / (others**2 + 0.01)).mean())
    time = float(np.median(seconds))
    height, width = pictures[0].shape[:2]
    return Efficiency(
        mpaths_per_second=width * height * samples / time * 1e-6,
        seconds=time,
        samples=samples,
        mse=float(np.mean(mse)),
        relative_mse=float(np.mean(relative)),
        mean=float(total.mean() / n),
    )
