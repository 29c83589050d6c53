// Python, Yosys and what answers the page, in a worker of the browser: nothing is sent anywhere.
import { loadPyodide } from "./pyodide/pyodide.mjs";
import { ConsoleStdout, File, OpenFile, PreopenDirectory, WASI } from "./wasi/index.js";

const yosys = WebAssembly.compileStreaming(fetch("yosys.wasm"));
const app = fetch("app.zip").then((response) => response.arrayBuffer());
const python = await loadPyodide();
python.unpackArchive(await app, "zip", { extractDir: "/app" });
const compiled = await yosys;

// Amaranth calls this with the arguments and the input of Yosys, and expects its status, output and complaints.
globalThis.runAmaranthYosys = (args, input) => {
  const texts = ["", ""];
  const stream = (k, decoder = new TextDecoder()) =>
    new ConsoleStdout((bytes) => (texts[k] += decoder.decode(bytes.slice(), { stream: true })));
  const files = [
    new OpenFile(new File(new TextEncoder().encode(input))),
    stream(0),
    stream(1),
    ...["/tmp", "/share"].map((folder) => new PreopenDirectory(folder, new Map())),
  ];
  const wasi = new WASI(["yosys", ...args.toJs()], [], files, { debug: false });
  const status = wasi.start(new WebAssembly.Instance(compiled, { wasi_snapshot_preview1: wasi.wasiImport }));
  return [status, texts[0].replace(/^Amaranth /, ""), texts[1]];
};

const answer = python.runPython(`
import json, sys
sys.path.insert(0, "/app")
from tachometry.cli.explore.answers import FUNCTIONS, answer
lambda name, args: json.dumps(answer(name, json.loads(args), FUNCTIONS))
`);
onmessage = ({ data: { id, name, args } }) => postMessage({ id, answer: JSON.parse(answer(name, JSON.stringify(args))) });
postMessage({ id: 0 });
