#!/usr/bin/env bash
# glibc 2.36 gives other bits for exp, log, sin, cos, atan and asin with and without AVX2 and FMA, on one processor.
# The variants are chosen when a program starts; GLIBC_TUNABLES chooses the plain ones. tan, log2, cbrt and sqrt of the
# same numbers do not change, so a test of a few functions may miss it.
# What must be the same on every machine (a replay, a replica) uses sqrt alone, or pins the variants.
set -euo pipefail
grep -qw fma /proc/cpuinfo || { echo "skipped: this processor has no FMA, so there is one variant"; exit 0; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download libc6=2.36-9+deb12u14 python3.11-minimal libpython3.11-minimal libexpat1 zlib1g
for package in *.deb; do dpkg-deb -x "$package" root; done

cat > digests.py <<'END'
import math
import struct

def digest(function, factor):
    out = 0
    for i in range(1, 20001):
        bits = struct.unpack("<Q", struct.pack("<d", function(i * factor)))[0]
        out = (out * 1000003 ^ bits) % 2**64
    return f"{out:016x}"

for name, factor in [("exp", 0.001), ("log", 0.1), ("sin", 0.1), ("cos", 0.1), ("atan", 0.1), ("asin", 0.00004),
                     ("tan", 0.1), ("log2", 0.1), ("cbrt", 0.1), ("sqrt", 0.1)]:
    print(name, digest(getattr(math, name), factor))
END
run() {
  PYTHONHOME=$folder/root/usr root/lib64/ld-linux-x86-64.so.2 \
    --library-path root/lib/x86_64-linux-gnu:root/usr/lib/x86_64-linux-gnu root/usr/bin/python3.11 -S digests.py
}
run > fast
GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4 run > plain
other=$({ diff fast plain || true; } | sed -n 's/^< \([a-z0-9]*\) .*/\1/p' | tr '\n' ' ')
echo "glibc 2.36-9+deb12u14: other bits without AVX2 and FMA: $other"
[ "$other" = "exp log sin cos atan asin " ]
