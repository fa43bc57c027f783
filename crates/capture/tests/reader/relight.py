"""Relights a .ptm, a .rti or a RelightLab folder: a second reader, which shares nothing with Yugen's own.

Usage: python relight.py PATH X Y Z OUTPUT
Written from the formats' descriptions: Malzbender and Gelb, "Polynomial Texture Map (.ptm) File Format" (version 1.2), the header
of RTIBuilder's HSH files, and RelightLab's info.json. OUTPUT gets the picture as little-endian floats, rows from the top, red,
green and blue of each pixel, 1 being 255. Needs numpy, and Pillow for the folder's JPEGs.
"""
import json
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


def folder(path, light):
    from PIL import Image

    info = json.loads((path / "info.json").read_text())
    count = (info["nplanes"] + 2) // 3
    pictures = [np.asarray(Image.open(path / f"plane_{i}.jpg"), dtype=float) / 255 for i in range(count)]
    material = info["materials"][0]
    scale, bias = (np.array(material[k]).reshape(-1, 3) for k in ("scale", "bias"))
    planes = [(p - b) * s for p, b, s in zip(pictures, bias, scale)]
    x, y, z = light
    if info["type"] == "ptm":
        weights = [1, x, y, x * x, x * y, y * y]
    else:
        weights = harmonics(*light, 16)
    if info["colorspace"] == "rgb":
        return sum(w * p for w, p in zip(weights, planes))
    parts = np.concatenate(planes[1:], axis=-1)
    return (parts @ np.array(weights[: parts.shape[-1]]))[..., None] * planes[0]


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
