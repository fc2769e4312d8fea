// The bake: its head, and the arrays of its records, which are uploaded as they come.

/**
 * Fetches the bake that lies at an address.
 *
 * @param {string|URL} base the page's folder, with a slash at its end
 * @param {(part: number) => void} [progress] is told the part that has arrived, 0 to 1
 * @returns {Promise<object>} `head`, `base`, and the words of each array by its name
 */
export async function fetchBake(base, progress = () => {}) {
  const head = await (await fetched(new URL("bake.json", base))).json();
  const length = head.arrays.reduce((end, array) => Math.max(end, array.offset + array.bytes), 0);
  const bytes = new Uint8Array(length);
  const reader = (await fetched(new URL("bake.bin", base))).body.getReader();
  let arrived = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    if (arrived + value.length > length) throw new Error("bake.bin is not the one of bake.json: export the bake again");
    bytes.set(value, arrived);
    arrived += value.length;
    progress(arrived / length);
  }
  if (arrived < length) throw new Error("bake.bin is cut off: copy it again, or export the bake again");
  const bake = { head, base };
  for (const { name, offset, bytes: size } of head.arrays) bake[name] = new Uint32Array(bytes.buffer, offset, size / 4);
  return bake;
}

/** How many corners are drawn: three a triangle, and the sky's where there is an environment. */
export const corners = ({ triangles, sky }) => 3 * (triangles + (sky ? 1 : 0));

/** The response of a file that is there. */
export async function fetched(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address} cannot be read: the server says ${response.status}`);
  return response;
}
