"""What the benchmarks share: the environment of the programs that Yugen is compared with, and Yugen's own examples."""

import os
import pathlib
import subprocess
import sys
import venv

ROOT = pathlib.Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv" / "bench"
PACKAGES = ["mitsuba==3.9.1", "numpy", "scipy", "OpenEXR", "pillow", "pyoidn", "flip-evaluator"]


def python():
    """The interpreter that has them, installed from PyPI where it is not there yet."""
    interpreter, done = VENV / "bin" / "python", VENV / "packages"
    if not done.exists() or done.read_text().split() != PACKAGES:
        print("installing", *PACKAGES, "into", VENV.relative_to(ROOT), file=sys.stderr)
        venv.create(VENV, with_pip=True)
        subprocess.run([interpreter, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
        done.write_text("\n".join(PACKAGES))
    return interpreter


def llvm_library():
    """What Mitsuba's llvm variants need, or None."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return os.environ["DRJIT_LIBLLVM_PATH"]
    folders = [pathlib.Path("/usr/lib/x86_64-linux-gnu"), *sorted(pathlib.Path("/usr/lib").glob("llvm-*/lib"))]
    found = [f for folder in folders for f in sorted(folder.glob("libLLVM.so.*"))]
    return str(found[-1]) if found else None


def enter():
    """Goes on in that interpreter."""
    interpreter = python()
    if pathlib.Path(sys.prefix) != VENV:
        library = llvm_library()
        if library:
            os.environ["DRJIT_LIBLLVM_PATH"] = library
        os.execv(interpreter, [str(interpreter), *sys.argv])


def mitsuba():
    """Mitsuba 3 and Dr.Jit, vectorised."""
    import drjit as dr
    import mitsuba as mi

    if not llvm_library():
        sys.exit("no LLVM library found for Mitsuba's llvm_ad_rgb (Debian: apt-get install libllvm19)")
    mi.set_variant("llvm_ad_rgb")
    return mi, dr


def example(package, name, *arguments):
    """What an example program of a package prints."""
    command = ["cargo", "run", "-q", "--profile", "dist", "-p", package, "--example", name, "--", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def words():
    """The arguments that are no options."""
    return [a for a in sys.argv[1:] if not a.startswith("-")]


def data():
    """The folder of scenes and meshes."""
    if "YUGEN_DATA" not in os.environ:
        sys.exit("YUGEN_DATA is not set: it must name the folder that holds mitsuba/, mesh/ and cloth/")
    return pathlib.Path(os.environ["YUGEN_DATA"]).resolve()
