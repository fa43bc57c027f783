"""Cloth on a ball and Cusick's disc: time, stretch and crossings; how both grow with the mesh and with the body's.

    cargo xtask bench cloth            Yugen alone
    cargo xtask bench cloth --peer     beside Blender's cloth and two solvers of Newton, on the same meshes, by the same scorer
    cargo xtask bench cloth --long     and Newton's VBD on the disc and the large sheet, which takes minutes

Blender is `bpy` from PyPI (370 MB to fetch, 1 GB installed), which wants Python 3.11, Newton is `newton` with `warp-lang` (600 MB),
in environments of their own, .venv/blender and .venv/newton. Newton compiles itself for a minute the first time. The scenes are
those of crates/motion/benches/cloth, the tables stand in docs/cloth.md.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import peer

BLENDER = ["bpy==5.0.1", "numpy==1.26.4"]
NEWTON = ["newton==1.8.0", "warp-lang==1.19.0", "numpy==2.4.6"]
# Environment, what is in it, version of Python, script, and the solvers as it and as the tables name them.
PROGRAMS = [
    ("blender", BLENDER, "python3.11", "cloth_blender.py", {
        "blender_self": "Blender 5.0.1", "blender": "Blender 5.0.1, not touching itself",
    }),
    ("newton", NEWTON, sys.executable, "cloth_newton.py", {
        "style3d": "Newton 1.8.0, Style3D", "vbd": "Newton 1.8.0, VBD",
    }),
]
# What is left out unless it may take long.
LONG = [("disc", "vbd"), ("sheet-large", "vbd")]


def main():
    long = "--long" in sys.argv
    tools = []
    with tempfile.TemporaryDirectory() as folder:
        if long or "--peer" in sys.argv:
            cases = peer.bench("yugen-motion", "cloth", "write", folder).split()
            for name, packages, version, script, solvers in PROGRAMS:
                try:
                    python = peer.python(name, packages, version)
                except (SystemExit, subprocess.CalledProcessError) as why:
                    print(f"left out: {packages[0]} cannot be installed ({why})", file=sys.stderr)
                    continue
                for tool, title in solvers.items():
                    for case in cases:
                        if long or (case, tool) not in LONG:
                            print(f"{case}: {title}", file=sys.stderr)
                            command = [python, Path(__file__).with_name(script), folder, case, tool]
                            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
                    tools += [tool, title]
        print(peer.bench("yugen-motion", "cloth", "tables", folder, *tools), end="")


if __name__ == "__main__":
    main()
