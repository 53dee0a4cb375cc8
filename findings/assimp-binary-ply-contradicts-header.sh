#!/usr/bin/env bash
# Assimp 5.2.5 writes binary PLY files with vertex colours that nothing can read as their header says.
# The header declares "property uchar red" and three like it, the body holds four floats of 0..1 instead:
# each vertex takes 28 bytes where the header tells 16. Its text PLY of the same mesh is right.
# A reader that trusts the header takes colours for faces; the file's length is what gives it away.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download assimp-utils=5.2.5~ds0-1+b1 libassimp5=5.2.5~ds0-1+b1
for package in *.deb; do dpkg-deb -x "$package" root; done
export LD_LIBRARY_PATH=$folder/root/usr/lib/x86_64-linux-gnu

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
root/usr/bin/assimp version | grep -i "version"
root/usr/bin/assimp export in.ply binary.ply -fplyb > /dev/null
root/usr/bin/assimp export in.ply text.ply -fply > /dev/null
python3 - <<'PYTHON'
import struct
import sys

data = open("binary.ply", "rb").read()
at = data.index(b"end_header\n") + 11
header, body = data[:at].decode(), data[at:]
print(*(line for line in header.splitlines() if "property" in line), sep="\n")
declared = 3 * (12 + 4) + 13
print(f"body: {len(body)} bytes; the header's is {declared}, with colours as floats it is {3 * 28 + 13}")
print("first vertex as floats:", [round(v, 4) for v in struct.unpack("<7f", body[:28])])
text = open("text.ply").read().split("end_header\n")[1].splitlines()[0]
print("first vertex of the text file:", text)
same = "property uchar red" in header and len(body) == 3 * 28 + 13 and text.split()[3:] == ["200", "30", "30", "255"]
sys.exit(0 if same else "changed: Assimp's binary PLY")
PYTHON
