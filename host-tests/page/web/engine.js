"use strict";
// The simulator with the on-board code, in a worker thread, so that the page stays responsive.

/** Main function of the worker: receives the compiled code first, then answers each request with the result of `chain`. */
function thread() {
  const code = new Promise((resolve) => { self.resolve = resolve; });
  self.onmessage = async ({ data }) => {
    if (data.code) {
      await wasm_bindgen({ module_or_path: data.code });
      self.resolve();
      return;
    }
    await code;
    const begun = performance.now();
    let text;
    try {
      text = wasm_bindgen.chain(data.words, data.toml, data.film);
    } catch (error) {
      text = JSON.stringify({ wrong: `the run ended early: ${error}` });
    }
    self.postMessage({ text, took_ms: performance.now() - begun });
  };
}

/** Time after which a run is cancelled if there is a newer request, ms. */
const GIVEN_UP = 1_500;

const engine = {
  code: null, worker: null, running: null, next: null, answered: null,

  /** Unpacks and compiles the code. */
  async load(packed) {
    const bytes = await fetch(`data:application/gzip;base64,${packed}`);
    const stream = bytes.body.pipeThrough(new DecompressionStream("gzip"));
    this.code = await WebAssembly.compile(await new Response(stream).arrayBuffer());
    this.start();
  },

  start() {
    const source = new Blob([`${byId("glue").textContent}\n(${thread})();`], { type: "text/javascript" });
    const address = URL.createObjectURL(source);
    this.worker = new Worker(address);
    this.worker.onmessage = ({ data }) => {
      URL.revokeObjectURL(address);
      const asked = this.running;
      this.running = null;
      this.answered(asked, data);
      this.go();
    };
    this.worker.postMessage({ code: this.code });
  },

  /** Requests a run. Of several waiting requests only the newest is run. */
  ask(question) {
    this.next = question;
    if (this.running && performance.now() - this.running.begun > GIVEN_UP) {
      this.worker.terminate();
      this.running = null;
      this.start();
    }
    this.go();
  },

  go() {
    if (this.running || !this.next || !this.worker) return;
    this.running = { ...this.next, begun: performance.now() };
    this.next = null;
    this.worker.postMessage(this.running);
  },
};
