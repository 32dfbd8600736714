// Data that a page holds as text.

// Returns the bytes that base64 of deflated ones stands for.
export async function bytes(text) {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

// Returns the JSON value that such bytes are.
export async function unpacked(text) {
  return JSON.parse(new TextDecoder().decode(await bytes(text)));
}

// Returns a ground of a body, whose heights are numbers of what bodies share.
export function whole({ xml, surface, ...ground }, shared) {
  const filled = xml.replace(/elevation="#(\d+)"/g, (_, number) => `elevation="${shared[number]}"`);
  return { ...ground, xml: filled, ...(surface === undefined ? {} : { surface: shared[surface] }) };
}
