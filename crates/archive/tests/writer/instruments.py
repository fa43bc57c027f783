"""Writes BRDFs known in closed form as instruments and the programs beside them write them, and judges what a reader
made of the files: a second implementation of each format, which shares nothing with Yugen.

Usage: python instruments.py write FOLDER
       python instruments.py check FOLDER

`write` writes KIND.dat for each of KINDS below; `check` reads what was read of it from KIND.f32: rows of nine
little-endian f32, to the light, to the eye, f in 1/sr of linear sRGB. It prints as JSON, by kind, how many readings the
file should give, how many there are, and by how much they are off: the largest |f - truth| / truth, and likewise of the
truth with light and eye exchanged (`swapped`) or mirrored (`mirrored`), which a reader that knows which is which is far
from.

Written from: Radiance's genBSDF and bsdf_m.c, bsdf_t.c (WINDOW XML as Klems matrices and tensor trees), Zemax's article
"Tabular BSDF data file format", ASTM E1392 and the files of Cornell's Program of Computer Graphics, ALTA's params.cpp,
and the reader that the UTIA BRDF database offers. Needs numpy.
"""
import json
import sys
from pathlib import Path

import numpy as np

RED = np.array([0.8, 0.5, 0.2])
XYZ_OF_SRGB = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)


def unit(*v):
    return np.array(v, float) / np.linalg.norm(v)


def spherical(theta, phi):
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


# --- BRDFs -----------------------------------------------------------------------------------------------------------


def lambert(wi, wo):
    return np.full(wi.shape[:-1], 0.5 / np.pi)


def ward(wi, wo, n, t, sx, sy):
    """Ward 1992 without its ground, about the normal n with the grain t."""
    b = np.cross(n, t)
    h = wi + wo
    ci, co = np.maximum(wi @ n, 1e-3), np.maximum(wo @ n, 1e-3)
    slope = ((h @ t / sx) ** 2 + (h @ b / sy) ** 2) / (h @ n) ** 2
    return np.exp(-slope) / (4 * np.pi * sx * sy * np.sqrt(ci * co))


def ggx(wi, wo, a):
    """Trowbridge and Reitz with Smith's masking of light and eye, without Fresnel."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    d = a * a / (np.pi * (h[..., 2] ** 2 * (a * a - 1) + 1) ** 2)
    g = lambda c: 2 * c / (c + np.sqrt(a * a + (1 - a * a) * c * c))
    ci, co = wi[..., 2], wo[..., 2]
    return d * g(ci) * g(co) / (4 * ci * co)


def even(wi, wo):
    """Isotropic: GGX over a ground that light and eye see differently, so that neither passes for the other."""
    return 0.2 / np.pi * (1.2 - 0.7 * wi[..., 2] ** 2) + 0.3 * ggx(wi, wo, 0.3)


def grained(wi, wo):
    """With a grain 25 degrees off +x on facets that lean: no turn, no mirror, no exchange leaves it the same."""
    n = unit(0.15, 0.25, 1)
    t = np.cross(np.cross(n, unit(np.cos(0.44), np.sin(0.44), 0)), n)
    ground = 0.15 / np.pi * (1 + 0.5 * wi[..., 0] - 0.4 * wo[..., 1])
    return ground + 0.3 * ward(wi, wo, n, t / np.linalg.norm(t), 0.5, 0.25)


# --- LBNL WINDOW XML -------------------------------------------------------------------------------------------------

KLEMS = {
    "LBNL/Klems Full": ([0, 5, 15, 25, 35, 45, 55, 65, 75, 90], [1, 8, 16, 20, 24, 24, 24, 16, 12]),
    "LBNL/Klems Half": ([0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90], [1, 8, 12, 16, 20, 12, 4]),
    "LBNL/Klems Quarter": ([0, 9, 27, 46, 66, 90], [1, 8, 12, 12, 8]),
    "House of nine": ([0, 30, 90], [1, 8]),
}


class Klems:
    """Patches by number; directions are those of Radiance's exiting front, z up."""

    def __init__(self, name):
        self.edges, self.counts = np.radians(KLEMS[name][0]), KLEMS[name][1]
        self.rings = [(r, k) for r, n in enumerate(self.counts) for k in range(n)]

    def number(self, w):
        theta, phi = np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2]), np.arctan2(w[..., 1], w[..., 0])
        ring = np.clip(np.searchsorted(self.edges, theta, "right") - 1, 0, len(self.counts) - 1)
        counts = np.array(self.counts)[ring]
        first = np.concatenate([[0], np.cumsum(self.counts)])[ring]
        return first + np.floor(phi / (2 * np.pi) * counts + 0.5).astype(int) % counts

    def points(self, order):
        """Directions and weights of a rule that means over each patch, by projected solid angle."""
        x, w = np.polynomial.legendre.leggauss(order)
        x, w = 0.5 * (x + 1), 0.5 * w
        where, weight = [], []
        for r, k in self.rings:
            # d(cos theta)^2 dphi is the projected solid angle; the pole's patch is a cap.
            low, high = np.cos(self.edges[r]) ** 2, np.cos(self.edges[r + 1]) ** 2
            theta = np.arccos(np.sqrt(low + (high - low) * x))
            around = 3 if self.counts[r] > 1 else 24
            xp, wp = (x, w) if around == 3 else ((np.arange(24) + 0.5) / 24, np.full(24, 1 / 24))
            phi = 2 * np.pi / self.counts[r] * (k - 0.5 + xp)
            where.append(spherical(theta[:, None], phi[None]).reshape(-1, 3))
            weight.append((w[:, None] * wp[None]).ravel())
        return where, weight


def klems_matrix(name, f, front):
    """[outgoing, incident]; the surface's frame is that of whom it faces, x to the right, y up."""
    where, weight = Klems(name).points(4)
    back = np.array([-1.0, 1, 1]) if front else np.ones(3)
    # Light of patch i travels there: it comes from the opposite azimuth.
    eyes, lights = [w * back for w in where], [w * back * [-1, -1, 1] for w in where]
    all_eyes = np.concatenate(eyes)
    ends = np.cumsum([len(e) for e in eyes])[:-1]
    matrix = np.empty((len(eyes), len(lights)))
    for i, (light, share) in enumerate(zip(lights, weight)):
        values = f(light[:, None], all_eyes[None])
        over_light = share @ values
        matrix[:, i] = [w @ v for w, v in zip(weight, np.split(over_light, ends))]
    return matrix


def klems_truth(name, front, f, wi, wo):
    basis = Klems(name)
    back = np.array([-1.0, 1, 1]) if front else np.ones(3)
    return klems_matrix(name, f, front)[basis.number(wo * back), basis.number(wi * back * [-1, -1, 1])]


def window(structure, bases, blocks):
    """blocks: (wavelength, direction, basis lines, data as text)."""
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>\n<WindowElement xmlns="http://windows.lbl.gov">',
        "<WindowElementType>System</WindowElementType>\n<Optical>\n<Layer>\n<Material><Name>known</Name></Material>",
        f"<DataDefinition>\n<IncidentDataStructure>{structure}</IncidentDataStructure>\n{bases}</DataDefinition>",
    ]
    for wavelength, direction, basis, data in blocks:
        parts.append(
            f'<WavelengthData>\n<LayerNumber>System</LayerNumber>\n<Wavelength unit="Integral">{wavelength}</Wavelength>\n'
            f"<WavelengthDataBlock>\n<WavelengthDataDirection>{direction}</WavelengthDataDirection>\n{basis}"
            f"<ScatteringDataType>BRDF</ScatteringDataType>\n<ScatteringData>\n{data}</ScatteringData>\n"
            "</WavelengthDataBlock>\n</WavelengthData>"
        )
    return "\n".join(parts) + "\n</Layer>\n</Optical>\n</WindowElement>\n"


def basis_block(name):
    edges, counts = KLEMS[name]
    blocks = "".join(
        f"<AngleBasisBlock><Theta>{0.5 * (a + b) if a else 0}</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{a}"
        f"</LowerTheta><UpperTheta>{b}</UpperTheta></ThetaBounds></AngleBasisBlock>\n"
        for a, b, n in zip(edges, edges[1:], counts)
    )
    return f"<AngleBasis><AngleBasisName>{name}</AngleBasisName>\n{blocks}</AngleBasis>\n"


def write_klems(path, name, front, rows=False, colour=False):
    columns = f"<ColumnAngleBasis>{name}</ColumnAngleBasis>\n<RowAngleBasis>{name}</RowAngleBasis>\n"
    text = lambda m: "\n".join(",\t".join(f"{v:.7e}" for v in row) for row in m) + "\n"
    matrix = klems_matrix(name, grained, front)
    if rows:
        matrix = matrix.T
    side = "Reflection Front" if front else "Reflection Back"
    # What goes through stands first in such files, and is another thing.
    blocks = [("Visible", "Transmission Front", columns, text(np.full(matrix.shape, 7.0)))]
    xyz = xyz_of(RED) if colour else np.ones(3)
    names = {0: "CIE-X", 1: "Visible", 2: "CIE-Z"} if colour else {1: "Visible"}
    blocks += [(names[c], side, columns, text(xyz[c] * matrix)) for c in names]
    path.write_text(window("Rows" if rows else "Columns", basis_block(name), blocks))


# --- tensor trees ----------------------------------------------------------------------------------------------------


def square_of_disc(x, y):
    """Shirley and Chiu 1997, from the disc to the unit square."""
    r, phi = np.hypot(x, y), np.arctan2(y, x)
    phi = np.where(phi < -np.pi / 4, phi + 2 * np.pi, phi)
    q = np.pi / 4
    region = np.clip(np.floor((phi + q) / (2 * q)), 0, 3).astype(int)
    a = np.choose(region, [r, (2 * q - phi) * r / q, -r, (phi - 6 * q) * r / q])
    b = np.choose(region, [phi * r / q, r, (4 * q - phi) * r / q, -r])
    return 0.5 * (a + 1), 0.5 * (b + 1)


def disc_of_square(x, y):
    a, b = 2 * np.asarray(x, float) - 1, 2 * np.asarray(y, float) - 1
    q = np.pi / 4
    with np.errstate(divide="ignore", invalid="ignore"):
        east = np.abs(a) > np.abs(b)
        r = np.where(east, a, b)
        phi = np.where(east, q * b / a, np.where(b == 0, 0, 2 * q - q * a / b))
    return r * np.cos(phi), r * np.sin(phi)


def lift(x, y):
    return np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 0))], -1)


def place_in_tree(wi, wo, dimensions, front):
    """Where Radiance looks a pair of directions up."""
    back = np.array([-1.0, 1, 1]) if front else np.ones(3)
    light, eye = wi * back, wo * back
    if dimensions == 4:
        return np.stack([*square_of_disc(-light[:, 0], -light[:, 1]), *square_of_disc(eye[:, 0], eye[:, 1])], -1)
    turn = -np.arctan2(-light[:, 1], -light[:, 0])
    x = np.cos(turn) * eye[:, 0] - np.sin(turn) * eye[:, 1]
    y = np.sin(turn) * eye[:, 0] + np.cos(turn) * eye[:, 1]
    return np.stack([0.5 - 0.5 * np.hypot(light[:, 0], light[:, 1]), *square_of_disc(x, y)], -1)


def directions_in_tree(place, front):
    if len(place) == 4:
        light, eye = lift(*disc_of_square(place[0], place[1])), lift(*disc_of_square(place[2], place[3]))
        light = light * [-1, -1, 1]
    else:
        sine = 1 - 2 * place[0]
        light, eye = lift(np.array(-sine), np.array(0.0)), lift(*disc_of_square(place[1], place[2]))
    back = np.array([-1.0, 1, 1]) if front else np.ones(3)
    return light * back, eye * back


def leaf(low, width, front, f):
    """The value in the middle of a cell."""
    wi, wo = directions_in_tree([c + 0.5 * width for c in low], front)
    return float(f(wi[None], wo[None])[0]) if len(low) == 4 or low[0] + 0.5 * width < 0.5 else 0.0


def tree(low, width, depth, front, f):
    """Text, and the cells. Half of the branches split to single values, half are grids, so that both are met."""
    n = len(low)
    # Cells of a TensorTree3 beyond normal incidence stand for nothing.
    if n == 3 and low[0] >= 0.5:
        return "{ 0 }\n", []
    if depth == 0:
        return f"{{ {leaf(low, width, front, f):.7e} }}\n", [(low, width)]
    grid = depth == 2 and int(round(sum(low) / width)) % 2 == 1
    if grid:
        side, values, cells = 4, [], []
        for index in np.ndindex(*[side] * n):
            corner = [c + width / side * i for c, i in zip(low, index)]
            values.append(leaf(corner, width / side, front, f))
            cells.append((corner, width / side))
        return "{ " + " ".join(f"{v:.7e}" for v in values) + " }\n", cells
    text, cells = "{\n", []
    for child in range(1 << n):
        corner = [c + 0.5 * width * (child >> k & 1) for k, c in enumerate(low)]
        more, inside = tree(corner, 0.5 * width, depth - 1, front, f)
        text, cells = text + more, cells + inside
    return text + "}\n", cells


TREES = {"tree3": (3, 4, even), "tree4": (4, 3, grained)}


def write_tree(path, kind, front):
    dimensions, depth, f = TREES[kind]
    text, _ = tree([0.0] * dimensions, 1.0, depth, front, f)
    basis = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n"
    side = "Reflection Front" if front else "Reflection Back"
    path.write_text(window(f"TensorTree{dimensions}", "", [("Visible", side, basis, text)]))


def tree_truth(kind, front, f, wi, wo):
    dimensions, depth, _ = TREES[kind]
    _, cells = tree([0.0] * dimensions, 1.0, depth, front, f)
    place = np.clip(place_in_tree(wi, wo, dimensions, front), 0, 1 - 1e-9)
    # Cells are aligned: by width, from the corner to the value.
    table = {}
    for low, width in cells:
        table.setdefault(width, {})[tuple(np.round(np.array(low) / width).astype(int))] = (low, width)
    truth = np.full(len(wi), np.nan)
    for width, corners in table.items():
        keys = np.floor(place / width + 1e-6).astype(int)
        for i, key in enumerate(map(tuple, keys)):
            if np.isnan(truth[i]) and key in corners:
                truth[i] = leaf(*corners[key], front, f)
    return truth


# --- Zemax -----------------------------------------------------------------------------------------------------------


def zemax_grid(grain):
    rotations = [0, 30, 75, 120, 200] if grain else [0]
    azimuths = list(range(0, 360, 20)) if grain else list(range(0, 181, 15))
    return rotations, [0, 15, 35, 55, 72], azimuths, [0, 2, 5, 9, 15, 25, 40, 60, 85, 120, 150]


def zemax_pairs(grain):
    """To the light and the eye in the order of the numbers."""
    rotations, incidences, azimuths, radials = (np.radians(a) for a in zemax_grid(grain))
    wi, wo = [], []
    for r in rotations:
        # The normal of the plane of incidence stands at the rotation from +x.
        toward = np.array([np.cos(r + np.pi / 2), np.sin(r + np.pi / 2), 0])
        z = np.array([0, 0, 1.0])
        for t in incidences:
            light = np.sin(t) * toward + np.cos(t) * z
            mirror = -np.sin(t) * toward + np.cos(t) * z
            up = np.cos(t) * toward + np.sin(t) * z
            beside = np.cross(mirror, up)
            for a in azimuths:
                for d in radials:
                    wi.append(light)
                    wo.append(np.cos(d) * mirror + np.sin(d) * (np.cos(a) * up + np.sin(a) * beside))
    return np.array(wi), np.array(wo)


def write_zemax(path, grain):
    f = grained if grain else even
    wi, wo = zemax_pairs(grain)
    up = wo[:, 2] > 0
    values = np.zeros(len(wi))
    values[up] = f(wi[up], wo[up])
    axes = zemax_grid(grain)
    names = ["SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"]
    text = "#made from a formula\nSource  Measured\n"
    text += f"Symmetry  {'ASymmetrical4D' if grain else 'PlaneSymmetrical'}\n"
    text += f"SpectralContent  {'XYZ' if grain else 'Monochrome'}\nScatterType  BRDF\n"
    for name, axis in zip(names, axes):
        text += f"{name}  {len(axis)}\n" + "\t".join(map(str, axis)) + "\n"
    shape = [len(a) for a in axes]
    channels = zip(["TristimulusX", "TristimulusY", "TristimulusZ"], xyz_of(RED)) if grain else [("Monochrome", 1.0)]
    for name, scale in channels:
        text += f"\n{name}\nDataBegin\n"
        for block in (scale * values).reshape(-1, shape[2], shape[3]):
            text += f"TIS {block.mean():.4f}\n"
            text += "".join("\t".join(f"{v:.6E}" for v in line) + "\n" for line in block)
        text += "DataEnd\n"
    path.write_text(text)


# --- ASTM ------------------------------------------------------------------------------------------------------------


def scattered_pairs(count, seed):
    rng = np.random.default_rng(seed)
    draw = lambda: (1.35 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count))
    return *draw(), *draw()


def write_astm(path, values):
    ti, pi, ts, ps = scattered_pairs(700, 3)
    f = grained(spherical(ti, pi), spherical(ts, ps))
    header = "OPERATOR a formula\nSAMPLE known\nNUM_POINTS 700\n"
    if values == "degrees":
        columns, rows = "R,G,B", f[:, None] * RED
        ti, pi, ts, ps = (np.degrees(a) for a in (ti, pi, ts, ps))
    elif values == "grey":
        columns, rows = "BRDF", f[:, None]
    else:
        nanometres = range(400, 701, 10)
        columns, rows = ",".join(f"{n}nm" for n in nanometres), np.repeat(f[:, None], 31, 1)
    text = header + f"VARS theta_i,phi_i,theta_s,phi_s,{columns}\n"
    for angles, row in zip(zip(ti, pi, ts, ps), rows):
        text += ",".join([f"{a:.7f}" for a in angles] + [f"{v:.7e}" for v in row]) + "\n"
    path.write_text(text)


# --- ALTA ------------------------------------------------------------------------------------------------------------


def alta_cartesian(name, x):
    """View and light of each row, as ALTA's params has them."""

    def half(th, ph, td, pd):
        th, ph, td, pd = np.broadcast_arrays(th, ph, td, pd)
        d = spherical(td, pd)
        about_y = np.stack([np.cos(th) * d[:, 0] + np.sin(th) * d[:, 2], d[:, 1], np.cos(th) * d[:, 2] - np.sin(th) * d[:, 0]], -1)
        view = np.stack(
            [np.cos(ph) * about_y[:, 0] - np.sin(ph) * about_y[:, 1], np.sin(ph) * about_y[:, 0] + np.cos(ph) * about_y[:, 1], about_y[:, 2]], -1
        )
        h = spherical(th, ph)
        return view, 2 * np.sum(view * h, -1, keepdims=True) * h - view

    columns = list(x.T)
    if name == "CARTESIAN":
        return x[:, :3], x[:, 3:]
    if name == "SPHERICAL_TL_PL_TV_PV":
        tl, pl, tv, pv = columns
        return spherical(tv, pv), spherical(tl, pl)
    if name == "ISOTROPIC_TV_TL_DPHI":
        tv, tl, d = columns
        return spherical(tv, 0), spherical(tl, d)
    if name == "ISOTROPIC_TL_TV_PROJ_DPHI":
        tl, px, py = columns
        return spherical(np.hypot(px, py), np.arctan2(py, px)), spherical(tl, 0)
    if name == "ISOTROPIC_TV_PROJ_DPHI":
        px, py = columns
        return spherical(np.hypot(px, py), np.arctan2(py, px)), spherical(0 * px, 0)
    return {
        "RUSIN_TH_PH_TD_PD": lambda th, ph, td, pd: half(th, ph, td, pd),
        "RUSIN_TH_PH_TD": lambda th, ph, td: half(th, ph, td, 0.0),
        "RUSIN_TH_TD_PD": lambda th, td, pd: half(th, 0.0, td, pd),
        "RUSIN_TH_TD": lambda th, td: half(th, 0.0, td, np.pi / 2),
        "COS_TH_TD": lambda ch, cd: half(np.arccos(ch), 0.0, np.arccos(cd), 0.0),
        "COS_TH": lambda ch: half(np.arccos(ch), 0.0, 0.0, 0.0),
    }[name](*columns)


#: Directions: their ranges, whether the sample's turn is in them; values.
ALTA = {
    "CARTESIAN": (6, False, "RGB_COLOR"),
    "SPHERICAL_TL_PL_TV_PV": ([1.3, 6.2, 1.3, 6.2], False, "INV_STERADIAN_COSINE_FACTOR"),
    "RUSIN_TH_PH_TD_PD": ([0.7, 6.2, 0.7, 6.2], False, "INV_STERADIAN"),
    "RUSIN_TH_PH_TD": ([0.7, 6.2, 0.7], False, "XYZ_COLOR"),
    "RUSIN_TH_TD_PD": ([0.7, 0.7, 6.2], True, "INV_STERADIAN"),
    "RUSIN_TH_TD": ([0.7, 0.7], True, "INV_STERADIAN"),
    "COS_TH_TD": ([-0.25, -0.25], True, "INV_STERADIAN"),
    "COS_TH": ([-0.25], True, "INV_STERADIAN"),
    "ISOTROPIC_TV_TL_DPHI": ([1.3, 1.3, 6.2], True, "INV_STERADIAN"),
    "ISOTROPIC_TL_TV_PROJ_DPHI": ([1.3, 0.9, 0.9], True, "INV_STERADIAN"),
    "ISOTROPIC_TV_PROJ_DPHI": ([0.9, 0.9], True, "INV_STERADIAN"),
}


def alta_rows(name, count=400):
    ranges = ALTA[name][0]
    rng = np.random.default_rng(11)
    if ranges == 6:
        ti, pi, ts, ps = scattered_pairs(count, 5)
        return np.concatenate([spherical(ts, ps), spherical(ti, pi)], -1)
    # Below zero: a cosine, from there to 1.
    return np.stack([(1 + r * rng.random(count)) if r < 0 else r * rng.random(count) for r in ranges], -1)


def write_alta(path, name):
    _, isotropic, output = ALTA[name]
    x = alta_rows(name)
    view, light = alta_cartesian(name, x)
    f = (even if isotropic else grained)(light, view)
    if output == "INV_STERADIAN_COSINE_FACTOR":
        f = f * light[:, 2]
    values = {"RGB_COLOR": RED, "XYZ_COLOR": xyz_of(RED)}.get(output, np.ones(1)) * f[:, None]
    text = f"#DIM {x.shape[1]} {values.shape[1]}\n#PARAM_IN  {name}\n#PARAM_OUT {output}\n#VS 0\n"
    for row, value in zip(x, values):
        text += "\t".join([f"{a:.8f}" for a in row] + [f"{v:.7e}" for v in value]) + "\n"
    path.write_text(text)


# --- UTIA ------------------------------------------------------------------------------------------------------------


def utia_directions():
    return spherical(np.radians(15.0 * np.arange(6))[:, None], np.radians(7.5 * np.arange(48))[None]).reshape(-1, 3)


def write_utia(path):
    w = utia_directions()
    f = grained(w[:, None], w[None])
    (RED[:, None, None] * f).astype("<f8").tofile(path)


# --- colours ---------------------------------------------------------------------------------------------------------


def xyz_of(rgb):
    """Of linear sRGB, adapted by Bradford's method so that white has X = Y = Z = 1."""
    cone = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    white = XYZ_OF_SRGB @ np.ones(3)
    scale = (cone @ np.ones(3)) / (cone @ white)
    return np.linalg.solve(cone, scale * (cone @ (XYZ_OF_SRGB @ rgb)))


# --- what there is ---------------------------------------------------------------------------------------------------

ONE = np.ones(3)


def point(f):
    return lambda wi, wo, g: (g or f)(wi, wo)


def klems(name, front=True, **how):
    count = sum(KLEMS[name][1]) ** 2
    truth = lambda wi, wo, g: klems_truth(name, front, g or grained, wi, wo)
    return lambda path: write_klems(path, name, front, **how), truth, RED if how.get("colour") else ONE, count


def tensor(kind, front):
    def truth(wi, wo, g):
        return tree_truth(kind, front, g or TREES[kind][2], wi, wo)

    dimensions, depth, f = TREES[kind]
    # None is so wide that it is read in several places.
    count = len(tree([0.0] * dimensions, 1.0, depth, front, f)[1])
    return lambda path: write_tree(path, kind, front), truth, ONE, count


def zemax(grain):
    wi, wo = zemax_pairs(grain)
    # The mirror direction is in the line of every azimuth, and counts once.
    _, _, azimuths, radials = zemax_grid(grain)
    first = np.arange(len(wi)) % (len(azimuths) * len(radials))
    count = int(np.sum((wo[:, 2] > 1e-4) & ((first % len(radials) != 0) | (first == 0))))
    f = grained if grain else even
    return lambda path: write_zemax(path, grain), point(f), RED if grain else ONE, count


def astm(values):
    return lambda path: write_astm(path, values), point(grained), RED if values == "degrees" else ONE, 700


def alta(name):
    _, isotropic, output = ALTA[name]
    view, light = alta_cartesian(name, alta_rows(name))
    count = int(np.sum((view[:, 2] > 1e-4) & (light[:, 2] > 1e-4)))
    colour = RED if output in ("RGB_COLOR", "XYZ_COLOR") else ONE
    return lambda path: write_alta(path, name), point(even if isotropic else grained), colour, count


KINDS = {
    "klems-full": lambda: klems("LBNL/Klems Full"),
    "klems-half": lambda: klems("LBNL/Klems Half", colour=True),
    "klems-quarter": lambda: klems("LBNL/Klems Quarter", rows=True),
    "klems-back": lambda: klems("LBNL/Klems Quarter", front=False),
    "klems-own": lambda: klems("House of nine"),
    "tree3": lambda: tensor("tree3", True),
    "tree4": lambda: tensor("tree4", True),
    "tree4-back": lambda: tensor("tree4", False),
    "zemax": lambda: zemax(False),
    "zemax-grain": lambda: zemax(True),
    "astm-degrees": lambda: astm("degrees"),
    "astm-grey": lambda: astm("grey"),
    "astm-spectrum": lambda: astm("spectrum"),
    **{f"alta-{name}": (lambda name=name: alta(name)) for name in ALTA},
    "utia": lambda: (write_utia, point(grained), RED, 288 * 288),
}


def worst(f, truth, colour):
    return float(np.max(np.abs(f - truth[:, None] * colour) / (truth[:, None] * colour)))


def judge(kind, path):
    _, truth, colour, count = KINDS[kind]()
    rows = np.fromfile(path, "<f4").reshape(-1, 9).astype(float)
    wi, wo, f = rows[:, :3], rows[:, 3:6], rows[:, 6:]
    isotropic = ALTA[kind[5:]][1] if kind.startswith("alta") else kind in ("tree3", "zemax")
    base = even if isotropic else grained
    mirror = np.array([-1.0, 1, 1])
    return {
        "expected": count,
        "readings": len(rows),
        "worst": worst(f, truth(wi, wo, None), colour),
        "swapped": worst(f, truth(wi, wo, lambda a, b: base(b, a)), colour),
        "mirrored": worst(f, truth(wi, wo, lambda a, b: base(a * mirror, b * mirror)), colour),
    }


def main():
    verb, folder = sys.argv[1], Path(sys.argv[2])
    if verb == "write":
        for kind, make in KINDS.items():
            make()[0](folder / f"{kind}.dat")
    else:
        there = [kind for kind in KINDS if (folder / f"{kind}.f32").exists()]
        print(json.dumps({kind: judge(kind, folder / f"{kind}.f32") for kind in there}))


if __name__ == "__main__":
    main()
