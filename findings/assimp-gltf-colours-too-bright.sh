#!/usr/bin/env bash
# Assimp 5.2.5 copies the bytes of a PLY's colours into glTF's COLOR_0 as they are: 200 becomes 0.784.
# Colours of PLY are display values, COLOR_0 is linear (glTF 2.0, 3.9.2), where 200 is 0.578: the export looks too bright.
# three's exporter, given the same colour, writes 147 of 255, which is 0.576; so a glTF viewer cannot guess which one it has.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download assimp-utils=5.2.5~ds0-1+b1 libassimp5=5.2.5~ds0-1+b1
for package in *.deb; do dpkg-deb -x "$package" root; done
export LD_LIBRARY_PATH=$folder/root/usr/lib/x86_64-linux-gnu
npm install --silent --ignore-scripts --no-audit --no-fund three@0.187.0 > /dev/null

cat > in.ply <<'END'
ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 200 30 30
1 0 0 200 30 30
0 1 0 200 30 30
3 0 1 2
END
root/usr/bin/assimp export in.ply assimp.glb -fglb2 > /dev/null
cat > three.mjs <<'END'
import { readFileSync, writeFileSync } from "node:fs";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";
import * as three from "three";
globalThis.FileReader = class {
  readAsArrayBuffer(blob) { blob.arrayBuffer().then((b) => { this.result = b; this.onloadend(); }); }
};
const mesh = new three.Mesh(new PLYLoader().parse(readFileSync("in.ply", "utf8")), new three.MeshBasicMaterial({ vertexColors: true }));
writeFileSync("three.glb", Buffer.from(await new GLTFExporter().parseAsync(mesh, { binary: true })));
END
node three.mjs
root/usr/bin/assimp version | grep -i "version"
python3 - <<'PYTHON'
import json
import struct
import sys

def red(path):
    data = open(path, "rb").read()
    length = struct.unpack("<I", data[12:16])[0]
    told = json.loads(data[20 : 20 + length])
    colour = told["accessors"][told["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    view = told["bufferViews"][colour["bufferView"]]
    at = 28 + length + view.get("byteOffset", 0) + colour.get("byteOffset", 0)
    kind, most = {5126: ("<f", 1), 5123: ("<H", 65535), 5121: ("<B", 255)}[colour["componentType"]]
    return struct.unpack_from(kind, data, at)[0] / most

found = {name: round(red(f"{name}.glb"), 3) for name in ("assimp", "three")}
print("red of COLOR_0 for 200 of 255:", found)
sys.exit(0 if found == {"assimp": 0.784, "three": 0.576} else "changed")
PYTHON
