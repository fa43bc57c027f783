"""The fit of crates/capture/examples/fit_rate.rs by SciPy, texel by texel, and by NumPy, all texels at once.

    cargo xtask bench fit [SIDE [LIGHTS]]

Same readings, same model, same noise. Both start from the truth, disturbed by a few percent, which spares them the start
that the Rust fit finds for itself.
"""

import time

import peer

if __name__ == "__main__":
    peer.enter()
import numpy as np
from scipy.optimize import least_squares

READINGS = peer.ROOT / "out" / "bench" / "fit"
READINGS.parent.mkdir(parents=True, exist_ok=True)
print(peer.example("yugen-capture", "fit_rate", *(peer.words() + ["64", "64"][len(peer.words()):])[:2], 1, READINGS))
data = np.fromfile(READINGS.with_suffix(".f32"), np.float32).astype(float)
lights, texels = int(data[0]), int(data[1])
light = data[2 : 2 + 3 * lights].reshape(-1, 3)
rest = data[2 + 3 * lights :].reshape(texels, -1)
value, truth = rest[:, :lights], rest[:, lights:]
h = light + [0, 0, 1]
x, y = h[:, 0] / h[:, 2], h[:, 1] / h[:, 2]
k = (h**2).sum(1) / h[:, 2] ** 4
lx, ly, lz = light.T

# rho_d and the amplitude, the normal's slopes, and the logarithm of the quadratic form, as in fit/model.rs.
rho_d, rho_s, n, t, s = truth[:, 0], truth[:, 1], truth[:, 2:5], truth[:, 5:8], truth[:, 8:10]
u = np.cross(n, t)
form = (t[:, :2, None] * t[:, None, :2] / s[:, 0, None, None] ** 2 + u[:, :2, None] * u[:, None, :2] / s[:, 1, None, None] ** 2)
form /= n[:, 2, None, None] ** 2
det = np.sqrt(np.linalg.det(form))
m = np.log(det)
p, q = (form[:, 0, 0] - form[:, 1, 1]) / (2 * det), form[:, 0, 1] / det
r = np.hypot(p, q)
p, q = p * np.arcsinh(r) / r, q * np.arcsinh(r) / r
true = np.stack([rho_d * n[:, 2], np.log(rho_s * det / n[:, 2] ** 2), n[:, 0] / n[:, 2], n[:, 1] / n[:, 2], m, p, q], 1)
rng = np.random.default_rng(1)
start = true + rng.normal(size=true.shape) * [0.01, 0.05, 0.01, 0.01, 0.05, 0.05, 0.05]
weight = 1 / (0.02 * np.maximum(value, 0) + 0.002)


def parts(theta):
    d, la, a, b, m, p, q = (c[..., None] for c in np.moveaxis(theta, -1, 0))
    r = np.sqrt(p * p + q * q + 1e-12)
    c, sh = np.cosh(r), np.sinh(r) / r
    e = np.exp(m)
    p11, p12, p22 = e * (c + sh * p), e * sh * q, e * (c - sh * p)
    mu = np.maximum(lz + a * lx + b * ly, 0)
    g = 1 / (1 + a * x + b * y)
    dx, dy = (x - a) * g, (y - b) * g
    z = p11 * dx * dx + 2 * p12 * dx * dy + p22 * dy * dy
    lobe = np.exp(la) * k * g**4 * np.exp(-z)
    return d, a, b, p, q, r, c, sh, e, p11, p12, p22, mu, g, dx, dy, z, lobe


def residual(theta, value, weight):
    d, *_, mu, _, _, _, _, lobe = parts(theta)
    return (mu * (d + lobe) - value) * weight


def jacobian(theta, value, weight):
    d, a, b, p, q, r, c, sh, e, p11, p12, p22, mu, g, dx, dy, z, lobe = parts(theta)
    lit = mu > 0
    bright = mu * lobe
    ds = (c - sh) / (r * r)
    u, v = p11 * dx + p12 * dy, p12 * dx + p22 * dy
    def form(f11, f12, f22):
        return -bright * (f11 * dx * dx + 2 * f12 * dx * dy + f22 * dy * dy)
    j = [
        mu + 0 * bright,
        bright,
        lit * lx * (d + lobe) + 2 * bright * g * (u + x * (z - 2)),
        lit * ly * (d + lobe) + 2 * bright * g * (v + y * (z - 2)),
        form(p11, p12, p22),
        form(e * (sh * p + ds * p * p + sh), e * ds * p * q, e * (sh * p - ds * p * p - sh)),
        form(e * (sh * q + ds * q * p), e * (ds * q * q + sh), e * (sh * q - ds * q * p)),
    ]
    return np.stack(np.broadcast_arrays(*j), -1) * weight[..., None]


def report(name, theta, texels, seconds):
    error = np.median(np.abs(theta[:texels, 4] - true[:texels, 4]))
    print(f"{name}: {texels / seconds:.0f} texels/s, median error of ln(sigma_x sigma_y) {100 * error:.2f} %")


few = min(texels, 60)
found = start.copy()
begin = time.process_time()
for i in range(few):
    found[i] = least_squares(residual, start[i], jac=jacobian, loss="soft_l1", args=(value[i], weight[i])).x
report("SciPy, texel by texel", found, few, time.process_time() - begin)

theta, damping = start.copy(), np.full(texels, 1e-3)
begin = time.process_time()
res = residual(theta, value, weight)
cost = (res**2).sum(1)
for _ in range(8):
    j = jacobian(theta, value, weight)
    hessian = np.einsum("tli,tlj->tij", j, j, optimize=True)
    gradient = np.einsum("tli,tl->ti", j, res, optimize=True)
    hessian += damping[:, None, None] * np.eye(7) * np.einsum("tii->ti", hessian)[:, :, None]
    trial = theta - np.linalg.solve(hessian, gradient[..., None])[..., 0]
    new = residual(trial, value, weight)
    better = (new**2).sum(1) < cost
    theta[better], res[better] = trial[better], new[better]
    cost = (res**2).sum(1)
    damping = np.where(better, damping / 10, damping * 10)
report("NumPy, all at once, eight steps", theta, texels, time.process_time() - begin)
