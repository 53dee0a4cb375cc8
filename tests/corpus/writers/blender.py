"""Writes meshes by Blender: blender -b -P blender.py."""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import shapes


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def add(name, points, faces, colour=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, p)) for p in points], [], faces)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    if colour:
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        linear = [(c / 255) ** 2.2 for c in colour]
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*linear, 1)
        material.diffuse_color = (*linear, 1)
        mesh.materials.append(material)
    return mesh


def prism(domain):
    """domain: POINT or CORNER carries the colours."""
    empty()
    mesh = add("prism", shapes.PRISM_POINTS, shapes.PRISM_FACES)
    layer = mesh.color_attributes.new("colour", "BYTE_COLOR" if domain == "CORNER" else "FLOAT_COLOR", domain)
    at = [v.index for v in mesh.vertices] if domain == "POINT" else [c.vertex_index for c in mesh.loops]
    for i, vertex in enumerate(at):
        layer.data[i].color = (*(shapes.PRISM_COLOURS[vertex] / 255.0), 1)
    mesh.color_attributes.active_color = layer


def boxes():
    empty()
    for name, colour, points in shapes.BOXES:
        add(name, points, shapes.BOX_FACES, colour)


def textured():
    """The boxes with one picture for both, red in its left half and blue in its right half."""
    empty()
    picture = bpy.data.images.new("halves", 8, 8)
    picture.pixels = [
        c for _ in range(8) for x in range(8) for c in ((0.78, 0.1, 0.1, 1) if x < 4 else (0.1, 0.1, 0.78, 1))
    ]
    picture.filepath_raw = os.path.abspath(shapes.place("blender", "halves.png"))
    picture.file_format = "PNG"
    picture.save()
    material = bpy.data.materials.new("halves")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    shader = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    for (name, _, points), u in zip(shapes.BOXES, (0.25, 0.75)):
        mesh = add(name, points, shapes.BOX_FACES)
        mesh.materials.append(material)
        layer = mesh.uv_layers.new()
        for corner in layer.data:
            corner.uv = (u, 0.5)


def write(operator, name, **options):
    path = shapes.place("blender", name)
    shapes.attempt(path, lambda: operator(filepath=os.path.abspath(path), **options))


shapes.note("blender", bpy.app.version_string)
axes = {"axis_forward": "Y", "axis_up": "Z"}
for domain in ("POINT", "CORNER"):
    prism(domain)
    kind = domain.lower()
    write(bpy.ops.export_scene.gltf, f"prism_{kind}.glb", export_format="GLB", export_yup=False)
    write(bpy.ops.wm.obj_export, f"prism_{kind}.obj", export_colors=True, forward_axis="Y", up_axis="Z")
    write(bpy.ops.export_mesh.ply, f"prism_{kind}_text.ply", use_ascii=True, **axes)
    write(bpy.ops.export_mesh.ply, f"prism_{kind}_binary.ply", use_ascii=False, **axes)
write(bpy.ops.export_mesh.stl, "prism_binary.stl", **axes)
write(bpy.ops.export_mesh.stl, "prism_text.stl", ascii=True, **axes)
write(bpy.ops.export_scene.obj, "prism_old_exporter.obj", **axes)
boxes()
write(bpy.ops.export_scene.gltf, "boxes.glb", export_format="GLB", export_yup=False)
write(bpy.ops.export_scene.gltf, "boxes_separate/boxes.gltf", export_format="GLTF_SEPARATE", export_yup=False)
write(bpy.ops.export_scene.gltf, "boxes_embedded.gltf", export_format="GLTF_EMBEDDED", export_yup=False)
write(bpy.ops.export_scene.gltf, "boxes_draco.glb", export_yup=False, export_draco_mesh_compression_enable=True)
write(bpy.ops.wm.obj_export, "boxes.obj", forward_axis="Y", up_axis="Z")
write(bpy.ops.wm.obj_export, "boxes_triangles.obj", forward_axis="Y", up_axis="Z", export_triangulated_mesh=True)
textured()
write(bpy.ops.export_scene.gltf, "textured.glb", export_format="GLB", export_yup=False)
write(bpy.ops.wm.obj_export, "textured.obj", forward_axis="Y", up_axis="Z", path_mode="RELATIVE")
