"""Texels a second of core time for the fit of PTM and HSH, Yugen beside numpy, on stacks of the same size, in turn.

    cargo xtask bench rti [SIDE] [LIGHTS]

numpy fits the same basis with `lstsq`, as a script would, and with a pseudo-inverse and one product in
single precision, as a good one would.
"""
import time

import peer

if __name__ == "__main__":
    peer.enter()
import numpy as np

SIDE, LIGHTS = ([int(a) for a in peer.words()] + [512, 64][len(peer.words()):])[:2]


def yugen():
    """Name of the basis to M texels/s, linear values."""
    out = peer.example("yugen-capture", "rti_rate", SIDE, LIGHTS)
    rates = {}
    for line in out.splitlines()[1:]:
        if " linear " in line:
            name, rest = line.split(" linear ")
            rates[name.strip()] = float(rest.split()[0])
    return rates


def rate(fit, values, basis):
    """M texels a second of core time, best of three."""
    best = float("inf")
    for _ in range(3):
        start = time.process_time()
        fit(basis, values)
        best = min(best, time.process_time() - start)
    return values.shape[1] / 3 / best / 1e6


def lstsq(basis, values):
    return np.linalg.lstsq(basis, values, rcond=None)[0]


def product(basis, values, into={}):
    """Into memory that serves again, as Yugen's bands do."""
    out = into.setdefault(basis.shape[1], np.empty((basis.shape[1], values.shape[1]), np.float32))
    return np.matmul(np.linalg.pinv(basis).astype(np.float32), values, out=out)


def main():
    rng = np.random.default_rng(1)
    values = rng.random((LIGHTS, SIDE * SIDE * 3), dtype=np.float32)
    print(f"{SIDE}x{SIDE} texels, {LIGHTS} lights; M texels/s of core time")
    print(f"{'':8} {'yugen':>8} {'lstsq':>8} {'ratio':>7} {'pinv':>8} {'ratio':>7}")
    for name, ours in yugen().items():
        terms = 6 if name == "PTM" else int(name.split()[1])
        basis = rng.random((LIGHTS, terms)).astype(np.float32)
        a, b = rate(lstsq, values, basis), rate(product, values, basis)
        print(f"{name:8} {ours:8.2f} {a:8.2f} {ours / a:7.1f} {b:8.2f} {ours / b:7.2f}")


if __name__ == "__main__":
    main()
