//! The graphics adapter, and a bake in its memory.

use wgpu::util::DeviceExt;

use crate::{
    ViewerError,
    frame::Passes,
    interpolant_pass::ModePipelines,
    records::{Corners, Records, TriangleRecord},
};

/// Triangle ids plus one leave the top bit of the visibility buffer to the back sides.
const LARGEST_ID_COUNT: u64 = (1 << 31) - 1;

/// A graphics adapter that draws pictures.
pub struct Gpu {
    pub(crate) adapter: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) passes: Passes,
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
            // All that the adapter has: a bake needs large buffers, and a poster large textures.
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|cause| ViewerError::NoDevice { adapter: adapter.get_info().name, cause: cause.to_string() })?;
        let output = match surface {
            Some(surface) => surface_format(surface, &adapter)?.remove_srgb_suffix(),
            None => wgpu::TextureFormat::Rgba8Unorm,
        };
        let passes = guarded(&device, || Passes::new(&device, output))?;
        Ok(Self { adapter, device, queue, passes })
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
    /// Number of triangles.
    pub triangles: u32,
    /// Corner positions, three to a triangle.
    pub corners: wgpu::Buffer,
    /// What the interpolant pass reads: triangles, elements, corners, textures.
    pub interpolants: wgpu::BindGroup,
    /// The interpolant pass's pipelines, where the bake has textures.
    pub textured: Option<ModePipelines>,
}

impl ResidentBake {
    /// Copies a bake's records to the adapter.
    ///
    /// # Errors
    /// [`ViewerError::TooManyTriangles`] and [`ViewerError::TexturesTooLarge`] when they exceed one of the adapter's buffers, [`ViewerError::Driver`] when
    /// its memory is full.
    pub fn upload(gpu: &Gpu, records: &Records) -> Result<Self, ViewerError> {
        let limits = gpu.device.limits();
        let largest = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        let limit = (largest / size_of::<TriangleRecord>() as u64).min(LARGEST_ID_COUNT);
        let triangles = records.triangles.len();
        if triangles as u64 > limit || size_of_val(&*records.elements) as u64 > largest {
            return Err(ViewerError::TooManyTriangles { triangles, limit });
        }
        let texture_bytes = size_of_val(&*records.textures) as u64;
        if texture_bytes > largest {
            return Err(ViewerError::TexturesTooLarge { bytes: texture_bytes, limit: largest });
        }
        guarded(&gpu.device, || {
            // A binding must not be empty; an empty bake has one record that nothing reads.
            let storage = |label, bytes: &[u8], one: usize, usage| {
                let nothing = vec![0; one];
                let contents = if bytes.is_empty() { &nothing } else { bytes };
                let usage = wgpu::BufferUsages::STORAGE | usage;
                gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
            };
            let none = wgpu::BufferUsages::empty();
            let record_bytes = bytemuck::cast_slice(&records.triangles);
            let records_ = storage("triangles", record_bytes, size_of::<TriangleRecord>(), none);
            let elements = storage("elements", bytemuck::cast_slice(&records.elements), 16, none);
            let corner_bytes = bytemuck::cast_slice(&records.corners);
            let corners = storage("corners", corner_bytes, size_of::<Corners>(), wgpu::BufferUsages::VERTEX);
            let textures = storage("textures", bytemuck::cast_slice(&records.textures), 4, none);
            let buffers = [&records_, &elements, &corners, &textures].map(wgpu::Buffer::as_entire_binding);
            let pass = &gpu.passes.interpolant;
            let interpolants = bind_group(&gpu.device, &pass.bake_layout, &buffers);
            let textured = (!records.textures.is_empty()).then(|| pass.textured(&gpu.device));
            Self { triangles: triangles as u32, corners, interpolants, textured }
        })
    }
}
