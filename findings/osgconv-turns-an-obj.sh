#!/usr/bin/env bash
# OpenSceneGraph 3.6.5: osgconv in.obj out.obj turns the mesh by 90 degrees about x, and a second time by another 90.
# Its OBJ reader turns y up into z up, its OBJ and STL writers do not turn back.
# -O noRotation leaves it alone.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download openscenegraph=3.6.5+dfsg1-8+b2 libopenscenegraph161=3.6.5+dfsg1-8+b2 libopenthreads21
for package in *.deb; do dpkg-deb -x "$package" root; done
export LD_LIBRARY_PATH=$folder/root/usr/lib/x86_64-linux-gnu
OSG_LIBRARY_PATH=$(dirname "$(find "$folder/root" -name 'osgdb_obj.so')")
export OSG_LIBRARY_PATH

printf 'v 0 0 0\nv 4 0 0\nv 0 1 0\nv 0 0 2\nf 1 2 3\nf 1 3 4\n' > in.obj
grep -a -m1 -o "OpenSceneGraph 3[.0-9]*" root/usr/share/doc/openscenegraph/* 2> /dev/null || ls openscenegraph_*.deb
root/usr/bin/osgconv in.obj once.obj > /dev/null
root/usr/bin/osgconv once.obj twice.obj > /dev/null
root/usr/bin/osgconv -O noRotation in.obj left.obj > /dev/null
python3 - <<'PYTHON'
import sys

def box(name):
    points = [list(map(float, line.split()[1:4])) for line in open(name) if line.startswith("v ")]
    return [round(f(p[i] for p in points), 3) + 0 for f in (min, max) for i in range(3)]

found = [box(f"{n}.obj") for n in ("in", "once", "twice", "left")]
for name, told in zip(("in", "once", "twice", "noRotation"), found):
    print(f"{name:10}", told[:3], "..", told[3:])
right = [[0, 0, 0, 4, 1, 2], [0, -2, 0, 4, 0, 1], [0, -1, -2, 4, 0, 0], [0, 0, 0, 4, 1, 2]]
sys.exit(0 if found == right else "changed")
PYTHON
