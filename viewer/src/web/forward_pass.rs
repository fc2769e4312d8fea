//! The shaders of the page: one pass from a bake's records to what a display shows, as WGSL for WebGPU and as GLSL ES
//! 3.00 for WebGL2.
//!
//! Both are made of the sources that the native passes are made of. WebGL2 has no storage buffers, so there records are
//! fetched from pictures; and it has no constants that are set when a pipeline is made, so every mode is a shader of
//! its own.

use naga::back::{PipelineConstants, glsl, pipeline_constants::process_overrides};
use naga::{Module, ShaderStage, valid::ModuleInfo};

use crate::Mode;

/// The shader for WebGPU. Its constants MODE and TEXTURED are set by the page.
pub(crate) const WEBGPU: &str = concat!(
    include_str!("../shaders/frame.wgsl"),
    include_str!("../shaders/record_buffers.wgsl"),
    include_str!("../shaders/evaluation.wgsl"),
    include_str!("../shaders/forward_pass.wgsl")
);

/// The same for WebGL2, before it is translated.
const WEBGL2: &str = concat!(
    include_str!("../shaders/frame.wgsl"),
    include_str!("../shaders/record_textures.wgsl"),
    include_str!("../shaders/evaluation.wgsl"),
    include_str!("../shaders/forward_pass.wgsl")
);

/// The shader for WebGL2, valid and ready to be translated.
pub(crate) struct Translator {
    module: Module,
    info: ModuleInfo,
    is_textured: bool,
}

impl Translator {
    /// For bakes with textures, or without.
    pub fn new(is_textured: bool) -> Self {
        let module = naga::front::wgsl::parse_str(WEBGL2).expect("the source is a constant, and a test parses it");
        let (flags, capabilities) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        let info = naga::valid::Validator::new(flags, capabilities).validate(&module);
        Self { module, info: info.expect("the source is a constant, and a test validates it"), is_textured }
    }

    /// The GLSL that brings corners into the picture.
    pub fn vertex(&self) -> String {
        self.translate(ShaderStage::Vertex, "corner", Mode::default())
    }

    /// The GLSL that finds the colour of a pixel in a mode.
    pub fn fragment(&self, mode: Mode) -> String {
        self.translate(ShaderStage::Fragment, "pixel", mode)
    }

    fn translate(&self, stage: ShaderStage, entry: &str, mode: Mode) -> String {
        const TRANSLATES: &str = "the source and its constants are ours, and a test translates all of them";
        let textured = f64::from(u8::from(self.is_textured));
        let constants = [("MODE", f64::from(mode as u8)), ("TEXTURED", textured), ("ROWS_GO_UP", 1.0)];
        let constants: PipelineConstants = constants.map(|(name, value)| (name.to_owned(), value)).into();
        let (module, info) =
            process_overrides(&self.module, &self.info, Some((stage, entry)), &constants).expect(TRANSLATES);
        let options = glsl::Options {
            version: glsl::Version::new_gles(300),
            // The page sets depths and rows right itself.
            writer_flags: glsl::WriterFlags::empty(),
            ..Default::default()
        };
        let stage = glsl::PipelineOptions { shader_stage: stage, entry_point: entry.to_owned(), multiview: None };
        let mut text = String::new();
        glsl::Writer::new(&mut text, &module, &info, &options, &stage, Default::default())
            .and_then(|mut writer| writer.write())
            .expect(TRANSLATES);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sources_are_valid() {
        crate::test_room::validate_shader(WEBGPU);
        crate::test_room::validate_shader(WEBGL2);
    }

    /// What the page finds resources by, and what WebGL2 does not know, in the shaders of every mode.
    #[test]
    fn every_mode_is_translated_to_what_webgl2_knows() {
        for translator in [false, true].map(Translator::new) {
            let vertex = translator.vertex();
            assert!(vertex.contains("flat out uint") && vertex.contains("_group_1_binding_2_vs"), "{vertex}");
            for mode in Mode::ALL {
                let fragment = translator.fragment(mode);
                for text in [&vertex, &fragment] {
                    assert!(text.starts_with("#version 300 es"), "{text}");
                    assert!(!text.contains("buffer ") && !text.contains("bitfieldExtract"), "{text}");
                }
                assert!(fragment.contains("_group_1_binding_0_fs"), "{mode}: {fragment}");
            }
            assert_ne!(translator.fragment(Mode::Shaded), translator.fragment(Mode::Light));
        }
    }
}
