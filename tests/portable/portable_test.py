"""Decodes the same parcels on the host and in WebAssembly, and compares what comes out.

usage: portable_test.py MAKE_PARCELS DIGEST_PARCELS SOURCE_ROOT DEFINITIONS SOURCE...
  DEFINITIONS: with commas between, may be empty. SOURCE: what DIGEST_PARCELS was built of.
  Exit code: 0 the same, 1 not, 77 the host agrees and WebAssembly could not be tried: a tool is missing.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
PACKAGES = "Debian: clang lld wasi-libc libc++-dev-wasm32 libclang-rt-dev-wasm32 nodejs; tools/setup --developer"
PROBE = "#include <vector>\nint main() { return int(std::vector<int>().size()); }\n"
FLAGS = ("--target=wasm32-wasi", "-std=c++20", "-stdlib=libc++", "-O2", "-fno-exceptions", "-ffp-contract=off",
         "-Wl,-z,stack-size=4194304")  # the stack of hosts; WASI's has 64 KB


def skip(why):
    print(f"skipped, WebAssembly is not tried: {why} ({PACKAGES})")
    sys.exit(SKIPPED)


def fail(why):
    print(why)
    sys.exit(1)


def digests(command, parcels):
    with open(parcels, "rb") as file:
        done = subprocess.run(command, stdin=file, capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        fail(f"{command[0]} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout.splitlines()


def compile_wasm(arguments, program):
    return subprocess.run(["clang++", *FLAGS, *arguments, "-o", program], capture_output=True, text=True, timeout=300)


def check_tools(folder):
    """Ends the test where a tool is missing."""
    for tool in ("clang++", "wasm-ld", "node"):
        if shutil.which(tool) is None:
            skip(f"there is no {tool}")
    probe = folder / "probe.cpp"
    probe.write_text(PROBE)
    built = compile_wasm([probe], folder / "probe.wasm")
    if built.returncode != 0:
        skip("clang++ cannot build for wasm32-wasi: " + (built.stderr.splitlines() or ["?"])[0])
    ran = subprocess.run(runner(folder / "probe.wasm"), capture_output=True, text=True, timeout=60)
    if ran.returncode != 0:
        skip("node cannot run it: " + (ran.stderr.splitlines() or ["?"])[-1])


def runner(program):
    return ["node", "--no-warnings", str(pathlib.Path(__file__).with_name("run_wasi.mjs")), str(program)]


def main():
    make, digest, root, definitions, *sources = sys.argv[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        parcels = folder / "parcels"
        subprocess.run([make, parcels], check=True, timeout=120)
        host = digests([digest], parcels)
        print("\n".join(host))
        check_tools(folder)
        program = folder / "digest.wasm"
        (folder / "include").mkdir()
        (folder / "include/fmt").symlink_to("/usr/include/fmt")  # the host's other headers are not for this target
        flags = [f"-D{d}" for d in definitions.split(",") if d] + ["-I", folder / "include"]
        built = compile_wasm([*flags, "-I", root, *sources], program)
        if built.returncode != 0:
            fail(f"the portable sources do not build for WebAssembly:\n{built.stderr}")
        wasm = digests(runner(program), parcels)
    if wasm != host:
        fail("WebAssembly decodes otherwise:\n" + "\n".join(wasm))
    print(f"{len(host)} parcels, the same on both")


if __name__ == "__main__":
    main()
