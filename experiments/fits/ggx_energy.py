"""The constants of stdlib/core/ggx_energy.impasto: what GGX surfaces lose to second facets, and its mean.

Prints the coefficients and how far the fits are off. Needs numpy; takes a minute.

    python3 experiments/fits/ggx_energy.py

The loss 1 - E(w) is integrated over visible facets (Dupuy and Benyoub 2023) with Smith's height-correlated
shadowing (Heitz 2014). In the space in which the roughness is 1, `t` is the cosine of the view and `p` the
cosine of twice its azimuth. The fit is linear in its coefficients:

    loss = s (t k1 + ... + t^5 k5 + log) + white t log(1 + 1/t),    s = 1 - t,    log ~ t log(1 + 1/t)
    k = c0 + p c1 + p^2 c2, each a polynomial of the mean roughness m and, by d = alpha_x - alpha_y, of d^2

At alpha 1 the loss is exactly t log(1 + 1/t), which is why the logarithm is there. Lawson's iteration weighs the
points until the greatest error is least. Errors may be larger below the truth than above, so that nothing gains light.
"""

import numpy as np
from numpy.polynomial import chebyshev

# Degrees in m by powers of d^2: of the parts of a coefficient by powers of p, and of `white`. Some of the
# coefficients are the same for all azimuths, and for all anisotropies: the fit is no better if they are not.
PARTS = ((6, 3), (4, 2), (2, 1))
WHITE = (6, 3, 1)
NAMES = ("t1", "t2", "t3", "t4", "t5", "log")
TURNING = ("t2", "t4", "log")


def points(count):
    """Evenly spread points of the unit square."""
    i = np.arange(count)
    return np.stack([(0.5 + i * 0.7548776662466927) % 1, (0.5 + i * 0.5698402909980532) % 1], 1)


def loss_of(w, ax, ay, u):
    """1 - E(w), by the facets that `u` chooses."""
    stretched = np.array([w[0] * ax, w[1] * ay, w[2]])
    so = np.linalg.norm(stretched)
    view = stretched / so
    z = (1 - u[:, 1]) * (1 + view[2]) - view[2]
    s, phi = np.sqrt(np.maximum(0, 1 - z * z)), 2 * np.pi * u[:, 0]
    m = np.stack([(s * np.cos(phi) + view[0]) * ax, (s * np.sin(phi) + view[1]) * ay, z + view[2]], 1)
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    wi = 2 * (m @ w)[:, None] * m - w
    si = np.sqrt((ax * wi[:, 0]) ** 2 + (ay * wi[:, 1]) ** 2 + wi[:, 2] ** 2)
    o, i = w[2], wi[:, 2]
    return 1 - np.mean(np.where(i > 0, i * (o + so) / (o * si + i * so), 0))


def chebyshev_nodes(count):
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def table():
    """Rows of alpha_x, alpha_y, p, t and the loss."""
    rows = []
    u = points(1 << 14)
    for a in np.concatenate([[3e-4, 1e-3, 3e-3, 1e-2, 2e-2], np.linspace(0.03, 1, 60)]):
        for t in chebyshev_nodes(48):
            z = np.sqrt(t * t * a * a / (1 - t * t + t * t * a * a))
            rows.append((a, a, 0.0, t, loss_of(np.array([np.sqrt(1 - z * z), 0, z]), a, a, u)))
    u = points(1 << 13)
    for wide in (0.002, 0.04, 0.09, 0.15, 0.22, 0.3, 0.38, 0.46, 0.55, 0.64, 0.73, 0.82, 0.91, 1.0):
        for ratio in (0.095, 0.13, 0.18, 0.25, 0.34, 0.45, 0.58, 0.72, 0.87):
            ax, ay = wide, wide * ratio
            for p in np.cos(np.linspace(0, np.pi, 9)):
                x, y = np.sqrt((1 + p) / 2) / ax, np.sqrt((1 - p) / 2) / ay
                x, y = np.array([x, y]) / np.hypot(x, y)
                a = np.hypot(ax * x, ay * y)
                for t in np.append(chebyshev_nodes(18), 1 - 1e-9):
                    z = np.sqrt(t * t * a * a / (1 - t * t + t * t * a * a))
                    s = np.sqrt(max(0, 1 - z * z))
                    rows.append((ax, ay, p, t, loss_of(np.array([s * x, s * y, z]), ax, ay, u)))
    return np.array(rows)


def design(ax, ay, p, t):
    """A column for each coefficient, and its name: which k, the power of p, the power of d, the degree in m."""
    m, d = (ax + ay) / 2, ax - ay
    of_m = [np.cos(k * np.arccos(np.clip(2 * m - 1, -1, 1))) for k in range(8)]
    s, tail = 1 - t, t * np.log1p(1 / np.maximum(t, 1e-12))
    columns, names = [], []
    for name, base in zip(NAMES, [s * t**k for k in range(1, 6)] + [s * tail]):
        for q, degrees in enumerate(PARTS if name in TURNING else [PARTS[0][:1]]):
            for e, degree in enumerate(degrees):
                for k in range(degree + 1):
                    columns.append(base * p**q * d ** (q + 2 * e) * of_m[k])
                    names.append((name, q, q + 2 * e, k))
    for e, degree in enumerate(WHITE):
        for k in range(degree + 1):
            columns.append(tail * (m * m if e == 0 else d ** (2 * e)) * of_m[k])
            names.append(("white", 0, 2 * e, k))
    return np.stack(columns, 1), names


def lawson(columns, goal, tolerance, rounds):
    """The coefficients whose greatest error, over `tolerance`, is least."""
    weight, best = 1 / tolerance**2, (np.inf, None)
    for _ in range(rounds):
        root = np.sqrt(weight)
        scaled = columns * root[:, None]
        normal = scaled.T @ scaled
        normal[np.diag_indices(len(normal))] *= 1 + 1e-12
        c = np.linalg.lstsq(normal, scaled.T @ (goal * root), rcond=1e-15)[0]
        error = np.abs(columns @ c - goal) / tolerance
        best = min(best, (error.max(), c), key=lambda b: b[0])
        weight = weight * (error / error.max() + 0.01) ** 0.7
        weight /= weight.mean()
    return best[1]


def power_form(names, c):
    """Polynomials in b = 2 m - 1, by name, power of p and power of d."""
    found = {}
    for (name, q, e, k), value in zip(names, c):
        found.setdefault((name, q, e), {})[k] = value
    return {key: np.round(chebyshev.cheb2poly([v[k] for k in sorted(v)]), 4) for key, v in found.items()}


def evaluate(polynomials, x, y, z, ax, ay):
    """The fit, in the form that the library has."""
    m, d = (ax + ay) / 2, ax - ay
    b = 2 * m - 1
    k = {}
    for (name, q, e), p in polynomials.items():
        scale = m * m if name == "white" and e == 0 else d**e
        k[name, q] = k.get((name, q), 0) + scale * np.polyval(p[::-1], b)
    x2, y2 = (ax * x) ** 2, (ay * y) ** 2
    stretch = np.sqrt(x2 + y2 + z * z)
    t, s = z / stretch, (x2 + y2) / (stretch * (stretch + z))
    p = (x2 - y2) / np.maximum(x2 + y2, 1e-30)
    tail = t * np.log1p(1 / np.maximum(t, 1e-12))
    of = lambda n: k[n, 0] + (p * (k[n, 1] + p * k[n, 2]) if n in TURNING else 0)
    steep = sum(of(f"t{j}") * t**j for j in range(1, 6))
    return np.clip(s * (steep + of("log") * tail) + k["white", 0] * tail, 0, 1)


def mean_of(polynomials, ax, ay, azimuths):
    """The mean of the fit by the cosine: Gauss's rule, piece by piece evenly in log(z^2 + c)."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    c = min(ax, ay) ** 2 / 50
    ends = np.linspace(np.log(c), np.log(1 + c), 13)
    u = np.concatenate([(a + b) / 2 + (b - a) / 2 * nodes for a, b in zip(ends, ends[1:])])
    w = np.concatenate([(b - a) / 2 * weights for a, b in zip(ends, ends[1:])])
    z2 = np.clip(np.exp(u) - c, 0, 1)
    phi = (np.arange(azimuths) + 0.5) / azimuths * np.pi / 2
    s = np.sqrt(1 - z2)[:, None]
    value = evaluate(polynomials, s * np.cos(phi), s * np.sin(phi), np.sqrt(z2)[:, None], ax, ay)
    return np.sum(value.mean(1) * np.exp(u) * w)


def fit_mean(polynomials):
    """The mean over m^2 as polynomials in b and, times log m, in m, by powers of (d / m)^2."""
    rows = []
    for wide in np.concatenate([np.geomspace(1e-4, 0.05, 14), np.linspace(0.07, 1, 22)]):
        for ratio in (1, 0.93, 0.85, 0.72, 0.58, 0.45, 0.34, 0.25, 0.18, 0.13, 0.095):
            ax, ay = wide, max(wide * ratio, 1e-4)
            rows.append((ax, ay, mean_of(polynomials, ax, ay, 17 if ratio < 1 else 1)))
    ax, ay, mean = np.array(rows).T
    m, d = (ax + ay) / 2, ax - ay
    columns, names = [], []
    for power, degree, logs in ((0, 6, 3), (1, 3, 2), (2, 3, 2)):
        rho = (d / m) ** (2 * power) * m * m
        for k in range(degree + 1):
            columns.append(rho * np.cos(k * np.arccos(np.clip(2 * m - 1, -1, 1))))
            names.append((power, "b", k))
        for k in range(logs):
            columns.append(rho * np.log(m) * m**k)
            names.append((power, "log m", k))
    columns = np.stack(columns, 1)
    # As light: an error of the mean is one of what is lost at most.
    most = np.where(m < 0.3, 0.12 + 0.5 * m, 0.7)
    c = lawson(columns, mean, np.where(d == 0, 2e-4, 6e-4) / most * mean, 120)
    off = (columns @ c / mean - 1) * most
    print(f"mean: off by at most {np.abs(off[d == 0]).max():.5f} of the light, {np.abs(off).max():.5f} with anisotropy")
    for power in range(3):
        of = {kind: [v for (q, n, _), v in zip(names, c) if (q, n) == (power, kind)] for kind in ("b", "log m")}
        print(f"mean (d/m)^{2 * power}: {printed(chebyshev.cheb2poly(of['b']), 'b')}, times log m: {printed(of['log m'], 'm')}")


def printed(polynomial, variable):
    """By Horner's rule."""
    text = f"{polynomial[-1]:.4f}"
    for c in polynomial[-2::-1]:
        text = f"{c:.4f} + {variable} * ({text})" if "+" in text else f"{c:.4f} + {variable} * {text}"
    return text


def main():
    ax, ay, p, t, loss = table().T
    columns, names = design(ax, ay, p, t)
    m, d = (ax + ay) / 2, ax - ay
    even = d == 0
    tolerance = np.where(even, 0.0011, 0.0046)
    least = np.minimum(1, loss / 0.02)
    turned = np.minimum(0.0037 * np.minimum(1, 4 * np.abs(d) / m), 0.12 * loss) + 0.0003 * least
    polynomials = power_form(names, lawson(columns, loss - np.where(even, 0.0006 * least, turned), tolerance, 250))
    for key, polynomial in polynomials.items():
        print(*key, printed(polynomial, "b"))
    cosine, s = t / np.sqrt(1 + 0 * t), np.sqrt(1 - t * t)
    x, y = s * np.sqrt((1 + p) / 2) / ax, s * np.sqrt((1 - p) / 2) / ay
    length = np.sqrt(x * x + y * y + cosine * cosine)
    off = evaluate(polynomials, x / length, y / length, cosine / length, ax, ay) - loss
    print(f"isotropic: {off[even].min():.5f} to {off[even].max():.5f}")
    print(f"with anisotropy: {off[~even].min():.5f} to {off[~even].max():.5f}")
    fit_mean(polynomials)


if __name__ == "__main__":
    main()
