"use strict";
// The code that flies, in a thread of its own: the page stays awake whatever it computes.

/** What the other thread does: it begins with the compiled code, and answers each question with what `chain` gives. */
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

/** A run that takes longer is given up as soon as something else is wanted, ms. */
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

  /** Asks for a run; of those that wait for the last one to end, only the newest is run. */
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
