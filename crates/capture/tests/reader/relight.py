"""Relights a .ptm, a .rti or a RelightLab folder: a second reader, which shares nothing with Yugen's own.

Usage: python relight.py PATH X Y Z OUTPUT
Written from the formats' descriptions: Malzbender and Gelb, "Polynomial Texture Map (.ptm) File Format" (version 1.2), the header
of RTIBuilder's HSH files, RelightLab's info.json, and Deep Zoom's and RelightLab's own tiles. OUTPUT gets the picture as little-endian floats, rows from the top, red,
green and blue of each pixel, 1 being 255. Needs numpy, and Pillow for the folder's JPEGs.
"""
import io
import json
import re
import sys
from pathlib import Path

import numpy as np


def polynomial(u, v):
    """In the order of .ptm files."""
    return np.array([u * u, v * v, u * v, u, v, 1.0])


def harmonics(x, y, z, count):
    """As HSH viewers evaluate them, by polar angle and azimuth."""
    phi = np.arctan2(y, x)
    c = z
    root = np.sqrt(c - c**2)
    values = [
        1 / np.sqrt(2 * np.pi),
        np.sqrt(6 / np.pi) * np.cos(phi) * root,
        np.sqrt(3 / (2 * np.pi)) * (-1 + 2 * c),
        np.sqrt(6 / np.pi) * root * np.sin(phi),
        np.sqrt(30 / np.pi) * np.cos(2 * phi) * (-c + c**2),
        np.sqrt(30 / np.pi) * np.cos(phi) * (-1 + 2 * c) * root,
        np.sqrt(5 / (2 * np.pi)) * (1 - 6 * c + 6 * c**2),
        np.sqrt(30 / np.pi) * (-1 + 2 * c) * root * np.sin(phi),
        np.sqrt(30 / np.pi) * (-c + c**2) * np.sin(2 * phi),
        2 * np.sqrt(35 / np.pi) * np.cos(3 * phi) * (c - c**2) ** 1.5,
        np.sqrt(210 / np.pi) * np.cos(2 * phi) * (-1 + 2 * c) * (-c + c**2),
        2 * np.sqrt(21 / np.pi) * np.cos(phi) * root * (1 - 5 * c + 5 * c**2),
        np.sqrt(7 / (2 * np.pi)) * (-1 + 12 * c - 30 * c**2 + 20 * c**3),
        2 * np.sqrt(21 / np.pi) * root * (1 - 5 * c + 5 * c**2) * np.sin(phi),
        np.sqrt(210 / np.pi) * (-1 + 2 * c) * (-c + c**2) * np.sin(2 * phi),
        2 * np.sqrt(35 / np.pi) * (c - c**2) ** 1.5 * np.sin(3 * phi),
    ]
    return np.array(values[:count])


def ptm(data, light):
    lines = data.split(b"\n", 6)
    version, layout = (line.decode().strip() for line in lines[:2])
    assert version == "PTM_1.2", version
    width, height = int(lines[2]), int(lines[3])
    scale, bias = (np.array(line.split(), dtype=float) for line in lines[4:6])
    body = np.frombuffer(lines[6], dtype=np.uint8).astype(float)
    weights = polynomial(light[0], light[1])
    texels = width * height
    if layout == "PTM_FORMAT_RGB":
        blocks = body.reshape(3, height, width, 6)
        colour = np.moveaxis(((blocks - bias) * scale) @ weights, 0, -1)
    elif layout == "PTM_FORMAT_LUM":
        texel = body.reshape(height, width, 8)
        luminance = ((texel[..., :6] - bias) * scale) @ weights
        cr, cb = texel[..., 6] - 128, texel[..., 7] - 128
        colour = np.stack([luminance + 1.402 * cr, luminance - 0.344136 * cb - 0.714136 * cr, luminance + 1.772 * cb], -1)
    else:
        assert layout == "PTM_FORMAT_LRGB", layout
        luminance = ((body[: 6 * texels].reshape(height, width, 6) - bias) * scale) @ weights
        colour = luminance[..., None] / 255 * body[6 * texels :].reshape(height, width, 3)
    return colour[::-1] / 255


def rti(data, light):
    lines = data.split(b"\n", 4)
    assert lines[0].strip() == b"#HSH1.2" and int(lines[1]) == 3
    width, height, colours = map(int, lines[2].split())
    terms, kind, size = map(int, lines[3].split())
    assert (colours, kind, size) == (3, 2, 1)
    ranges = np.frombuffer(lines[4][: 8 * terms], dtype="<f4").astype(float).reshape(2, terms)
    body = np.frombuffer(lines[4][8 * terms :], dtype=np.uint8).reshape(height, width, 3, terms)
    return (body / 255 * ranges[0] + ranges[1]) @ harmonics(*light, terms)


def picture(data):
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(data)), dtype=float)[..., :3] / 255


def join(get, width, height, side, overlap=0):
    """A picture of its tiles; get(x, y) gives the bytes of one."""
    out = np.full((height, width, 3), np.nan)
    for y in range(-(-height // side)):
        for x in range(-(-width // side)):
            tile = picture(get(x, y))
            left, top = max(x * side - overlap, 0), max(y * side - overlap, 0)
            out[top : top + tile.shape[0], left : left + tile.shape[1]] = tile
    assert np.isfinite(out).all()
    return out


def archived(index, data, number):
    """One picture of a .tzi and a .tzb."""
    info = json.loads(index.read_text())
    stride, offsets, side = info.get("stride", 1), info["offsets"], info["tilesize"]
    size = info["width"], info["height"]
    # All sizes from the smallest on: halved, and rounded down.
    counts = []
    for level in range(info["nlevels"]):
        w, h = (max(n >> level, 1) for n in size)
        counts.append((-(-w // side)) * (-(-h // side)))
    assert sum(counts) * stride == len(offsets) - 1, (counts, stride, len(offsets))
    assert offsets[-1] == len(data)
    across, first = -(-size[0] // side), sum(counts[1:])

    def get(x, y):
        i = (first + y * across + x) * stride + number
        return data[offsets[i] : offsets[i + 1]]

    return join(get, *size, side, info.get("overlap", 0))


def plane(path, number, suffix):
    """The three planes of a picture, however it is kept."""
    name = f"plane_{number}"
    if (path / f"{name}.{suffix}").exists():
        return picture((path / f"{name}.{suffix}").read_bytes())
    if (path / "planes.tzi").exists():
        return archived(path / "planes.tzi", (path / "planes.tzb").read_bytes(), number)
    if (path / f"{name}.tzi").exists():
        return archived(path / f"{name}.tzi", (path / f"{name}.tzb").read_bytes(), 0)
    text = (path / f"{name}.dzi").read_text()
    width, height, side, overlap = (int(re.search(f'{k}="(\\d+)"', text)[1]) for k in ("Width", "Height", "TileSize", "Overlap"))
    files = path / f"{name}_files"
    level = max((int(f.name) for f in files.iterdir() if f.is_dir()))
    return join(lambda x, y: (files / f"{level}/{x}_{y}.{suffix}").read_bytes(), width, height, side, overlap)


def between(info, light):
    """What each light counts between which colours are known."""
    if info["type"] == "rbf":
        lights = np.array(info["lights"], dtype=float).reshape(-1, 3)
        weights = np.exp(-((lights - light) ** 2).sum(-1) / info.get("sigma", 0.125) ** 2)
        weights /= weights.sum()
        weights[weights <= 0.001] = 0
        return weights / weights.sum()
    side = info["resolution"]
    x, y, z = np.array(light) / np.abs(light).sum()
    u, v = ((n + 1) / 2 * (side - 1) for n in (x + y, y - x))
    i, j = (int(min(side - 2, max(0, np.floor(n)))) for n in (u, v))
    weights = np.zeros((side, side))
    for di, dj in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weights[j + dj, i + di] = (u - i if di else 1 - u + i) * (v - j if dj else 1 - v + j)
    return weights.ravel()


def folder(path, light):
    info = json.loads((path / "info.json").read_text())
    space = info["colorspace"]
    nplanes = sum(info["yccplanes"]) if space == "mycc" else info["nplanes"]
    count = (nplanes + 2) // 3
    pictures = np.concatenate([plane(path, i, info.get("format", "jpg")) for i in range(count)], axis=-1)[..., :nplanes]
    material = info["materials"][0]
    planes = (pictures - np.array(material["bias"])) * np.array(material["scale"])
    x, y, z = light
    if info["type"] == "ptm":
        weights = np.array([1, x, y, x * x, x * y, y * y])
    elif info["type"] == "hsh":
        weights = harmonics(*light, 16)
    if space == "rgb":
        terms = nplanes // 3
        return sum(weights[t] * planes[..., 3 * t : 3 * t + 3] for t in range(terms))
    if space == "lrgb":
        return (planes[..., 3:] @ weights[: nplanes - 3])[..., None] * pictures[..., :3]
    if space == "ycc":
        luminance = planes[..., ::3] @ weights[: nplanes // 3]
        cb, cr = planes[..., 1] - 0.5, planes[..., 2] - 0.5
        return np.stack([luminance + 1.402 * cr, luminance - 0.344136 * cb - 0.714136 * cr, luminance + 1.772 * cb], -1)
    # Codes of the shared colour, then of each plane's, under each light.
    codes = np.array(info["basis"] if "basis" in info else np.fromfile(path / "materials.bin", np.uint8), dtype=float)
    codes = codes.reshape(nplanes + 1, -1, 3)
    scale = np.array(material["range"])[:, None, None]
    colours = np.concatenate([codes[:1] / 255, (codes[1:] - 127) / scale])
    colours = np.einsum("plc,l->pc", colours, between(info, light))
    if space == "mrgb":
        return planes @ colours[1:] + colours[0]
    chroma = info["yccplanes"][1]
    out = np.broadcast_to(colours[0], planes.shape[:2] + (3,)).copy()
    for p in range(nplanes):
        channel = p % 3 if p < 3 * chroma else 0
        out[..., channel] += planes[..., p] * colours[p + 1, channel]
    luma, orange, green = np.moveaxis(out, -1, 0)
    g = luma + green / 2
    b = luma - green / 2 - orange / 2
    return np.stack([b + orange, g, b], -1)


def main():
    path = Path(sys.argv[1])
    light = [float(v) for v in sys.argv[2:5]]
    if path.is_dir():
        colour = folder(path, light)
    else:
        data = path.read_bytes()
        colour = (ptm if data.startswith(b"PTM") else rti)(data, light)
    np.ascontiguousarray(colour, dtype="<f4").tofile(sys.argv[5])


if __name__ == "__main__":
    main()
