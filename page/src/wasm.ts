/** The bytes of the core, which Python puts into the page: gzip, in base64. */

export async function coreBytes(document: Document): Promise<ArrayBuffer> {
  const text = atob(document.getElementById("core")!.textContent!.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
