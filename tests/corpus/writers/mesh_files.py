"""Writes meshes by the viewers, converters, libraries and CAD programs of Debian, Blender and VTK aside."""

import os
import pathlib
import re
import subprocess

import meshio
import numpy

import shapes

HEADLESS = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": "/tmp", "LC_ALL": "C.UTF-8"}


def run(*command, **options):
    made = subprocess.run(command, capture_output=True, text=True, check=False, env=HEADLESS, timeout=120, **options)
    if made.returncode:
        raise OSError(f"{command[0]} ended with {made.returncode}: {(made.stderr or made.stdout).strip()[-300:]}")
    return made.stdout + made.stderr


def package(name):
    return re.sub(r"^\d+:|[-+~].*", "", run("dpkg-query", "-W", "-f", "${Version}", name))


def sources():
    """Writes the inputs of converters: the prism as a PLY with vertex colours, the boxes as an OBJ with materials."""
    lines = ["ply", "format ascii 1.0", "element vertex 16", *(f"property float {a}" for a in "xyz")]
    lines += [f"property uchar {c}" for c in ("red", "green", "blue")]
    lines += ["element face 28", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(str, [*map(int, p), *c])) for p, c in zip(shapes.PRISM_POINTS, shapes.PRISM_COLOURS)]
    lines += [" ".join(map(str, [3, *t])) for t in shapes.PRISM_TRIANGLES]
    pathlib.Path(shapes.place("source", "prism.ply")).write_text("\n".join(lines) + "\n")
    mtl, obj, first = [], ["mtllib boxes.mtl"], 1
    for name, colour, points in shapes.BOXES:
        mtl += [f"newmtl {name}", "Kd " + " ".join(f"{c / 255:.4f}" for c in colour)]
        obj += [f"o {name}", f"usemtl {name}", *("v " + " ".join(f"{x:g}" for x in p) for p in points)]
        obj += ["f " + " ".join(str(i + first) for i in face) for face in shapes.BOX_FACES]
        first += 8
    pathlib.Path("source/boxes.mtl").write_text("\n".join(mtl) + "\n")
    pathlib.Path("source/boxes.obj").write_text("\n".join(obj) + "\n")


def cloudcompare():
    shapes.note("cloudcompare", package("cloudcompare"))
    for extension, kind, flags in (
        ("ply", "PLY", []),
        ("ply", "PLY", ["-PLY_EXPORT_FMT", "ASCII"]),
        ("obj", "OBJ", []),
        ("stl", "STL", []),
        ("off", "OFF", []),
        ("vtk", "VTK", []),
    ):
        name = ("text" if flags else "prism") + "." + extension
        path = os.path.abspath(shapes.place("cloudcompare", name))
        command = ["xvfb-run", "-a", "CloudCompare", "-SILENT", "-AUTO_SAVE", "OFF", "-M_EXPORT_FMT", kind, *flags]
        shapes.attempt(
            path, lambda: run(*command, "-O", os.path.abspath("source/prism.ply"), "-SAVE_MESHES", "FILE", path)
        )


def meshlab():
    shapes.note("meshlab", package("meshlab"))
    # MeshLab's reader of OBJ fails on the boxes: it gets only the prism.
    for name, masks in {
        "prism.ply": "vc fc vn",
        "prism_faces.ply": "fc",
        "prism.obj": "vc vn",
        "prism.off": "vc fc",
        "prism.stl": "fc",
        "prism.dae": "vc",
        "prism.wrl": "vc",
        "prism.ctm": "vc",
        "prism.x3d": "vc",
    }.items():
        path = shapes.place("meshlab", name)
        command = ["xvfb-run", "-a", "meshlabserver", "-i", "source/prism.ply", "-o", path, "-m", *masks.split()]
        shapes.attempt(path, lambda: run(*command))


def assimp():
    shapes.note("assimp", package("assimp-utils"))
    for source in ("prism.ply", "boxes.obj"):
        stem = pathlib.Path(source).stem
        for kind, extension in (
            ("obj", "obj"),
            ("objnomtl", "obj"),
            ("stl", "stl"),
            ("stlb", "stl"),
            ("ply", "ply"),
            ("plyb", "ply"),
            ("gltf2", "gltf"),
            ("glb2", "glb"),
            ("gltf", "gltf"),
            ("glb", "glb"),
            ("collada", "dae"),
            ("3mf", "3mf"),
            ("fbx", "fbx"),
        ):
            path = shapes.place("assimp", f"{kind}/{stem}.{extension}")
            shapes.attempt(path, lambda: run("assimp", "export", f"source/{source}", path, f"-f{kind}"))


def open3d():
    import open3d as o3d

    shapes.note("open3d", o3d.__version__)
    mesh = o3d.geometry.TriangleMesh()
    mesh.vertices = o3d.utility.Vector3dVector(shapes.PRISM_POINTS.astype(float))
    mesh.triangles = o3d.utility.Vector3iVector(numpy.array(shapes.PRISM_TRIANGLES))
    mesh.vertex_colors = o3d.utility.Vector3dVector(shapes.PRISM_COLOURS / 255.0)
    mesh.compute_vertex_normals()
    for name, options in (
        ("prism.ply", {}),
        ("text.ply", {"write_ascii": True}),
        ("prism.obj", {}),
        ("prism.stl", {}),
        ("prism.off", {}),
        ("prism.glb", {}),
        ("prism.gltf", {}),
    ):
        path = shapes.place("open3d", name)
        shapes.attempt(path, lambda: o3d.io.write_triangle_mesh(path, mesh, **options))


def by_meshio():
    shapes.note("meshio", meshio.__version__)
    points = numpy.array([(x, y, z) for z in range(3) for y in range(3) for x in range(4)], float)
    at = lambda x, y, z: x + 4 * (y + 3 * z)
    ring = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [[at(x + a, y + b, z + c) for a, b, c in ring] for z in range(2) for y in range(2) for x in range(3)]
    # Six tetrahedra a cell share its diagonal; vertices ascend, as FEniCS lists them.
    paths = [(0, 1, 2, 6), (0, 1, 5, 6), (0, 3, 2, 6), (0, 3, 7, 6), (0, 4, 5, 6), (0, 4, 7, 6)]
    tetrahedra = [sorted(c[i] for i in p) for c in cells for p in paths]
    values = {"u": points[:, 0], "v": points.copy()}
    for stem, kind, blocks in (("blocks", "hexahedron", cells), ("fenics", "tetra", tetrahedra)):
        mesh = meshio.Mesh(points, [(kind, numpy.array(blocks))], point_data=values)
        for name, options in (
            (f"{stem}.vtu", {}),
            (f"{stem}_text.vtu", {"binary": False}),
            (f"{stem}.vtk", {}),
            (f"{stem}_text.vtk", {"binary": False}),
        ):
            path = shapes.place("meshio", name)
            shapes.attempt(path, lambda: mesh.write(path, **options))
    surface = meshio.Mesh(shapes.PRISM_POINTS, [("triangle", numpy.array(shapes.PRISM_TRIANGLES))])
    for name, options in (
        ("prism.ply", {}),
        ("text.ply", {"binary": False}),
        ("prism.obj", {}),
        ("prism.off", {}),
        ("prism.stl", {"binary": True}),
        ("text.stl", {}),
        ("prism.vtk", {}),
        ("prism.vtu", {}),
    ):
        path = shapes.place("meshio", name)
        shapes.attempt(path, lambda: surface.write(path, **options))


def gmsh():
    shapes.note("gmsh", package("gmsh"))
    script = pathlib.Path(shapes.place("source", "box.geo"))
    script.write_text(
        'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 3, 2, 1};\nMesh.MeshSizeMin = 5;\nMesh.MeshSizeMax = 5;\n'
    )
    for name, flags in {
        "box.vtk": ["-3", "-format", "vtk"],
        "box_binary.vtk": ["-3", "-format", "vtk", "-bin"],
        "box_all.vtk": ["-3", "-format", "vtk", "-save_all"],
        "second_order.vtk": ["-3", "-order", "2", "-format", "vtk", "-save_all"],
        "box.stl": ["-2", "-format", "stl"],
        "box_binary.stl": ["-2", "-format", "stl", "-bin"],
        "box.ply": ["-2", "-format", "ply2"],
        "box.msh": ["-3"],
    }.items():
        path = shapes.place("gmsh", name)
        shapes.attempt(path, lambda: run("gmsh", str(script), *flags, "-o", path))


def solids():
    """CAD programs: OpenSCAD, admesh, FreeCAD."""
    shapes.note("openscad", package("openscad"))
    script = pathlib.Path(shapes.place("source", "prism.scad"))
    outline = "[[0,0],[3,0],[3,2],[2,2],[2,1],[1,1],[1,2],[0,2]]"
    script.write_text(f"linear_extrude(1) polygon({outline});\n")
    for name, flags in (
        ("prism.stl", []),
        ("binary.stl", ["--export-format", "binstl"]),
        ("prism.off", []),
        ("prism.3mf", []),
        ("prism.amf", []),
    ):
        path = shapes.place("openscad", name)
        shapes.attempt(path, lambda: run("openscad", str(script), "-o", path, *flags))
    shapes.note("admesh", package("admesh"))
    for name, flag in (("binary.stl", "-b"), ("text.stl", "-a")):
        path = shapes.place("admesh", name)
        shapes.attempt(path, lambda: run("admesh", "-c", flag, path, "openscad/prism.stl"))
    shapes.note("freecad", package("freecad-python3"))
    code = pathlib.Path(shapes.place("source", "freecad_part.py"))
    code.write_text(
        "import sys\nsys.path.append('/usr/lib/freecad-python3/lib')\nsys.path.append('/usr/lib/freecad/lib')\n"
        "import FreeCAD, Part, Mesh, MeshPart\n"
        "points = [FreeCAD.Vector(x, y, 0) for x, y in [(0,0),(3,0),(3,2),(2,2),(2,1),(1,1),(1,2),(0,2),(0,0)]]\n"
        "solid = Part.Face(Part.makePolygon(points)).extrude(FreeCAD.Vector(0, 0, 1))\n"
        "mesh = MeshPart.meshFromShape(Shape=solid, LinearDeflection=0.1)\n"
        "for name in sys.argv[1:]:\n    mesh.write(name)\n"
    )
    names = [shapes.place("freecad", f"prism.{e}") for e in ("stl", "ast", "obj", "ply", "off", "3mf")]
    shapes.attempt("freecad", lambda: run("python3", str(code), *names))


def draco_and_scene_graph():
    shapes.note("draco", package("draco"))
    shapes.attempt(
        "draco", lambda: run("draco_encoder", "-i", "source/prism.ply", "-o", shapes.place("draco", "prism.drc"))
    )
    shapes.attempt("draco", lambda: run("draco_decoder", "-i", "draco/prism.drc", "-o", "draco/decoded.ply"))
    shapes.attempt("draco", lambda: run("draco_decoder", "-i", "draco/prism.drc", "-o", "draco/decoded.obj"))
    shapes.note("openscenegraph", package("openscenegraph"))
    for name in ("boxes.obj", "boxes.stl"):
        shapes.attempt(name, lambda: run("osgconv", "source/boxes.obj", shapes.place("openscenegraph", name)))


for part in (sources, cloudcompare, meshlab, assimp, open3d, by_meshio, gmsh, solids, draco_and_scene_graph):
    shapes.attempt(part.__name__, part)
