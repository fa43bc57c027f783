"""Scenes as crates/motion/benches/cloth/cases.rs writes them, and what programs leave of them; for the Pythons of both programs."""

import time

import numpy as np


def read(folder, name):
    """Numbers by name, positions, triangles, places in the flat cloth, and the vertices that are held."""
    words = (line.split() for line in (folder / f"{name}.case").read_text().splitlines())
    numbers = {key: [float(v) for v in values] for key, *values in words}
    positions = np.fromfile(folder / f"{name}.positions", np.float32).reshape(-1, 3)
    triangles = np.fromfile(folder / f"{name}.triangles", np.uint32).reshape(-1, 3).astype(np.int32)
    flat = np.fromfile(folder / f"{name}.flat", np.float32).reshape(-1, 2).astype(float)
    return numbers, positions, triangles, flat, np.fromfile(folder / f"{name}.held", np.uint32)


def area(flat, triangles):
    """Of the flat cloth, m²."""
    a, b = np.moveaxis(flat[triangles[:, 1:]] - flat[triangles[:, :1]], 1, 0)
    return 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()


def play(folder, name, tool, numbers, frame, positions):
    """Calls `frame` with the number of each, from 1, and writes NAME-TOOL.seconds, wall and processor time of each, and
    NAME-TOOL.frames: what `positions` gives (three float32 a vertex) after every so many."""
    frames, every = int(numbers["frames"][0]), int(numbers["every"][0])
    with open(folder / f"{name}-{tool}.seconds", "w") as seconds, open(folder / f"{name}-{tool}.frames", "wb") as looks:
        for number in range(1, frames + 1):
            wall, processor = time.perf_counter(), time.process_time()
            frame(number)
            print(time.perf_counter() - wall, time.process_time() - processor, file=seconds)
            if number % every == 0:
                looks.write(positions().astype(np.float32).tobytes())
