//! From a texture of the adapter to the host's memory.

use crate::{Gpu, ViewerError, gpu::guarded};

/// A buffer that a texture is copied to and the host reads.
pub(crate) struct ReadBack {
    buffer: wgpu::Buffer,
    /// Bytes of a row's pixels, and of a row with its padding.
    row: usize,
    padded_row: usize,
    height: usize,
}

impl ReadBack {
    /// A buffer for the pixels of a texture.
    pub fn new(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Self, ViewerError> {
        let limits = gpu.device.limits();
        let (width, height) = (texture.width(), texture.height());
        let row = width * texture.format().block_copy_size(None).unwrap_or(0);
        let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(padded_row) * u64::from(height);
        if size > limits.max_buffer_size {
            return Err(ViewerError::PictureTooLarge { width, height, limit: limits.max_texture_dimension_2d });
        }
        let buffer = guarded(&gpu.device, || {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read-back"),
                size,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        Ok(Self { buffer, row: row as usize, padded_row: padded_row as usize, height: height as usize })
    }

    /// Copies the texture that it was made for.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.padded_row as u32),
            rows_per_image: Some(self.height as u32),
        };
        let target = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    }

    /// Waits for the copy, and has the host look at it where it lies.
    pub fn map<T>(&self, gpu: &Gpu, look: impl FnOnce(Rows<'_>) -> T) -> Result<T, ViewerError> {
        let result = mapped(gpu, &self.buffer, |bytes| {
            look(Rows { bytes, row: self.row, padded_row: self.padded_row, height: self.height })
        });
        self.buffer.unmap();
        result
    }
}

/// The pixels of a picture, row by row, with padding between the rows.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    bytes: &'a [u8],
    row: usize,
    padded_row: usize,
    height: usize,
}

impl<'a> Rows<'a> {
    /// Rows of a width, pixels, without padding between them.
    pub fn of(pixels: &'a [[u8; 4]], width: u32) -> Self {
        let row = 4 * width as usize;
        let bytes = pixels.as_flattened();
        Self { bytes, row, padded_row: row, height: bytes.len().checked_div(row).unwrap_or(0) }
    }

    /// The pixels of a row.
    pub fn row<Pixel: bytemuck::Pod>(&self, y: usize) -> &'a [Pixel] {
        let first = y * self.padded_row;
        bytemuck::cast_slice(&self.bytes[first..first + self.row])
    }

    /// All pixels, without the padding.
    pub fn to_vec<Pixel: bytemuck::Pod>(self) -> Vec<Pixel> {
        let mut pixels = Vec::with_capacity(self.row / size_of::<Pixel>() * self.height);
        (0..self.height).for_each(|y| pixels.extend_from_slice(self.row::<Pixel>(y)));
        pixels
    }
}

/// Waits until a buffer's content has arrived, and looks at it. The buffer stays mapped.
pub(crate) fn mapped<T>(gpu: &Gpu, buffer: &wgpu::Buffer, look: impl FnOnce(&[u8]) -> T) -> Result<T, ViewerError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver waits below; if it is gone, nobody wants the answer.
        let _ = sender.send(result);
    });
    let failed = |cause: &dyn std::fmt::Display| ViewerError::Driver(cause.to_string());
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|cause| failed(&cause))?;
    receiver.recv().map_err(|cause| failed(&cause))?.map_err(|cause| failed(&cause))?;
    let bytes = buffer.get_mapped_range(..).map_err(|cause| failed(&cause))?;
    Ok(look(&bytes))
}
