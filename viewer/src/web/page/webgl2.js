// The walk's pictures by WebGL2, where there is no WebGPU: the bake in pictures of numbers, and a program for every
// mode.

import { corners, fetched } from "./bake.js";
import { uniform } from "./camera.js";

/** Texels in a row of the pictures that hold the bake; `record_textures.wgsl` says the same. */
const WIDTH = 2048;

/**
 * Depth of 24 bits from a near plane at this part of the scene's size: nearer, walls at its far end would be told apart
 * by less than their distance; farther, one would see through what one stands before.
 */
const NEAR = 1e-3;

/** The arrays in the order of their bindings: the format of a texel, and how many words it takes. */
const ARRAYS = [
  ["triangles", "RGBA32UI", "RGBA_INTEGER", "UNSIGNED_INT", 4],
  ["elements", "RGBA32F", "RGBA", "FLOAT", 4],
  ["corners", "RGB32F", "RGB", "FLOAT", 3],
  ["textures", "R32UI", "RED_INTEGER", "UNSIGNED_INT", 1],
];

/** Brings a bake to the context that draws on a canvas, as `openWebGpu` does; null where there is none. */
export async function openWebGl2(canvas, bake) {
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
  if (!gl) return null;
  ARRAYS.forEach(([name, ...texel], unit) => upload(gl, unit, bake[name], texel));
  if (gl.getError() === gl.OUT_OF_MEMORY) throw new Error("the graphics memory is full");
  const frameBuffer = gl.createBuffer();
  gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, frameBuffer);
  gl.bindVertexArray(gl.createVertexArray());
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0, 0, 0, 1);

  const depth = { near: NEAR * (bake.head.size || 1), reversed: false };
  const text = async (name) => (await fetched(new URL(`shaders/${name}`, bake.base))).text();
  const vertex = await text("corner.vert");
  const programs = new Map();
  return {
    name: "WebGL2",
    lost: new Promise((lost) => {
      canvas.addEventListener("webglcontextlost", (event) => lost(event.statusMessage || "the context is lost"));
    }),
    async prepare(mode) {
      if (programs.has(mode)) return;
      programs.set(mode, program(gl, vertex, await text(`${bake.head.modes[mode].name}.frag`)));
    },
    draw(frame) {
      gl.viewport(0, 0, frame.width, frame.height);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.bufferData(gl.UNIFORM_BUFFER, uniform(frame, bake.head, depth), gl.DYNAMIC_DRAW);
      gl.useProgram(programs.get(frame.mode));
      gl.drawArrays(gl.TRIANGLES, 0, corners(bake.head));
    },
  };
}

/** A picture of an array, row after row; the last one may be cut short. */
function upload(gl, unit, array, [internal, format, type, words]) {
  const texels = array.length / words;
  const height = Math.max(1, Math.ceil(texels / WIDTH));
  const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  if (height > limit) throw new Error(`the bake takes pictures of ${height} rows, and this browser holds ${limit}`);
  const view = type === "FLOAT" ? new Float32Array(array.buffer, array.byteOffset, array.length) : array;
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl[internal], WIDTH, height);
  const rows = Math.floor(texels / WIDTH);
  const put = (row, width, height) =>
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, width, height, gl[format], gl[type], view, row * WIDTH * words);
  if (rows > 0) put(0, WIDTH, rows);
  if (texels > rows * WIDTH) put(rows, texels - rows * WIDTH, 1);
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) {
    const said = gl.getAttachedShaders(made).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`the browser refuses a shader: ${[gl.getProgramInfoLog(made), ...said].join(" ")}`);
  }
  gl.useProgram(made);
  // The translation names a resource by its binding, and each stage's block apart.
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(made, i);
    const binding = /^_group_1_binding_(\d)_/.exec(name)?.[1];
    if (binding) gl.uniform1i(gl.getUniformLocation(made, name), Number(binding));
  }
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORM_BLOCKS); i++) gl.uniformBlockBinding(made, i, 0);
  return made;
}
