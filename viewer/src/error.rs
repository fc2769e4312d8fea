//! What can go wrong between a bake and its pixels.

/// Why a picture or a window could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// No graphics adapter, not even a software one.
    #[error("no graphics adapter was found: {0}")]
    NoAdapter(String),
    /// The adapter refused to hand out a device.
    #[error("the graphics adapter {adapter} gave no device: {cause}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        cause: String,
    },
    /// No window system to open a window on.
    #[error("no window can be opened here: {0}")]
    NoDisplay(String),
    /// A picture without pixels.
    #[error("a picture of {width}x{height} pixels is empty")]
    EmptyPicture {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// A picture larger than the adapter can draw.
    #[error("a picture of {width}x{height} pixels exceeds what the adapter can draw (sides up to {limit} pixels)")]
    PictureTooLarge {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// Longest side that the adapter can draw, pixels; its memory may end earlier.
        limit: u32,
    },
    /// Textures that do not fit into the adapter's memory as one buffer.
    #[error("the textures take {bytes} bytes and the adapter holds {limit}; draw on the CPU, or use smaller images")]
    TexturesTooLarge {
        /// Bytes that they take.
        bytes: u64,
        /// Bytes that fit.
        limit: u64,
    },
    /// A camera that looks nowhere.
    #[error("the camera is not valid: its numbers must be finite, up not parallel to the view, and the angle in 0..π")]
    InvalidCamera,
    /// A bake larger than the adapter's buffers.
    #[error("{triangles} triangles do not fit into the adapter's buffers (at most {limit})")]
    TooManyTriangles {
        /// Number of the bake's triangles.
        triangles: usize,
        /// Number that fits.
        limit: u64,
    },
    /// The driver failed while drawing.
    #[error("the graphics driver failed: {0}")]
    Driver(String),
}
