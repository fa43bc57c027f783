"""What the benchmarks share: the environment of the programs that Yugen is compared with, and Yugen's own examples."""

import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv" / "bench"
PACKAGES = ["mitsuba==3.9.1", "numpy", "scipy", "OpenEXR", "pillow", "pyoidn", "flip-evaluator"]


def python(name="bench", packages=PACKAGES, version=sys.executable):
    """The interpreter of an environment that has them, installed from PyPI where it is not there yet. `version`: of Python."""
    folder = VENV.with_name(name)
    interpreter, done = folder / "bin" / "python", folder / "packages"
    if not done.exists() or done.read_text().split() != packages:
        if not shutil.which(version):
            sys.exit(f"{version} is not installed, which {packages[0]} wants")
        print("installing", *packages, "into", folder.relative_to(ROOT), file=sys.stderr)
        subprocess.run([version, "-m", "venv", folder], check=True)
        subprocess.run([interpreter, "-m", "pip", "install", "--quiet", *packages], check=True)
        done.write_text("\n".join(packages))
    return interpreter


def llvm_library():
    """What Mitsuba's llvm variants need, or None."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return os.environ["DRJIT_LIBLLVM_PATH"]
    folders = [pathlib.Path("/usr/lib/x86_64-linux-gnu"), *sorted(pathlib.Path("/usr/lib").glob("llvm-*/lib"))]
    found = [f for folder in folders for f in sorted(folder.glob("libLLVM.so.*"))]
    return str(found[-1]) if found else None


def enter(name="bench", packages=PACKAGES):
    """Goes on in that interpreter."""
    interpreter = python(name, packages)
    if pathlib.Path(sys.prefix) != VENV.with_name(name):
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
    return cargo("run", package, "--example", name, arguments)


def bench(package, name, *arguments):
    """What a bench program of a package prints."""
    return cargo("bench", package, "--bench", name, arguments)


def cargo(verb, package, kind, name, arguments):
    """What a program of a package prints that cargo builds and runs."""
    command = ["cargo", verb, "-q", "--profile", "dist", "-p", package, kind, name, "--", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def words():
    """The arguments that are no options."""
    return [a for a in sys.argv[1:] if not a.startswith("-")]


def data():
    """The folder of scenes and meshes."""
    if "YUGEN_DATA" not in os.environ:
        sys.exit("YUGEN_DATA is not set: it must name the folder that holds mitsuba/, mesh/ and cloth/")
    return pathlib.Path(os.environ["YUGEN_DATA"]).resolve()
