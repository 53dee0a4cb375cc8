"""Looks for instructions that machines may lack on which the codec chooses them.

Highway 1.0.3 lets compilers use AVX-VNNI for AVX3_DL, where AVX512-VNNI is meant: Ice Lake and Zen 4 have the latter
alone. Products of AVX-512 begin with the byte 0x62.

usage: instructions_test.py LIBRARY
  Exit code: 0 there are none, 1 there are, 77 there is no objdump.
"""
import re
import shutil
import subprocess
import sys

SKIPPED = 77
PRODUCT = re.compile(r"^\s*[0-9a-f]+:\s+([0-9a-f]{2}) .*\bvpdp\w+")


def main():
    if shutil.which("objdump") is None:
        print("skipped: there is no objdump (Debian: binutils)")
        return SKIPPED
    products, wrong = 0, []
    with subprocess.Popen(["objdump", "-d", sys.argv[1]], stdout=subprocess.PIPE, text=True) as listing:
        for line in listing.stdout:
            found = PRODUCT.match(line)
            products += found is not None
            if found and found[1] != "62":
                wrong.append(line.strip())
    if listing.returncode != 0:
        print(f"objdump -d {sys.argv[1]}: exit code {listing.returncode}")
        return 1
    for line in wrong[:10]:
        print(f"of AVX-VNNI: {line}")
    print(f"{products} products that are added at once, {len(wrong)} of them of AVX-VNNI")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
