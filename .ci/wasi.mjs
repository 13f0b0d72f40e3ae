// Runs a program that was built for wasm32-wasip1, with its arguments: `node --no-warnings --no-turbo-fast-api-calls .ci/wasi.mjs PROGRAM [ARGUMENT...]`.
import { readFile } from "node:fs/promises";
import process from "node:process";
import { WASI } from "node:wasi";

const wasi = new WASI({ version: "preview1", args: process.argv.slice(2), returnOnExit: true });
const program = await WebAssembly.compile(await readFile(process.argv[2]));
const instance = await WebAssembly.instantiate(program, wasi.getImportObject());
process.exitCode = wasi.start(instance);
