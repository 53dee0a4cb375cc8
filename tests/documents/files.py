"""Data sets under the names that the pages use. They are small and made up; each is made when a command names it."""

import gzip
import math
import os
import struct
import subprocess


class Files:
    """programs: the folder of make-terrain and make-volume; folder: where the commands run."""

    def __init__(self, programs, folder):
        self._programs, self._folder = programs, folder
        self._makers = {
            "MY.ply": _terrain,
            "crater.ply": _terrain,
            "bonsai.nii.gz": self._nifti,
            "head.nrrd": lambda path: self._volume(path, 48, 16),
            "foot.raw": lambda path: self._volume(path, 256, 8),
            "scans/abdomen": self._dicom,
            "phases": self._series,
            "map.json": _colour_map,
            "plate.vtp": _scalars,
            "walk.csv": _movement,
        }

    def names(self):
        return sorted(self._makers)

    def make_those_in(self, text):
        """Makes every data set that `text` names and that is not there yet."""
        for name, maker in self._makers.items():
            path = os.path.join(self._folder, name)
            if name in text and not os.path.exists(path):
                os.makedirs(os.path.dirname(path), exist_ok=True)
                maker(path)

    def _run(self, program, *arguments):
        subprocess.run([os.path.join(self._programs, program), *arguments], check=True, stdout=subprocess.DEVNULL)


    def _volume(self, path, size, bits, seed=1):
        self._run("make-volume", "--size", str(size), "--bits", str(bits), "--seed", str(seed), "-o", path)

    def _voxels(self, size):
        path = os.path.join(self._folder, ".voxels.raw")
        self._volume(path, size, 16)
        with open(path, "rb") as file:
            voxels = file.read()
        os.remove(path)
        return voxels

    def _series(self, path):
        os.makedirs(path)
        for step in range(3):
            self._volume(f"{path}/phase{step:02}.nrrd", 32, 16, seed=step + 1)

    def _nifti(self, path):
        size = 40
        header = bytearray(352)
        struct.pack_into("<i", header, 0, 348)
        struct.pack_into("<8h", header, 40, 3, size, size, size, 1, 1, 1, 1)
        struct.pack_into("<2h", header, 70, 4, 16)  # signed, 16 bits
        struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 1, 1, 1, 1)
        struct.pack_into("<3f", header, 108, 352, 1, 0)
        header[344:348] = b"n+1\0"
        with gzip.open(path, "wb") as file:
            file.write(bytes(header) + self._voxels(size))

    def _dicom(self, path):
        size = 32
        voxels = self._voxels(size)
        os.makedirs(path)
        for z in range(size):
            part = voxels[z * size * size * 2 : (z + 1) * size * size * 2]
            with open(f"{path}/slice{z:03}.dcm", "wb") as file:
                file.write(_dicom_slice(size, z, part))


def _terrain(path, cells=100):
    """2 * cells^2 triangles of a coloured, bumpy land in z, as binary PLY."""
    side = cells + 1
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {side * side}\n".encode() +
                   b"".join(f"property float {axis}\n".encode() for axis in "xyz") +
                   b"".join(f"property uchar {name}\n".encode() for name in ("red", "green", "blue")) +
                   f"element face {2 * cells * cells}\nproperty list uchar int vertex_indices\nend_header\n".encode())
        for y in range(side):
            for x in range(side):
                z = 8 * math.sin(x / 9) * math.cos(y / 7) + math.sin(x / 2)
                file.write(struct.pack("<3f3B", x, y, z, 100 + int(8 * z), 160 - x, 60 + y))
        for y in range(cells):
            for x in range(cells):
                a, b = y * side + x, (y + 1) * side + x
                file.write(struct.pack("<B3iB3i", 3, a, a + 1, b, 3, a + 1, b + 1, b))


def _movement(path):
    """Of a head that walks past the data set, a second long."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("t_s,px,py,pz,qw,qx,qy,qz\n")
        for i in range(201):
            t = i / 200
            file.write(f"{t},{0.4 * t - 0.2},0.1,{0.9 - 0.2 * t * t},1,0,0,0\n")


def _element(group, element, kind, value):
    if isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b"\0" if kind == "UI" else b" "
    head = struct.pack("<HH2s", group, element, kind.encode())
    return head + (struct.pack("<HI", 0, len(value)) if kind in ("OB", "OW") else struct.pack("<H", len(value))) + value


def _dicom_slice(size, z, voxels):
    """A slice of a CT, explicit little-endian (DICOM part 5)."""
    syntax, ct = "1.2.840.10008.1.2.1", "1.2.840.10008.5.1.4.1.1.2"
    meta = _element(2, 1, "OB", b"\0\1") + _element(2, 2, "UI", ct) + _element(2, 3, "UI", f"1.2.3.{z + 1}")
    meta += _element(2, 0x10, "UI", syntax) + _element(2, 0x12, "UI", "1.2.3")
    short = lambda value: struct.pack("<H", value)
    body = _element(8, 0x16, "UI", ct) + _element(8, 0x18, "UI", f"1.2.3.{z + 1}") + _element(8, 0x60, "CS", "CT")
    body += _element(0x18, 0x50, "DS", "1") + _element(0x20, 0xD, "UI", "1.2.4") + _element(0x20, 0xE, "UI", "1.2.5")
    body += _element(0x20, 0x13, "IS", str(z + 1)) + _element(0x20, 0x32, "DS", f"0\\0\\{z}")
    body += _element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0") + _element(0x28, 2, "US", short(1))
    body += _element(0x28, 4, "CS", "MONOCHROME2") + _element(0x28, 0x10, "US", short(size))
    body += _element(0x28, 0x11, "US", short(size)) + _element(0x28, 0x30, "DS", "1\\1")
    body += _element(0x28, 0x100, "US", short(16)) + _element(0x28, 0x101, "US", short(16))
    body += _element(0x28, 0x102, "US", short(15)) + _element(0x28, 0x103, "US", short(1))
    body += _element(0x28, 0x1052, "DS", "0") + _element(0x28, 0x1053, "DS", "1") + _element(0x7FE0, 0x10, "OW", voxels)
    return b"\0" * 128 + b"DICM" + _element(2, 0, "UL", struct.pack("<I", len(meta))) + meta + body


def _colour_map(path):
    """A transfer function as ParaView writes one."""
    with open(path, "w") as file:
        file.write('[{"Name": "map", "RGBPoints": [0, 0.2, 0.1, 0, 300, 1, 0.6, 0.3, 1000, 1, 1, 1],')
        file.write(' "Points": [0, 0, 0.5, 0, 300, 0.1, 0.5, 0, 1000, 0.9, 0.5, 0]}]')


def _scalars(path):
    """A wavy square with the point arrays temperature and wind and the cell array part."""
    side = 24
    grid = [(x, y) for y in range(side) for x in range(side)]
    points = " ".join(f"{x} {y} {((x * 7 + y * 3) % 11) / 5}" for x, y in grid)
    corners = [(y * side + x) for y in range(side - 1) for x in range(side - 1)]
    triangles = [t for c in corners for t in ((c, c + 1, c + side), (c + 1, c + side + 1, c + side))]
    array = '<DataArray type="Float32" Name="{}" NumberOfComponents="{}" format="ascii">{}</DataArray>'
    index = '<DataArray type="Int32" Name="{}" format="ascii">{}</DataArray>'
    with open(path, "w") as file:
        file.write('<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>')
        file.write(f'<Piece NumberOfPoints="{len(grid)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0"')
        file.write(f' NumberOfPolys="{len(triangles)}"><PointData>')
        file.write(array.format("temperature", 1, " ".join(str(20 + x * y / 9) for x, y in grid)))
        file.write(array.format("wind", 3, " ".join(f"{x} {y} 1" for x, y in grid)))
        file.write("</PointData><CellData>")
        file.write(array.format("part", 1, " ".join(str(t // 200) for t in range(len(triangles)))))
        file.write("</CellData><Points>" + array.format("Points", 3, points) + "</Points><Polys>")
        file.write(index.format("connectivity", " ".join(str(i) for t in triangles for i in t)))
        file.write(index.format("offsets", " ".join(str(3 * (t + 1)) for t in range(len(triangles)))))
        file.write("</Polys></Piece></PolyData></VTKFile>")
