//! The graphics adapter, and a bake in its memory.

use std::sync::Arc;

use wgpu::util::DeviceExt;

use crate::{
    ViewerError,
    chunks::Chunks,
    id_mesh::IdVertex,
    mesh_pass::Mesh,
    passes::Passes,
    records::{Corners, Records, TriangleRecord},
    timestamps::Timestamps,
};

/// Triangle ids plus one leave the top bit of the visibility buffer to the back sides.
const LARGEST_ID_COUNT: u64 = (1 << 31) - 1;

/// A graphics adapter that draws pictures.
pub struct Gpu {
    pub(crate) adapter: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) passes: Passes,
    pub(crate) evaluator: Evaluator,
}

/// Who does passes (c) and (d): finds the light at every pixel, and what a display shows of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evaluator {
    /// Shaders of the adapter.
    Adapter,
    /// The host's threads, as in the paper. The adapter draws ids alone.
    Host,
}

impl Evaluator {
    /// Who does it on an adapter of a type. One that is a CPU itself takes five to nine times as long for it as the host, and
    /// three times with the best shader that was found (`data/record/2026-11-25-frames.md`): it reads a triangle number by
    /// number for every pixel, the host once for all neighbours.
    fn of(adapter: wgpu::DeviceType) -> Self {
        if adapter == wgpu::DeviceType::Cpu { Self::Host } else { Self::Adapter }
    }
}

impl Gpu {
    /// Opens the best adapter there is, without a window; a software one will do.
    ///
    /// # Errors
    /// [`ViewerError::NoAdapter`] on a machine without any driver, [`ViewerError::NoDevice`] where the driver fails.
    pub fn headless() -> Result<Self, ViewerError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
        Self::open(&instance, None)
    }

    /// Opens the best adapter for a surface, or for pictures that are read back.
    pub(crate) fn open(instance: &wgpu::Instance, surface: Option<&wgpu::Surface<'_>>) -> Result<Self, ViewerError> {
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        }))
        .map_err(|cause| ViewerError::NoAdapter(cause.to_string()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("viewer"),
            required_features: adapter.features() & Timestamps::FEATURE,
            // All that the adapter has: a bake needs large buffers, and a poster large textures.
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|cause| ViewerError::NoDevice { adapter: adapter.get_info().name, cause: cause.to_string() })?;
        let output = match surface {
            Some(surface) => surface_format(surface, &adapter)?.remove_srgb_suffix(),
            None => wgpu::TextureFormat::Rgba8Unorm,
        };
        let info = adapter.get_info();
        // OpenGL hands flat attributes on from the last corner, all others from the first.
        let is_shared = info.backend != wgpu::Backend::Gl;
        let passes = Passes::new(&device, output, surface.is_some(), is_shared);
        Ok(Self { adapter, device, queue, passes, evaluator: Evaluator::of(info.device_type) })
    }

    /// The adapter, with another evaluator than the one that is likely the faster: to set them side by side.
    pub fn with_evaluator(self, evaluator: Evaluator) -> Self {
        Self { evaluator, ..self }
    }

    /// The adapter's name, as its driver gives it.
    pub fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({}, {:?})", info.name, info.driver_info, info.backend)
    }
}

/// The format to ask of a surface: one that takes values as they are, because the tone map encodes them itself.
pub(crate) fn surface_format(
    surface: &wgpu::Surface<'_>,
    adapter: &wgpu::Adapter,
) -> Result<wgpu::TextureFormat, ViewerError> {
    let formats = surface.get_capabilities(adapter).formats;
    let plain = formats.iter().find(|format| !format.is_srgb());
    plain.or(formats.first()).copied().ok_or_else(|| ViewerError::NoDisplay("the adapter cannot present here".into()))
}

/// Runs `work` and returns what the driver said against it, instead of the panic that is wgpu's default.
pub(crate) fn guarded<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T, ViewerError> {
    let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
    let scopes = filters.map(|filter| device.push_error_scope(filter));
    let result = work();
    // Scopes nest: the last one opened is the first to close.
    let mut errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).collect::<Vec<_>>();
    match errors.pop() {
        Some(error) => Err(ViewerError::Driver(error.to_string())),
        None => Ok(result),
    }
}

/// A bind group of the given resources, numbered in order.
pub(crate) fn bind_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A bake in the adapter's memory.
pub(crate) struct ResidentBake {
    /// Where the triangles are.
    pub chunks: Chunks,
    /// What the visibility pass draws.
    pub mesh: Mesh,
    /// What pass (c) reads.
    pub light: ResidentLight,
    /// [`Records::sky`].
    pub sky: u32,
}

/// The light of a bake, where pass (c) finds it.
pub(crate) enum ResidentLight {
    /// For the adapter: triangles, elements, corners, textures with the environment, and whether any triangle has one.
    Adapter { inputs: wgpu::BindGroup, is_textured: bool },
    /// For the host.
    Host(Arc<Records>),
}

impl ResidentBake {
    /// Copies a bake's records to the adapter.
    ///
    /// # Errors
    /// [`ViewerError::TooManyTriangles`] and [`ViewerError::TexturesTooLarge`] when they exceed one of the adapter's
    /// buffers, [`ViewerError::Driver`] when its memory is full.
    pub fn upload(gpu: &Gpu, records: &Arc<Records>) -> Result<Self, ViewerError> {
        let light = match gpu.evaluator {
            Evaluator::Adapter => upload_light(gpu, records)?,
            Evaluator::Host => ResidentLight::Host(records.clone()),
        };
        check_count(records, gpu.device.limits().max_buffer_size / (3 * size_of::<IdVertex>() as u64))?;
        let unshared = (!gpu.passes.shares_vertices).then(|| records.mesh.unshared());
        let mesh = unshared.as_ref().unwrap_or(&records.mesh);
        let mesh = guarded(&gpu.device, || Mesh::upload(&gpu.device, "triangles", &mesh.vertices, &mesh.indices))?;
        Ok(Self { chunks: Chunks::of(&records.corners), mesh, light, sky: records.sky })
    }
}

fn check_count(records: &Records, limit: u64) -> Result<(), ViewerError> {
    let (triangles, limit) = (records.triangles.len(), limit.min(LARGEST_ID_COUNT));
    if triangles as u64 > limit { Err(ViewerError::TooManyTriangles { triangles, limit }) } else { Ok(()) }
}

fn upload_light(gpu: &Gpu, records: &Records) -> Result<ResidentLight, ViewerError> {
    let limits = gpu.device.limits();
    let largest = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
    check_count(records, largest / size_of::<TriangleRecord>() as u64)?;
    if size_of_val(&*records.elements) as u64 > largest {
        let limit = largest / size_of::<[f32; 4]>() as u64;
        return Err(ViewerError::TooManyTriangles { triangles: records.triangles.len(), limit });
    }
    let texture_bytes = size_of_val(&*records.textures) as u64;
    if texture_bytes > largest {
        return Err(ViewerError::TexturesTooLarge { bytes: texture_bytes, limit: largest });
    }
    guarded(&gpu.device, || {
        // A binding must not be empty; an empty bake has one record that nothing reads.
        let storage = |label, bytes: &[u8], one: usize| {
            let nothing = vec![0; one];
            let contents = if bytes.is_empty() { &nothing } else { bytes };
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let triangles = storage("light", bytemuck::cast_slice(&records.triangles), size_of::<TriangleRecord>());
        let elements = storage("elements", bytemuck::cast_slice(&records.elements), size_of::<[f32; 4]>());
        let corners = storage("corners", bytemuck::cast_slice(&records.corners), size_of::<Corners>());
        let textures = storage("textures", bytemuck::cast_slice(&records.textures), size_of::<u32>());
        let buffers = [&triangles, &elements, &corners, &textures].map(wgpu::Buffer::as_entire_binding);
        let inputs = bind_group(&gpu.device, &gpu.passes.interpolant().bake_layout, &buffers);
        ResidentLight::Adapter { inputs, is_textured: records.is_textured }
    })
}
