// Writes meshes and volumes by what npm has: three, glTF-Transform, gltfpack, obj2gltf, gltf-pipeline, assimpjs, vtk.js, itk-wasm.
// usage: node node_files.mjs MODULES, in the folder where the Python writers have left source/ and blender/.
import { execFileSync } from "node:child_process";
import { appendFileSync, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const modules = resolve(process.argv[2]);
const require = createRequire(join(modules, "index.js"));
const load = (name) => import(pathToFileURL(join(modules, "node_modules", name)));

function place(writer, name) {
  const path = join(writer, name);
  mkdirSync(dirname(path), { recursive: true });
  return path;
}

function note(writer, folder) {
  const { version } = JSON.parse(readFileSync(join(modules, "node_modules", folder, "package.json")));
  appendFileSync("versions.tsv", `${writer}\t${version}\n`);
}

async function attempt(what, action) {
  try {
    await action();
  } catch (error) {
    console.log(`${what}: ${String(error.stderr || error.message || error).trim().split("\n").slice(-1)[0].slice(0, 300)}`);
  }
}

const run = (program, ...flags) => execFileSync(join(modules, "node_modules/.bin", program), flags, { stdio: "pipe" });

// The prism of shapes.py, its left half red, its right half blue.
const OUTLINE = [[0, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]];
const U = [[0, 1, 5], [0, 5, 7], [5, 6, 7], [1, 4, 5], [1, 2, 4], [2, 3, 4]];
const points = [0, 1].flatMap((z) => OUTLINE.map(([x, y]) => [x, y, z]));
const quads = OUTLINE.map((_, i) => [i, (i + 1) % 8, 8 + ((i + 1) % 8), 8 + i]);
const sides = quads.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]);
const triangles = [...U.map((t) => [...t].reverse()), ...U.map((t) => t.map((i) => i + 8)), ...sides];
const colours = points.map(([x]) => (x < 1.5 ? [200, 30, 30] : [30, 30, 200]));

// The marked volume of shapes.py.
const size = [24, 20, 16], spacing = [1, 1.5, 2], origin = [10, -20, 30];
const inside = (v, lo) => v >= lo && v < lo + 3;
function voxels(kind) {
  const values = new kind(size[0] * size[1] * size[2]);
  for (let z = 0, i = 0; z < size[2]; ++z)
    for (let y = 0; y < size[1]; ++y)
      for (let x = 0; x < size[0]; ++x, ++i)
        values[i] = inside(x, 18) && inside(y, 3) && inside(z, 10) ? 240 : x + 2 * y + 3 * z;
  return values;
}

async function three() {
  note("three", "three");
  // The exporter knows browsers alone.
  globalThis.FileReader = class {
    readAsArrayBuffer(blob) {
      blob.arrayBuffer().then((b) => { this.result = b; this.onloadend(); });
    }
    readAsDataURL(blob) {
      blob.arrayBuffer().then((b) => {
        this.result = `data:${blob.type};base64,${Buffer.from(b).toString("base64")}`;
        this.onloadend();
      });
    }
  };
  const T = await load("three/build/three.module.js");
  const exporter = async (name) => (await load(`three/examples/jsm/exporters/${name}.js`))[name];
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.Float32BufferAttribute(points.flat(), 3));
  const linear = colours.map((c) => new T.Color().setRGB(...c.map((v) => v / 255), T.SRGBColorSpace).toArray());
  geometry.setAttribute("color", new T.Float32BufferAttribute(linear.flat(), 3));
  geometry.setIndex(triangles.flat());
  geometry.computeVertexNormals();
  const mesh = new T.Mesh(geometry, new T.MeshStandardMaterial({ vertexColors: true, metalness: 0 }));
  const scene = new T.Scene();
  scene.add(mesh);
  const bytes = (data) => (typeof data === "string" ? data : Buffer.from(data.buffer ?? data));
  const gltf = new (await exporter("GLTFExporter"))();
  const save = (name, data) => writeFileSync(place("three", name), bytes(data));
  await attempt("three glb", async () => save("prism.glb", await gltf.parseAsync(scene, { binary: true })));
  await attempt("three gltf", async () => save("prism.gltf", JSON.stringify(await gltf.parseAsync(scene))));
  const row = new T.InstancedMesh(geometry, mesh.material, 4);
  for (let i = 0; i < 4; ++i) row.setMatrixAt(i, new T.Matrix4().makeTranslation(5 * i, 0, 0));
  await attempt("three instances", async () => save("instances.glb", await gltf.parseAsync(row, { binary: true })));
  const ply = new (await exporter("PLYExporter"))();
  save("prism.ply", ply.parse(scene, undefined, { binary: true }));
  save("big_endian.ply", ply.parse(scene, undefined, { binary: true, littleEndian: false }));
  save("text.ply", ply.parse(scene, undefined, {}));
  const stl = new (await exporter("STLExporter"))();
  save("prism.stl", stl.parse(scene, { binary: true }));
  save("text.stl", stl.parse(scene));
  save("prism.obj", new (await exporter("OBJExporter"))().parse(scene));
}

/** Four prisms in a row by one mesh, with colours, as a source for what packs glTF. */
async function row() {
  note("gltf-transform", "@gltf-transform/cli");
  const { Document, NodeIO } = await load("@gltf-transform/core/dist/index.modern.js").catch(() => import(require.resolve("@gltf-transform/core")));
  const doc = new Document();
  const buffer = doc.createBuffer();
  const accessor = (type, array) => doc.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const primitive = doc.createPrimitive()
    .setAttribute("POSITION", accessor("VEC3", new Float32Array(points.flat())))
    .setAttribute("COLOR_0", accessor("VEC4", new Uint8Array(colours.flatMap((c) => [...c, 255]))).setNormalized(true))
    .setIndices(accessor("SCALAR", new Uint16Array(triangles.flat())))
    .setMaterial(doc.createMaterial("plain").setMetallicFactor(0));
  const mesh = doc.createMesh("prism").addPrimitive(primitive);
  const scene = doc.createScene();
  for (let i = 0; i < 4; ++i) scene.addChild(doc.createNode(`prism ${i}`).setMesh(mesh).setTranslation([5 * i, 0, 0]));
  await new NodeIO().write(place("gltf-transform", "row.glb"), doc);
  await new NodeIO().write(place("gltf-transform", "separate/row.gltf"), doc);
}

async function packers() {
  const source = "gltf-transform/row.glb", textured = "blender/textured.glb";
  for (const [name, flags, from] of [
    ["draco", ["draco"], source],
    ["draco_sequential", ["draco", "--method", "sequential"], source],
    ["meshopt", ["meshopt"], source],
    ["meshopt_medium", ["meshopt", "--level", "medium"], source],
    ["quantize", ["quantize"], source],
    ["quantize_scene", ["quantize", "--quantization-volume", "scene"], source],
    ["instance", ["instance", "--min", "2"], source],
    ["optimize", ["optimize", "--instance-min", "2"], source],
    ["optimize_draco", ["optimize", "--compress", "draco", "--instance-min", "2"], source],
    ["optimize_quantize", ["optimize", "--compress", "quantize"], source],
    ["join", ["join"], source],
    ["unlit", ["unlit"], source],
    ["textured_webp", ["webp"], textured],
    ["textured_avif", ["avif"], textured],
    ["textured_jpeg", ["jpeg", "--formats", "*"], textured],
    ["textured_optimize", ["optimize", "--texture-compress", "webp"], textured],
    ["palette", ["palette", "--min", "2"], "blender/boxes.glb"],
    ["partition", ["partition"], source],
  ]) {
    const out = name === "partition" ? "partition/row.gltf" : `${name}.glb`;
    await attempt(name, () => run("gltf-transform", flags[0], from, place("gltf-transform", out), ...flags.slice(1)));
  }
  note("gltfpack", "gltfpack");
  for (const [name, flags, from] of [
    ["plain", [], source],
    ["normalised", ["-vpn"], source],
    ["floats", ["-vpf"], source],
    ["exact", ["-noq"], source],
    ["c", ["-c"], source],
    ["cc", ["-cc"], source],
    ["cz", ["-cz"], source],
    ["c_khr", ["-c", "-ce", "khr"], source],
    ["c_fallback", ["-cf"], source],
    ["instances", ["-mi"], source],
    ["instances_c", ["-mi", "-c"], source],
    ["merged", ["-mm"], source],
    ["named", ["-kn", "-km"], source],
    ["interleaved", ["-vi"], source],
    ["textured", [], textured],
    ["textured_webp", ["-tw"], textured],
    ["textured_ktx2", ["-tc"], textured],
    ["boxes_from_obj", [], "source/boxes.obj"],
  ])
    await attempt(name, () => run("gltfpack", "-i", from, "-o", place("gltfpack", `${name}.glb`), ...flags));
  await attempt("gltfpack gltf", () => run("gltfpack", "-i", source, "-o", place("gltfpack", "separate/row.gltf"), "-c"));
  note("obj2gltf", "obj2gltf");
  await attempt("obj2gltf", () => run("obj2gltf", "-i", "source/boxes.obj", "-o", place("obj2gltf", "boxes.glb"), "--inputUpAxis", "Y"));
  note("gltf-pipeline", "gltf-pipeline");
  for (const [out, flags] of [["draco.glb", ["-d"]], ["separate/row.gltf", ["-s"]], ["embedded.gltf", []]])
    await attempt(out, () => run("gltf-pipeline", "-i", source, "-o", place("gltf-pipeline", out), ...flags));
}

async function assimp() {
  note("assimpjs", "assimpjs");
  const ajs = await require("assimpjs")();
  const list = new ajs.FileList();
  for (const name of ["boxes.obj", "boxes.mtl"]) list.AddFile(name, new Uint8Array(readFileSync(`source/${name}`)));
  for (const [kind, extension] of [["glb2", "glb"], ["gltf2", "gltf"]]) {
    const made = ajs.ConvertFileList(list, kind);
    if (!made.IsSuccess()) throw new Error(made.GetErrorCode());
    for (let i = 0; i < made.FileCount(); ++i) {
      const name = i ? made.GetFile(i).GetPath() : `boxes.${extension}`;
      writeFileSync(place("assimpjs", `${kind}/${name}`), made.GetFile(i).GetContent());
    }
  }
}

async function vtkjs() {
  note("vtk.js", "@kitware/vtk.js");
  const part = async (name) => (await load(`@kitware/vtk.js/${name}.js`)).default;
  const array = await part("Common/Core/DataArray");
  const image = (await part("Common/DataModel/ImageData")).newInstance();
  image.setDimensions(size);
  image.setSpacing(spacing);
  image.setOrigin(origin);
  image.getPointData().setScalars(array.newInstance({ name: "density", values: voxels(Int16Array) }));
  const mesh = (await part("Common/DataModel/PolyData")).newInstance();
  mesh.getPoints().setData(new Float32Array(points.flat()), 3);
  mesh.getPolys().setData(new Uint32Array(triangles.flatMap((t) => [3, ...t])));
  mesh.getPointData().setScalars(array.newInstance({ name: "colour", numberOfComponents: 3, values: new Uint8Array(colours.flat()) }));
  for (const [writer, data, name] of [
    ["IO/XML/XMLPolyDataWriter", mesh, "prism.vtp"],
    ["IO/XML/XMLImageDataWriter", image, "volume.vti"],
  ])
    await attempt(name, async () => {
      const made = (await part(writer)).newInstance();
      writeFileSync(place("vtk.js", name), made.write(data));
    });
  await attempt("vtk.js stl", async () => {
    const made = (await part("IO/Geometry/STLWriter")).newInstance();
    made.setInputData(mesh);
    writeFileSync(place("vtk.js", "prism.stl"), Buffer.from(made.getOutputData().buffer));
  });
}

async function itk() {
  note("itk-wasm", "@itk-wasm/image-io");
  const { writeImageNode } = await import(pathToFileURL(require.resolve("@itk-wasm/image-io")));
  const { writeMeshNode } = await import(pathToFileURL(require.resolve("@itk-wasm/mesh-io")));
  const types = { u1: ["uint8", Uint8Array], i2: ["int16", Int16Array], f4: ["float32", Float32Array] };
  const image = ([componentType, kind]) => ({
    imageType: { dimension: 3, componentType, pixelType: "Scalar", components: 1 },
    name: "volume", origin, spacing, direction: new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]), size,
    data: voxels(kind), metadata: new Map(),
  });
  for (const [name, type, compress] of [
    ["volume.nrrd", "i2", false], ["compressed.nrrd", "i2", true], ["volume.nhdr", "i2", false],
    ["volume.mha", "i2", false], ["compressed.mha", "i2", true], ["volume.mhd", "i2", false],
    ["volume.nii", "i2", false], ["volume.nii.gz", "i2", true], ["float.nii.gz", "f4", true], ["pair.hdr", "i2", false],
    ["volume.vtk", "i2", false], ["volume.tif", "u1", false], ["compressed.tif", "u1", true],
    ["volume.mgz", "f4", true], ["volume.hdf5", "i2", false], ["volume.mrc", "i2", false], ["volume.gipl", "i2", false],
  ])
    await attempt(name, () => writeImageNode(image(types[type]), place("itk-wasm", name), { useCompression: compress }));
  const cells = new Uint32Array(triangles.flatMap((t) => [2, 3, ...t]));
  const mesh = {
    meshType: {
      dimension: 3, pointComponentType: "float32", pointPixelComponentType: "int8", pointPixelType: "Scalar",
      pointPixelComponents: 0, cellComponentType: "uint32", cellPixelComponentType: "int8", cellPixelType: "Scalar", cellPixelComponents: 0,
    },
    name: "prism", numberOfPoints: 16, points: new Float32Array(points.flat()),
    numberOfCells: triangles.length, cells, cellBufferSize: cells.length,
    numberOfPointPixels: 0, pointData: null, numberOfCellPixels: 0, cellData: null,
  };
  for (const name of ["prism.vtk", "prism.obj", "prism.off", "prism.stl"])
    await attempt(name, () => writeMeshNode(mesh, place("itk-wasm", name)));
}

for (const part of [three, row, packers, assimp, vtkjs, itk]) await attempt(part.name, part);
if (!existsSync("blender/textured.glb")) console.log("blender/textured.glb: not there, so nothing is made of it");
process.exit(0);
