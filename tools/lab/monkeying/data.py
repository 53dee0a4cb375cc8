"""Small data sets of every kind, whole and damaged, that a monkey opens and drops."""
import json
import math
import os
import random
import re
import struct
import subprocess

REAL_VOLUMES = ("fuel.nii.gz", "bonsai.nii.gz", "avm-angio.nii.gz", "heart-cine", "alderson-ct-512x512x199.mha",
                "heptane.nii.gz")
REAL_SURFACES = ("lucy-100k.ply", "andes-srtm3.tif", "space-exploration.glb")
PRESETS = ["", "plain", "bone", "skin", "ct-angio", "mr", "fire", "grey"]


def write(path, content):
    with open(path, "wb") as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return path


def ball_with_arrays(path, rows=24, columns=48):
    """A VTP of a ball with two arrays, of which one is the active scalars."""
    points = [(math.sin(math.pi * r / rows) * math.cos(2 * math.pi * c / columns),
               math.sin(math.pi * r / rows) * math.sin(2 * math.pi * c / columns), math.cos(math.pi * r / rows))
              for r in range(rows + 1) for c in range(columns)]
    quads = [
        (r + c, r + (c + 1) % columns, r + columns + (c + 1) % columns, r + columns + c)
        for r in range(0, rows * columns, columns)
        for c in range(columns)
    ]

    def array(name, kind, values, parts=1):
        return (f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{parts}" format="ascii">'
                + " ".join(f"{v:g}" for v in values) + "</DataArray>")
    write(path, f'''<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0"
 NumberOfPolys="{len(quads)}">
<PointData Scalars="temperature">{array("temperature", "Float32", [20 + 15 * p[2] for p in points])}
{array("wind", "Float32", [v for p in points for v in p], 3)}</PointData>
<Points>{array("Points", "Float32", [v for p in points for v in p], 3)}</Points>
<Polys>{array("connectivity", "Int32", [i for q in quads for i in q])}
{array("offsets", "Int32", [4 * (i + 1) for i in range(len(quads))])}</Polys></Piece></PolyData></VTKFile>''')
    return path


def volume(path, size, values, kind="MET_UCHAR"):
    """A MetaImage."""
    write(path, (f"ObjectType = Image\nNDims = 3\nDimSize = {size} {size} {size}\nElementType = {kind}\n"
                 "ElementSpacing = 1 1 1\nElementDataFile = LOCAL\n").encode() + values)
    return path


def balls(size, radius):
    middle = (size - 1) / 2
    return bytes(min(255, int(max(0.0, radius - math.dist((x, y, z), (middle,) * 3)) * 24))
                 for z in range(size) for y in range(size) for x in range(size))


def phantom(size):
    """Air, flesh and bone in Hounsfield units: presets of a CT end within such data."""
    middle = (size - 1) / 2
    return struct.pack(f"<{size ** 3}h", *(
        -1000 if r > 0.9 * middle else 40 + (x * y + z) % 30 if r > 0.5 * middle else min(3095, int(3300 - 200 * r))
        for z in range(size) for y in range(size) for x in range(size)
        for r in [math.dist((x, y, z), (middle,) * 3)]))


def make(folder, programs, real):
    """{name: (path, more arguments)} of data sets, {name: path} of files to drop. They are made once."""
    os.makedirs(folder, exist_ok=True)
    at = lambda name: os.path.join(folder, name)  # noqa: E731
    if not os.path.exists(at("complete")):
        for command in (
            ["make-terrain", "--triangles", "20000", "-o", at("mesh.ply")],
            ["make-volume", "--size", "48", "--bits", "16", "-o", at("tree.nrrd")],
            ["make-volume", "--size", "48", "--bits", "8", "-o", at("bytes.mha")],
        ):
            command[0] = os.path.join(programs, command[0])
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        volume(at("ct.mha"), 40, phantom(40), "MET_SHORT")
        ball_with_arrays(at("arrays.vtp"))
        head = "ncols 80\nnrows 60\nxllcorner 7.2\nyllcorner 46.1\ncellsize 0.001\nNODATA_value -9999\n"
        heights = (1500 + 400 * math.sin(x / 9) * math.cos(y / 7) for y in range(60) for x in range(80))
        write(at("terrain.asc"), head + "\n".join(f"{h:.1f}" for h in heights) + "\n")
        os.makedirs(at("series"), exist_ok=True)
        for step in range(6):
            volume(at(f"series/ball_{step}.mha"), 24, balls(24, 4 + step))
        volume(at("one value.mha"), 16, b"\7" * 4096)
        large = (((i * 7919) % 4096 - 2048) << 52 for i in range(4096))
        volume(at("large numbers.mha"), 16, struct.pack("<4096q", *large), "MET_LONG_LONG")
        poses = (f"{i / 10},{math.sin(i / 9)},0.2,{math.cos(i / 9)},1,0,0,0\n" for i in range(30))
        write(at("path.csv"), "t_s,px,py,pz,qw,qx,qy,qz\n" + "".join(poses))
        points, colours = [0, 0, 0.5, 0, 255, 1, 0.5, 0], [0, 0, 0, 0, 255, 1, 1, 1]
        write(at("function.json"), json.dumps([{"Name": "monkey", "Points": points, "RGBPoints": colours}]))
        chance = random.Random(46)
        for name in ("mesh.ply", "ct.mha", "bytes.mha", "arrays.vtp", "terrain.asc", "path.csv", "function.json"):
            with open(at(name), "rb") as file:
                whole = file.read()
            write(at("short " + name), whole[:len(whole) * 2 // 3])
            damaged = bytearray(whole)
            for _ in range(20):
                damaged[chance.randrange(min(len(damaged), 400))] = chance.randrange(256)
            write(at("damaged " + name), damaged)
        write(at("empty.ply"), "")
        write(at("noise.vtp"), chance.randbytes(5000))
        write(at("unknown.xyzzy"), "nothing")
        write(at("umlaut äöü 'quoted' %41.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        write(at("complete"), "")
    scenes = {
        "ct": (at("ct.mha"), []),
        "arrays": (at("arrays.vtp"), []),
        "bytes": (at("bytes.mha"), []),
        "julia": ("julia", []),
        "series": (at("series"), []),
        "terrain": (at("terrain.asc"), []),
        "iso": (at("ct.mha"), ["--iso", "300"]),
        "empty": ("", []),
        "mesh": (at("mesh.ply"), []),
        "one-value": (at("one value.mha"), []),
        "large": (at("large numbers.mha"), []),
    }
    real_folder = folder + "-real"
    os.makedirs(real_folder, exist_ok=True)
    for name in [f"volumes/{n}" for n in REAL_VOLUMES] + [f"formats/{n}" for n in REAL_SURFACES]:
        path, link = os.path.join(os.path.abspath(real), name), os.path.join(real_folder, os.path.basename(name))
        if os.path.exists(path):
            if not os.path.lexists(link):  # notes and bookmarks go beside the link
                os.symlink(path, link)
            scenes[re.split(r"[.]|-ct-", os.path.basename(name))[0]] = (link, [])
    drops = {name: at(name) for name in sorted(os.listdir(folder)) if name not in ("complete", "cache")}
    drops |= {"nothing": at("is not there.ply"), "folder": folder}
    return scenes, drops


def is_volume(name):
    return name not in ("arrays", "julia", "terrain", "iso", "empty", "mesh", *(n.split(".")[0] for n in REAL_SURFACES))
