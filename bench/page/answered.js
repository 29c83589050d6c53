"use strict";
// Answers what the page asks in a worker. What takes NumPy or other tools is left to the command.
{
  for (const id of ["moving", "measure", "size"]) document.getElementById(id).hidden = true;
  const worker = new Worker("worker.mjs", { type: "module" });
  const waiting = new Map();
  let asked = 0;
  const ready = new Promise((resolve, refuse) => {
    waiting.set(0, resolve);
    worker.onerror = (event) => refuse(new Error(`Python does not start in this browser: ${event.message}`));
  });
  worker.onmessage = ({ data: { id, answer } }) => {
    waiting.get(id)(answer);
    waiting.delete(id);
  };
  window.answered = async (name, args) => {
    await ready;
    return new Promise((resolve) => {
      waiting.set(++asked, resolve);
      worker.postMessage({ id: asked, name, args });
    });
  };
}
