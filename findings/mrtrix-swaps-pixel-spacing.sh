#!/usr/bin/env bash
# MRtrix 3.0.3 takes DICOM's PixelSpacing the wrong way round.
# PS3.3, 10.7.1.3: its first value is the distance of rows (along y), its second that of columns (along x).
# A slice of 4 columns and 3 rows with PixelSpacing 1.5\1.0 is 4 mm wide and 4.5 mm high; mrinfo tells voxels of 1.5 x 1.
# Slices whose pixels are squares hide it; others get stretched, by mrconvert into every format.
# GDCM, whose gdcminfo is asked too, tells 1 x 1.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download mrtrix3=3.0.3-3+b1 libgdcm-tools=3.0.21-1 libgdcm3.0=3.0.21-1
for package in *.deb; do dpkg-deb -x "$package" root; done
export LD_LIBRARY_PATH=$folder/root/usr/lib/x86_64-linux-gnu:$folder/root/usr/lib/mrtrix/lib
LD_LIBRARY_PATH+=:$(dirname "$(find root -name 'libmrtrix*' | head -1)")

python3 - <<'PYTHON'
import pathlib
import struct

def element(group, number, kind, value):
    if isinstance(value, str):
        value = value.encode()
        value += (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
    head = struct.pack("<HH2s", group, number, kind.encode())
    return head + (struct.pack("<HI", 0, len(value)) if kind in ("OB", "OW") else struct.pack("<H", len(value))) + value

u2 = lambda v: struct.pack("<H", v)
CT = "1.2.840.10008.5.1.4.1.1.2"
pathlib.Path("slices").mkdir()
for z in range(3):
    uid = f"1.2.3.{z + 1}"
    meta = element(2, 1, "OB", b"\0\1") + element(2, 2, "UI", CT) + element(2, 3, "UI", uid)
    meta += element(2, 16, "UI", "1.2.840.10008.1.2.1") + element(2, 18, "UI", "1.2.3.9")
    data = b"".join([
        element(8, 8, "CS", "ORIGINAL\\PRIMARY\\AXIAL"), element(8, 0x16, "UI", CT), element(8, 0x18, "UI", uid),
        element(8, 0x60, "CS", "CT"), element(0x10, 0x10, "PN", "A^B"), element(0x10, 0x20, "LO", "1"),
        element(0x18, 0x50, "DS", "2"), element(0x20, 0xD, "UI", "1.2.3.7"), element(0x20, 0xE, "UI", "1.2.3.8"),
        element(0x20, 0x11, "IS", "1"), element(0x20, 0x13, "IS", str(z + 1)),
        element(0x20, 0x32, "DS", f"0\\0\\{2 * z}"), element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
        element(0x28, 2, "US", u2(1)), element(0x28, 4, "CS", "MONOCHROME2"), element(0x28, 0x10, "US", u2(3)),
        element(0x28, 0x11, "US", u2(4)), element(0x28, 0x30, "DS", "1.5\\1.0"), element(0x28, 0x100, "US", u2(16)),
        element(0x28, 0x101, "US", u2(16)), element(0x28, 0x102, "US", u2(15)), element(0x28, 0x103, "US", u2(1)),
        element(0x7FE0, 0x10, "OW", bytes(24)),
    ])
    pathlib.Path(f"slices/{z}.dcm").write_bytes(bytes(128) + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta))) + meta + data)
PYTHON

root/usr/bin/mrinfo -version | head -1
mrtrix=$(root/usr/bin/mrinfo -quiet -spacing slices)
gdcm=$(root/usr/bin/gdcminfo slices/0.dcm | grep Spacing)
echo "rows 1.5 mm apart, columns 1 mm apart, slices 2 mm apart"
echo "mrinfo -spacing: $mrtrix"
echo "gdcminfo: $gdcm"
[[ $mrtrix == "1.5 1 2"* ]] || { echo "changed: MRtrix no longer swaps them"; exit 1; }
[[ $gdcm == *"(1,1.5,"* ]] || { echo "changed: GDCM"; exit 1; }
