#!/usr/bin/env bash
# gltf-pipeline 4.3.1 makes the bounds of an accessor larger than its data when it compresses by Draco.
# A mesh of 0..3 gets min -0.0015 and max 3.0015, eight steps of its 11 bits; decoded positions stay within 0..3.
# glTF 2.0 (3.6.2.5) demands the actual minimum and maximum, so a view that is framed by them is off by 0.05 %.
# glTF-Transform 4.5.1 leaves 0..3.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --ignore-scripts --no-audit --no-fund gltf-pipeline@4.3.1 @gltf-transform/cli@4.5.1 > /dev/null

python3 - <<'PYTHON'
import base64
import json
import struct

points = [(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 1)]
data = b"".join(struct.pack("<3f", *p) for p in points) + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
json.dump({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [3, 2, 1]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
}, open("in.gltf", "w"))
PYTHON
bin=node_modules/.bin
"$bin/gltf-pipeline" -i in.gltf -o pipeline.gltf -d > /dev/null
"$bin/gltf-transform" draco in.gltf transform.gltf > /dev/null
"$bin/gltf-transform" copy pipeline.gltf decoded.gltf > /dev/null
node -e '
const { readFileSync } = require("fs");
const bounds = (name) => {
  const told = JSON.parse(readFileSync(name + ".gltf"));
  const { min, max } = told.accessors[told.meshes[0].primitives[0].attributes.POSITION];
  return [min[0], max[0]].map((v) => Math.round(v * 1e4) / 1e4);
};
console.log("gltf-pipeline", require("./node_modules/gltf-pipeline/package.json").version);
const found = { told: bounds("pipeline"), other: bounds("transform"), decoded: bounds("decoded") };
console.log("x by gltf-pipeline:", found.told, "by glTF-Transform:", found.other, "in the data of the former:", found.decoded);
const same = found.told[0] < -0.001 && found.told[1] > 3.001 && found.other[1] === 3 && found.decoded[0] > -0.0005 && found.decoded[1] < 3.0005;
if (!same) { console.log("changed"); process.exit(1); }
'
