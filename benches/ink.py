"""Lines of Yugen's ink room beside Blender's Line Art and Freestyle, by one scorer, on the same meshes, views and pixels.

    cargo xtask bench ink

Blender is `bpy` from PyPI (370 MB to fetch, 1 GB installed), which wants Python 3.11, in an environment of its own, .venv/blender. The shapes and their true
contours are those of crates/ink/tests/analytic; the tables stand in docs/ink.md.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import peer

PACKAGES = ["bpy==5.0.1", "numpy==1.26.4"]


def main():
    blender = peer.python("blender", PACKAGES, "python3.11")
    script = Path(__file__).with_name("ink_peers.py")
    with tempfile.TemporaryDirectory() as folder:
        for line in peer.example("yugen-ink", "line_peers", folder, "write").splitlines():
            case, *tools = line.split()
            for tool in tools:
                print(f"{tool}: {case}", file=sys.stderr)
                subprocess.run([blender, script, folder, case, tool], check=True, stdout=subprocess.DEVNULL)
        print(peer.example("yugen-ink", "line_peers", folder, "score"), end="")


if __name__ == "__main__":
    main()
