"""The shapes that every writer is given, and where it leaves what it writes.

PRISM: a U of 3 x 2 x 1, ten faces, two of them concave: 28 triangles; its left half is red, its right half blue.
BOXES: a red one of 1 x 1 x 1 and a blue one of 2 x 1 x 2, each with a material: 24 triangles.
volume(): 24 x 20 x 16 voxels of 1 x 1.5 x 2 mm, a gradient of 0 to 106 and a block of 240 at (18..20, 3..5, 10..12).
terrain(): 30 rows of 40 heights, 10 m apart, from 100 m in the north-west to 300 m in the south-east;
four columns in the west and two rows in the north are without data, so its box tells how it lies.
"""

import pathlib
import sys

import numpy

RED, BLUE = (200, 30, 30), (30, 30, 200)

_OUTLINE = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
PRISM_POINTS = numpy.array([(x, y, z) for z in (0, 1) for x, y in _OUTLINE], "f4")
PRISM_FACES = [list(range(7, -1, -1)), list(range(8, 16))]
PRISM_FACES += [[i, (i + 1) % 8, 8 + (i + 1) % 8, 8 + i] for i in range(8)]
PRISM_COLOURS = numpy.array([RED if x < 1.5 else BLUE for x, _, _ in PRISM_POINTS], "u1")
_U = [(0, 1, 5), (0, 5, 7), (5, 6, 7), (1, 4, 5), (1, 2, 4), (2, 3, 4)]
PRISM_TRIANGLES = [t[::-1] for t in _U] + [tuple(8 + i for i in t) for t in _U]
PRISM_TRIANGLES += [t for a, b, c, d in PRISM_FACES[2:] for t in ((a, b, c), (a, c, d))]

_CUBE = numpy.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], "f4")
BOX_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
BOXES = [("red", RED, _CUBE), ("blue", BLUE, _CUBE * numpy.array([2, 1, 2], "f4") + numpy.array([2, 0, 0], "f4"))]

SIZE, SPACING, ORIGIN = (24, 20, 16), (1.0, 1.5, 2.0), (10.0, -20.0, 30.0)

NO_DATA = -9999.0
WEST, NORTH, STEP = 500000.0, 5300300.0, 10.0


def volume(kind="i2"):
    """Voxels as an array [z, y, x]."""
    z, y, x = numpy.mgrid[0:16, 0:20, 0:24]
    values = x + 2 * y + 3 * z
    values[10:13, 3:6, 18:21] = 240
    return values.astype(kind)


def terrain(no_data=NO_DATA):
    """Heights in metres as an array [row from the north, column from the west]; no_data None: no gap."""
    row, column = numpy.mgrid[0:30, 0:40]
    heights = 100 + 100 * (numpy.maximum(column - 4, 0) / 35 + numpy.maximum(row - 2, 0) / 27)
    if no_data is not None:
        heights[:2, :] = no_data
        heights[:, :4] = no_data
    return heights.astype("f4")


def place(writer, name):
    """Path of a file by that writer below the present folder."""
    path = pathlib.Path(writer) / name
    path.parent.mkdir(parents=True, exist_ok=True)
    return str(path)


def note(writer, version):
    """Keeps the version of a writer for the table."""
    with open("versions.tsv", "a", encoding="utf-8") as out:
        out.write(f"{writer}\t{version}\n")


def attempt(what, action):
    """Does one file; a writer that fails is told and costs no other file."""
    try:
        action()
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        print(f"{what}: {type(error).__name__}: {error}", flush=True)
