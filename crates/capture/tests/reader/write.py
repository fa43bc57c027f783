"""Writes what RelightLab and HP's tools write and Yugen only reads: a second writer, which shares nothing with Yugen.

Usage: python write.py KIND PATH
KIND is rbf, bilinear, rbf-ycc, bilinear-ycc, ycc, luminance or tiles. Written from the formats' descriptions, as relight.py is.
Needs numpy and Pillow.
"""
import io
import json
import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 93, 61


def waves(count):
    """Slow waves from 0 to 1, as JPEG likes them, which no reversal of rows, columns or planes leaves the same."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return np.stack([0.5 + 0.45 * np.sin(0.11 * x + 0.07 * y + 1.3 * k) * (0.5 + 0.5 * y / HEIGHT) for k in range(count)], -1)


def jpeg(pixels):
    from PIL import Image

    out = io.BytesIO()
    image = Image.fromarray(np.rint(255 * np.clip(pixels, 0, 1)).astype(np.uint8))
    # The planes are no colours: not subsampled.
    image.save(out, "JPEG", quality=97, subsampling=0)
    return out.getvalue()


def triples(planes):
    planes = np.concatenate([planes, np.zeros(planes.shape[:2] + (-planes.shape[-1] % 3,))], -1)
    return [planes[..., i : i + 3] for i in range(0, planes.shape[-1], 3)]


def lights(count):
    i = np.arange(count)
    z = 1 - 0.8 * (i + 0.5) / count
    r = np.sqrt(1 - z * z)
    return np.round(np.stack([r * np.cos(2.4 * i), r * np.sin(2.4 * i), z], -1), 3)


def components(path, kind, ycc):
    rng = np.random.default_rng(5)
    planes = 9
    info = {"width": WIDTH, "height": HEIGHT, "format": "jpg", "type": kind, "colorspace": "mycc" if ycc else "mrgb"}
    if kind == "rbf":
        info["sigma"] = 0.2
        info["lights"] = lights(40).ravel().tolist()
        count = 40
    else:
        info["resolution"] = 6
        count = 36
    if ycc:
        info["yccplanes"] = [5, 2, 2]
    else:
        info["nplanes"] = planes
    info["quality"] = 97
    mean = rng.integers(0, 256, (1, count, 3))
    codes = rng.integers(0, 255, (planes, count, 3))
    info["materials"] = [{
        "range": rng.uniform(300, 900, planes).round(3).tolist(),
        "scale": rng.uniform(1, 2, planes).round(5).tolist(),
        "bias": rng.uniform(0.1, 0.6, planes).round(6).tolist(),
    }]
    codes = np.concatenate([mean, codes])
    if kind == "rbf":
        # As older folders have it.
        codes.astype(np.uint8).tofile(path / "materials.bin")
    else:
        info["basis"] = codes.ravel().tolist()
    for i, three in enumerate(triples(waves(planes))):
        (path / f"plane_{i}.jpg").write_bytes(jpeg(three))
    (path / "info.json").write_text(json.dumps(info))


def ycc(path):
    planes = waves(18)
    rng = np.random.default_rng(6)
    scale, bias = rng.uniform(0.5, 1.5, 18).round(4), rng.uniform(0, 0.5, 18).round(4)
    scale[1:3], bias[1:3] = 0.4, -0.8
    info = {"width": WIDTH, "height": HEIGHT, "type": "ptm", "colorspace": "ycc", "nplanes": 18,
            "materials": [{"scale": scale.tolist(), "bias": bias.tolist()}]}
    for i, three in enumerate(triples(planes)):
        (path / f"plane_{i}.jpg").write_bytes(jpeg(three))
    (path / "info.json").write_text(json.dumps(info))


def tiles(path):
    """An interleaved archive of HSH with tiles of 32, smallest first."""
    from PIL import Image

    info = {"width": WIDTH, "height": HEIGHT, "format": "jpg", "type": "hsh", "colorspace": "rgb", "nplanes": 12,
            "materials": [{"scale": [1.2] * 12, "bias": [0.3] * 12}]}
    pictures = [np.rint(255 * t).astype(np.uint8) for t in triples(waves(12))]
    data, offsets, levels = b"", [0], 3
    for level in reversed(range(levels)):
        size = WIDTH >> level, HEIGHT >> level
        small = [np.asarray(Image.fromarray(p).resize(size, Image.BOX)) / 255 for p in pictures]
        for y in range(0, size[1], 32):
            for x in range(0, size[0], 32):
                for p in small:
                    data += jpeg(p[y : y + 32, x : x + 32])
                    offsets.append(len(data))
    (path / "planes.tzb").write_bytes(data)
    (path / "planes.tzi").write_text(json.dumps({
        "tilesize": 32, "overlap": 0, "format": "jpg", "width": WIDTH, "height": HEIGHT, "nlevels": levels,
        "mode": "interleaved", "stride": 4, "offsets": offsets}))
    (path / "info.json").write_text(json.dumps(info))


def luminance(path):
    body = np.rint(255 * waves(8)).astype(np.uint8)
    header = f"PTM_1.2\nPTM_FORMAT_LUM\n{WIDTH}\n{HEIGHT}\n.5 .4 .6 .3 .7 1.5\n128 120 90 100 110 20\n"
    path.write_bytes(header.encode() + body[::-1].tobytes())


def main():
    kind, path = sys.argv[1], Path(sys.argv[2])
    if kind == "luminance":
        return luminance(path)
    path.mkdir(parents=True, exist_ok=True)
    if kind in ("ycc", "tiles"):
        return {"ycc": ycc, "tiles": tiles}[kind](path)
    base, _, suffix = kind.partition("-")
    components(path, base, suffix == "ycc")


if __name__ == "__main__":
    main()
