"""One HTML page in which controllers fly in real time: engine and generated C as WebAssembly."""
