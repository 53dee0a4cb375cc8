"""Writes meshes, grids, volumes and groups of them by VTK."""

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk

import shapes

ENCODINGS = {
    "ascii": lambda w: w.SetDataModeToAscii(),
    "inline": lambda w: w.SetDataModeToBinary(),
    "appended": lambda w: w.SetDataModeToAppended(),
    "raw": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff()),
    "raw_none": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff(), w.SetCompressorTypeToNone()),
    "raw_lz4": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff(), w.SetCompressorTypeToLZ4()),
    "raw_lzma": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff(), w.SetCompressorTypeToLZMA()),
    "big_64": lambda w: (w.SetByteOrderToBigEndian(), w.SetHeaderTypeToUInt64(), w.SetDataModeToAppended()),
}


def array(values, name):
    values = numpy.ascontiguousarray(values)
    made = numpy_to_vtk(values, deep=True)
    made.SetName(name)
    return made


def prism(by="cells"):
    """The prism as polygons; by: what carries the colours."""
    data = vtk.vtkPolyData()
    points = vtk.vtkPoints()
    for p in shapes.PRISM_POINTS:
        points.InsertNextPoint(*map(float, p))
    data.SetPoints(points)
    cells = vtk.vtkCellArray()
    for face in shapes.PRISM_FACES:
        cells.InsertNextCell(len(face), face)
    data.SetPolys(cells)
    if by == "points":
        data.GetPointData().SetScalars(array(shapes.PRISM_COLOURS, "colour"))
    elif by == "cells":
        middle = [shapes.PRISM_POINTS[f][:, 0].mean() for f in shapes.PRISM_FACES]
        data.GetCellData().SetScalars(
            array(numpy.array([shapes.RED if m < 1.5 else shapes.BLUE for m in middle], "u1"), "colour")
        )
    else:
        data.GetPointData().SetScalars(array(shapes.PRISM_POINTS[:, 0] * 10, "heat"))
    return data


def strips():
    """The boxes' triangles as strips where they make one."""
    stripper = vtk.vtkStripper()
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(prism("none"))
    stripper.SetInputConnection(triangles.GetOutputPort())
    stripper.Update()
    return stripper.GetOutput()


def blocks(lo=0, hi=3, kind="hexahedron"):
    """3 x 2 x 2 cells, those at lo <= x < hi, as an unstructured grid."""
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    index = {}
    for z in range(3):
        for y in range(3):
            for x in range(lo, hi + 1):
                index[x, y, z] = points.InsertNextPoint(x, y, z)
    grid.SetPoints(points)
    for x, y, z in [(x, y, z) for z in range(2) for y in range(2) for x in range(lo, hi)]:
        ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
        ids = [index[x + a, y + b, z + c] for c in (0, 1) for a, b in ring]
        if kind == "hexahedron":
            grid.InsertNextCell(vtk.VTK_HEXAHEDRON, 8, ids)
        elif kind == "voxel":
            grid.InsertNextCell(vtk.VTK_VOXEL, 8, [ids[i] for i in (0, 1, 3, 2, 4, 5, 7, 6)])
        elif kind == "wedge":
            for a in ((0, 1, 2), (0, 2, 3)):
                grid.InsertNextCell(vtk.VTK_WEDGE, 6, [ids[i] for i in a] + [ids[4 + i] for i in a])
        else:
            faces = vtk.vtkIdList()
            for f in ([0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]):
                faces.InsertNextId(4)
                for i in f:
                    faces.InsertNextId(ids[i])
            whole = vtk.vtkIdList()
            whole.InsertNextId(6)
            for i in range(faces.GetNumberOfIds()):
                whole.InsertNextId(faces.GetId(i))
            grid.InsertNextCell(vtk.VTK_POLYHEDRON, whole)
    count = points.GetNumberOfPoints()
    grid.GetPointData().SetScalars(
        array(numpy.array([points.GetPoint(i)[0] for i in range(count)], "f4"), "pressure")
    )
    return grid


def quadratic():
    """A hexahedron of 20 nodes with straight edges, 2 x 1 x 1."""
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    cell = vtk.vtkQuadraticHexahedron()
    place = cell.GetParametricCoords()
    for i in range(20):
        points.InsertNextPoint(2 * place[3 * i], place[3 * i + 1], place[3 * i + 2])
    grid.SetPoints(points)
    grid.InsertNextCell(vtk.VTK_QUADRATIC_HEXAHEDRON, 20, list(range(20)))
    return grid


def image(kind="i2"):
    data = vtk.vtkImageData()
    data.SetDimensions(*shapes.SIZE)
    data.SetSpacing(*shapes.SPACING)
    data.SetOrigin(*shapes.ORIGIN)
    data.GetPointData().SetScalars(array(shapes.volume(kind).ravel(), "density"))
    return data


def rectilinear(even=True):
    data = vtk.vtkRectilinearGrid()
    data.SetDimensions(*shapes.SIZE)
    for axis, put in enumerate((data.SetXCoordinates, data.SetYCoordinates, data.SetZCoordinates)):
        at = numpy.arange(shapes.SIZE[axis], dtype="f4")
        if not even and axis == 2:
            at = at + at * at / 30
        put(array(shapes.ORIGIN[axis] + shapes.SPACING[axis] * at, "xyz"[axis]))
    data.GetPointData().SetScalars(array(shapes.volume("f4").ravel(), "density"))
    return data


def structured():
    data = vtk.vtkStructuredGrid()
    data.SetDimensions(4, 3, 3)
    points = vtk.vtkPoints()
    for z in range(3):
        for y in range(3):
            for x in range(4):
                points.InsertNextPoint(x, y, z)
    data.SetPoints(points)
    return data


def save(writer, data, name, *settings):
    path = shapes.place("vtk", name)

    def run():
        writer.SetFileName(path)
        if data:
            writer.SetInputData(data)
        for setting in settings:
            setting(writer)
        if writer.Write() == 0:
            raise OSError("not written")

    shapes.attempt(path, run)


def legacy():
    kinds = {
        "polydata": (vtk.vtkPolyDataWriter, prism("points")),
        "polydata_strips": (vtk.vtkPolyDataWriter, strips()),
        "unstructured": (vtk.vtkUnstructuredGridWriter, blocks()),
        "image": (vtk.vtkStructuredPointsWriter, image()),
        "image_float": (vtk.vtkStructuredPointsWriter, image("f4")),
        "rectilinear": (vtk.vtkRectilinearGridWriter, rectilinear()),
        "structured": (vtk.vtkStructuredGridWriter, structured()),
    }
    for name, (writer, data) in kinds.items():
        for mode in ("ascii", "binary"):
            for version in (42, 51):
                put = lambda w, m=mode: w.SetFileTypeToASCII() if m == "ascii" else w.SetFileTypeToBinary()
                save(
                    writer(),
                    data,
                    f"legacy_{version}/{name}_{mode}.vtk",
                    put,
                    lambda w, v=version: w.SetFileVersion(v),
                )


def xml():
    for name, setting in ENCODINGS.items():
        save(vtk.vtkXMLPolyDataWriter(), prism(), f"encodings/{name}.vtp", setting)
        save(vtk.vtkXMLUnstructuredGridWriter(), blocks(), f"encodings/{name}.vtu", setting)
        save(vtk.vtkXMLImageDataWriter(), image(), f"encodings/{name}.vti", setting)
    save(vtk.vtkXMLPolyDataWriter(), prism("points"), "colours_points.vtp")
    save(vtk.vtkXMLPolyDataWriter(), prism("values"), "values_points.vtp")
    save(vtk.vtkXMLPolyDataWriter(), strips(), "strips.vtp")
    for kind in ("voxel", "wedge", "polyhedron"):
        save(vtk.vtkXMLUnstructuredGridWriter(), blocks(kind=kind), f"{kind}.vtu")
    save(vtk.vtkXMLUnstructuredGridWriter(), quadratic(), "quadratic.vtu")
    save(vtk.vtkXMLRectilinearGridWriter(), rectilinear(), "even.vtr")
    save(vtk.vtkXMLRectilinearGridWriter(), rectilinear(False), "uneven.vtr")
    save(vtk.vtkXMLStructuredGridWriter(), structured(), "structured.vts")
    for kind in ("u1", "u2", "i4", "u4", "i8", "f4", "f8"):
        save(vtk.vtkXMLImageDataWriter(), image(kind), f"types/{kind}.vti")
    cells = vtk.vtkImageData()
    cells.SetDimensions(*(n + 1 for n in shapes.SIZE))
    cells.SetSpacing(*shapes.SPACING)
    cells.SetOrigin(*(o - s / 2 for o, s in zip(shapes.ORIGIN, shapes.SPACING)))
    cells.GetCellData().SetScalars(array(shapes.volume().ravel(), "density"))
    save(vtk.vtkXMLImageDataWriter(), cells, "cells.vti")
    turned = image()
    turned.SetDirectionMatrix(0, 1, 0, 1, 0, 0, 0, 0, -1)
    save(vtk.vtkXMLImageDataWriter(), turned, "turned.vti")
    part = image()
    part.SetExtent(5, 28, 0, 19, 2, 17)
    part.SetOrigin(*(o - s * f for o, s, f in zip(shapes.ORIGIN, shapes.SPACING, (5, 0, 2))))
    save(vtk.vtkXMLImageDataWriter(), part, "extent_from_5.vti")


def pieces():
    """Files of several pieces, each cell in one of them, with ghosts of one layer around."""
    split = lambda w: (w.SetNumberOfPieces(3), w.SetStartPiece(0), w.SetEndPiece(2), w.SetGhostLevel(1))
    for writer, cut, data, name in (
        (vtk.vtkXMLPPolyDataWriter(), vtk.vtkExtractPolyDataPiece(), prism(), "prism.pvtp"),
        (vtk.vtkXMLPUnstructuredGridWriter(), vtk.vtkExtractUnstructuredGridPiece(), blocks(), "blocks.pvtu"),
        (vtk.vtkXMLPImageDataWriter(), vtk.vtkImageCast(), image(), "image.pvti"),
    ):
        cut.SetInputData(data)
        if name.endswith("i"):
            cut.SetOutputScalarTypeToShort()
        put = lambda w, c=cut: w.SetInputConnection(c.GetOutputPort())
        save(writer, None, f"pieces/{name}", put, split)
        # Data that cannot be cut: the first piece holds all cells, the others hold them as ghosts.
        save(type(writer)(), data, f"pieces/whole_{name}", split)


def groups():
    boxes = vtk.vtkMultiBlockDataSet()
    for i, (_, colour, points) in enumerate(shapes.BOXES):
        data = vtk.vtkPolyData()
        corners, cells = vtk.vtkPoints(), vtk.vtkCellArray()
        for p in points:
            corners.InsertNextPoint(*map(float, p))
        for face in shapes.BOX_FACES:
            cells.InsertNextCell(4, face)
        data.SetPoints(corners)
        data.SetPolys(cells)
        data.GetCellData().SetScalars(array(numpy.array([colour] * 6, "u1"), "colour"))
        boxes.SetBlock(i, data)
    save(vtk.vtkXMLMultiBlockDataWriter(), boxes, "groups/boxes.vtm")
    nested = vtk.vtkMultiBlockDataSet()
    nested.SetBlock(0, boxes)
    apart, points = blocks(), vtk.vtkPoints()
    for i in range(36):
        x, y, z = apart.GetPoint(i)
        points.InsertNextPoint(x, y + 3, z)
    apart.SetPoints(points)
    nested.SetBlock(2, apart)
    save(vtk.vtkXMLMultiBlockDataWriter(), nested, "groups/nested.vtm")
    parts = vtk.vtkPartitionedDataSet()
    parts.SetPartition(0, blocks(0, 2))
    parts.SetPartition(1, blocks(2, 3))
    collection = vtk.vtkPartitionedDataSetCollection()
    collection.SetPartitionedDataSet(0, parts)
    save(vtk.vtkXMLPartitionedDataSetCollectionWriter(), collection, "groups/parts.vtpc")


def others():
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(prism("points"))
    triangles.Update()
    for name, setting in (("binary", "SetFileTypeToBinary"), ("text", "SetFileTypeToASCII")):
        put = lambda w, s=setting: getattr(w, s)()
        save(vtk.vtkSTLWriter(), triangles.GetOutput(), f"prism_{name}.stl", put)
        save(vtk.vtkPLYWriter(), triangles.GetOutput(), f"prism_{name}.ply", put, lambda w: w.SetArrayName("colour"))
    save(vtk.vtkOBJWriter(), prism("points"), "prism.obj")
    save(vtk.vtkMetaImageWriter(), image(), "volume.mha", lambda w: w.SetCompression(True))
    save(
        vtk.vtkMetaImageWriter(), image(), "volume.mhd", lambda w: w.SetRAWFileName(shapes.place("vtk", "volume.raw"))
    )
    save(vtk.vtkNIFTIImageWriter(), image(), "volume.nii.gz")
    for writer, kind in ((vtk.vtkTIFFWriter(), "tif"), (vtk.vtkPNGWriter(), "png")):
        shapes.place("vtk", f"{kind}_stack/slice")
        writer.SetFileDimensionality(2)
        writer.SetFilePrefix(f"vtk/{kind}_stack/slice")
        writer.SetFilePattern("%s%03d." + kind)
        writer.SetInputData(image("u1"))
        writer.Write()


shapes.note("vtk", vtk.vtkVersion.GetVTKVersion())
for part in (legacy, xml, pieces, groups, others):
    shapes.attempt(part.__name__, part)
