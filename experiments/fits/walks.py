"""Which way of bringing back what single facets lose is nearest to random walks among the facets?

Walks: Heitz, Hanika, d'Eon and Dachsbacher 2016, "Multiple-Scattering Microfacet BSDFs with the Smith Model", with
uniform heights, for white isotropic GGX surfaces. Against them, with exact integrals: Kulla and Conty's lobe,
Turquin's scale 1/E(wo), a scale s(wo) s(wi) that makes every direction keep all, and light that stays with its first
facet, mirrored above the horizon. Prints the share of light that goes another way. Needs numpy; takes two minutes.

    python3 experiments/fits/walks.py
"""

import numpy as np

RANDOM = np.random.default_rng(1)
CELLS = dict(bins=[16, 24], range=[[0, 1], [0, np.pi]])


def at(cosine):
    return np.array([np.sqrt(1 - cosine * cosine), 0, cosine])


def stretched(w, a):
    return np.sqrt((a * w[..., 0]) ** 2 + (a * w[..., 1]) ** 2 + w[..., 2] ** 2)


def smith_lambda(w, a):
    ratio = stretched(w, a) / np.maximum(np.abs(w[..., 2]), 1e-12)
    return np.where(w[..., 2] > 0, 0.5 * (ratio - 1), -0.5 * (ratio + 1))


def mirrored_at_facets(views, a):
    """Each view, mirrored at a facet that it sees (Dupuy and Benyoub 2023); views may come from below."""
    u = RANDOM.random((len(views), 2))
    w = views * [a, a, 1]
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    z = (1 - u[:, 1]) * (1 + w[:, 2]) - w[:, 2]
    s, phi = np.sqrt(np.maximum(0, 1 - z * z)), 2 * np.pi * u[:, 0]
    m = (np.stack([s * np.cos(phi), s * np.sin(phi), z], 1) + w) * [a, a, 1]
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    return 2 * np.sum(m * views, 1)[:, None] * m - views


def walks(wo, a, count):
    """Where light from `wo` leaves, after any number of facets."""
    w = np.tile(-wo, (count, 1))
    height = np.full(count, 1 - 1e-9)
    inside = np.arange(count)
    while len(inside):
        d, u = w[inside], RANDOM.random(len(inside))
        below = np.clip(0.5 * (height[inside] + 1), 1e-12, 1)
        masking = smith_lambda(d, a)
        leaves = (d[:, 2] > 0) & (u > 1 - below ** np.maximum(masking, 0))
        with np.errstate(all="ignore"):
            height[inside] = 2 * np.clip(below / (1 - u) ** (1 / masking), 0, 1) - 1
        inside = inside[~leaves]
        w[inside] = mirrored_at_facets(-w[inside], a)
    return w


def single(wo, a, count):
    """Directions after one facet, and what is not shadowed of each: G2 / G1."""
    wi = mirrored_at_facets(np.tile(wo, (count, 1)), a)
    o, i = wo[2], wi[:, 2]
    so, si = stretched(wo, a), stretched(wi, a)
    return wi, np.where(i > 0, i * (o + so) / (o * si + i * so), 0)


def cells(w, weights=1.0):
    up = w[:, 2] > 0
    weights = np.broadcast_to(weights, len(w))[up]
    return np.histogram2d(w[up, 2], np.abs(np.arctan2(w[up, 1], w[up, 0])), weights=weights, **CELLS)[0] / len(w)


def main(count=1_000_000):
    cosines = (np.arange(40) + 0.5) / 40
    for a in (1.0, 0.6, 0.3, 0.1):
        kept = np.array([single(at(z), a, 200_000)[1].mean() for z in cosines])
        mean_kept = np.sum(kept * cosines) * 2 / 40
        scale = 1 / np.sqrt(kept)
        drawn = [single(at(z), a, 60_000) for z in cosines]
        for _ in range(60):
            other = np.array([1 / np.mean(weight * np.interp(wi[:, 2], cosines, scale)) for wi, weight in drawn])
            scale = np.sqrt(scale * other)
        for degrees in (10, 45, 70, 85):
            wo = at(np.cos(np.radians(degrees)))
            truth = cells(walks(wo, a, count))
            wi, weight = single(wo, a, count)
            e = weight.mean()
            z, phi = np.sqrt(RANDOM.random(count)), 2 * np.pi * RANDOM.random(count)
            s = np.sqrt(1 - z * z)
            lobe = np.stack([s * np.cos(phi), s * np.sin(phi), z], 1)
            lost = (1 - e) * (1 - np.interp(z, cosines, kept)) / (1 - mean_kept)
            both = np.interp(wi[:, 2], cosines, scale) * np.interp(wo[2], cosines, scale)
            ways = {
                "Kulla-Conty": cells(wi, weight) + cells(lobe, lost),
                "1/E": cells(wi, weight) / e,
                "both directions": cells(wi, weight * both),
                "first facet": cells(wi * np.sign(wi[:, 2:]) ** [0, 0, 1]),
            }
            off = {name: 0.5 * np.abs(way - truth).sum() for name, way in ways.items()}
            print(f"alpha {a}, {degrees} degrees, E {e:.3f}:", ", ".join(f"{n} {v:.3f}" for n, v in off.items()))


if __name__ == "__main__":
    main()
