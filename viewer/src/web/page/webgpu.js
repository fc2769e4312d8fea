// The walk's pictures by WebGPU: the bake in storage buffers, and one pass with a pipeline for every mode.

import { corners, fetched } from "./bake.js";
import { uniform } from "./camera.js";

/**
 * Reversed infinite depth loses no precision by a near plane this close, metres: the one of the program's own window.
 */
const DEPTH = { near: 1e-4, reversed: true };

const DEPTH_FORMAT = "depth32float";

/** Bytes of a storage buffer that every adapter takes. */
const DEFAULT_ROOM = 1 << 27;

/** The arrays in the order of their bindings. */
const ARRAYS = ["triangles", "elements", "corners", "textures"];

/**
 * Brings a bake to the adapter that draws on a canvas; null where there is none.
 *
 * What comes back has `draw(frame)` for frames in modes for which `prepare(mode)` has been waited, and tells in `lost`
 * when and why it can draw no more.
 */
export async function openWebGpu(canvas, bake) {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) return null;
  const largest = Math.max(...ARRAYS.map((name) => bake[name].byteLength));
  const room = Math.min(adapter.limits.maxStorageBufferBindingSize, adapter.limits.maxBufferSize);
  if (largest > room) throw new Error(`the bake takes ${largest} bytes in one piece, and this adapter holds ${room}`);
  const requiredLimits = largest > DEFAULT_ROOM ? { maxStorageBufferBindingSize: largest, maxBufferSize: largest } : {};
  const device = await adapter.requestDevice({ requiredLimits });
  const format = navigator.gpu.getPreferredCanvasFormat();
  const context = canvas.getContext("webgpu");
  context.configure({ device, format, alphaMode: "opaque" });
  device.pushErrorScope("out-of-memory");
  const code = await (await fetched(new URL("shaders/forward.wgsl", bake.base))).text();
  const module = device.createShaderModule({ code });
  const { FRAGMENT, VERTEX } = GPUShaderStage;
  const entry = (type, visibility) => (binding) => ({ binding, visibility, buffer: { type } });
  const layouts = [
    device.createBindGroupLayout({ entries: [entry("uniform", VERTEX | FRAGMENT)(0)] }),
    device.createBindGroupLayout({
      entries: ARRAYS.map((_, binding) => entry("read-only-storage", VERTEX | FRAGMENT)(binding)),
    }),
  ];
  const frameBuffer = device.createBuffer({ size: 144, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
  const buffers = ARRAYS.map((name) => upload(device, bake[name]));
  const groups = [group(device, layouts[0], [frameBuffer]), group(device, layouts[1], buffers)];
  const failed = await device.popErrorScope();
  if (failed) throw new Error(`the graphics memory is full: ${failed.message}`);

  const layout = device.createPipelineLayout({ bindGroupLayouts: layouts });
  const pipelines = new Map();
  let depth = null;
  return {
    name: "WebGPU",
    lost: device.lost.then((info) => info.message || info.reason),
    async prepare(mode) {
      if (pipelines.has(mode)) return;
      const constants = { MODE: mode, TEXTURED: bake.head.textured ? 1 : 0 };
      const pipeline = await device.createRenderPipelineAsync({
        layout,
        vertex: { module, entryPoint: "corner" },
        fragment: { module, entryPoint: "pixel", constants, targets: [{ format }] },
        depthStencil: { format: DEPTH_FORMAT, depthCompare: "greater", depthWriteEnabled: true },
      });
      pipelines.set(mode, pipeline);
    },
    draw(frame) {
      const size = [frame.width, frame.height];
      if (depth?.width !== frame.width || depth?.height !== frame.height) {
        depth?.destroy();
        depth = device.createTexture({ size, format: DEPTH_FORMAT, usage: GPUTextureUsage.RENDER_ATTACHMENT });
      }
      device.queue.writeBuffer(frameBuffer, 0, uniform(frame, bake.head, DEPTH));
      const encoder = device.createCommandEncoder();
      const view = context.getCurrentTexture().createView();
      const pass = encoder.beginRenderPass({
        colorAttachments: [{ view, loadOp: "clear", clearValue: [0, 0, 0, 1], storeOp: "store" }],
        depthStencilAttachment: {
          view: depth.createView(),
          depthLoadOp: "clear",
          depthClearValue: 0,
          depthStoreOp: "discard",
        },
      });
      pass.setPipeline(pipelines.get(frame.mode));
      groups.forEach((group, index) => pass.setBindGroup(index, group));
      pass.draw(corners(bake.head));
      pass.end();
      device.queue.submit([encoder.finish()]);
    },
  };
}

/** A buffer of an array; a binding must not be empty, so it holds a few bytes at least. */
function upload(device, array) {
  const usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST;
  const buffer = device.createBuffer({ size: Math.max(array.byteLength, 16), usage });
  device.queue.writeBuffer(buffer, 0, array);
  return buffer;
}

function group(device, layout, buffers) {
  return device.createBindGroup({
    layout,
    entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })),
  });
}
