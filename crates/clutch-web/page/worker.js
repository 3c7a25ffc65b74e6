// The simulator, beside the page: a question in a line of text, an answer in JSON.
let simulator;
onmessage = async ({ data }) => {
  try {
    if (data.module) {
      simulator = (await WebAssembly.instantiate(data.module)).instance.exports;
      return postMessage({ ready: true });
    }
    const begin = performance.now();
    const question = new TextEncoder().encode(data.question);
    const room = simulator.room(question.length); // before the memory is looked at: it may grow
    new Uint8Array(simulator.memory.buffer, room, question.length).set(question);
    const bytes = simulator.answer();
    const answer = new TextDecoder().decode(new Uint8Array(simulator.memory.buffer, simulator.text(), bytes));
    const memory = simulator.memory.buffer.byteLength;
    postMessage({ answer, memory, took_ms: performance.now() - begin });
  } catch (error) {
    postMessage({ broken: String(error) });
  }
};
