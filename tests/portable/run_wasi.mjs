// node run_wasi.mjs PROGRAM.wasm: runs a WebAssembly program that has standard input and output.
import {readFileSync} from "node:fs";
import {WASI} from "node:wasi";

const wasi = new WASI({version: "preview1", args: ["program"], preopens: {}, returnOnExit: true});
const module = await WebAssembly.compile(readFileSync(process.argv[2]));
const imports = {wasi_snapshot_preview1: wasi.wasiImport};
process.exit(wasi.start(await WebAssembly.instantiate(module, imports)) ?? 0);
