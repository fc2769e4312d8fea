//! The adapter's own clock: when its passes began and ended.

use crate::{Gpu, ViewerError, gpu::guarded, read_back::mapped};

/// Room for the beginnings and ends of a frame's passes.
pub(crate) struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    host: wgpu::Buffer,
}

impl Timestamps {
    /// What of an adapter's features is used, where it has it.
    pub const FEATURE: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY;

    /// Room for so many passes; none where the adapter has no clock.
    pub fn new(gpu: &Gpu, passes: u32) -> Result<Option<Self>, ViewerError> {
        if !gpu.device.features().contains(Self::FEATURE) {
            return Ok(None);
        }
        guarded(&gpu.device, || {
            let buffer = |usage| {
                let size = u64::from(2 * passes * wgpu::QUERY_SIZE);
                let usage = usage | wgpu::BufferUsages::COPY_DST;
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            Some(Self {
                queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2 * passes,
                }),
                resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
                host: buffer(wgpu::BufferUsages::MAP_READ),
            })
        })
    }

    /// Has a render pass of this number tell its times.
    pub fn of_render(&self, pass: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    /// Has a compute pass of this number tell its times.
    pub fn of_compute(&self, pass: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    /// Ends a frame, so many of whose passes have told their times.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder, passes: u32) {
        encoder.resolve_query_set(&self.queries, 0..2 * passes, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.host, 0, self.resolved.size());
    }

    /// Milliseconds of the first passes of the frame that was submitted last.
    pub fn milliseconds(&self, gpu: &Gpu, passes: usize) -> Result<Vec<f64>, ViewerError> {
        let tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        let times = mapped(gpu, &self.host, |bytes| {
            let ticks: Vec<u64> = bytes.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect();
            ticks.chunks_exact(2).take(passes).map(|pass| pass[1].saturating_sub(pass[0]) as f64 * tick).collect()
        });
        self.host.unmap();
        times
    }
}
