//! Shaders become SPIR-V: one file in OUT_DIR per entry point and variant.

fn main() {
    println!("cargo:rerun-if-changed=shaders");
    #[cfg(feature = "vulkan")]
    shaders::compile();
}

#[cfg(feature = "vulkan")]
mod shaders {
    use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
    use glslang::{Compiler, CompilerOptions, ShaderInput, ShaderSource, ShaderStage, Target};
    use std::path::{Path, PathBuf};

    /// Entry points below shaders/, the names of what becomes of them, and macros. Drivers take long for code even where
    /// constants switch it off, so kernels come in variants: `FULL` has the rarer effects.
    const ENTRIES: [(&str, &str, &[&str]); 17] = [
        ("path.comp", "path", &[]),
        ("path.comp", "path_full", &["FULL"]),
        ("path_query.comp", "path_query", &[]),
        ("path_query.comp", "path_query_full", &["FULL"]),
        ("path.rgen", "path_generation", &[]),
        ("path.rgen", "path_generation_full", &["FULL"]),
        ("path.rmiss", "path_miss", &[]),
        ("path.rahit", "path_any_hit", &[]),
        ("path.rchit", "path_closest_hit", &[]),
        ("path_quadric.rchit", "path_quadric_hit", &[]),
        ("path.rint", "path_intersection", &[]),
        ("fold.comp", "fold", &[]),
        ("test/math.comp", "test_math", &["FULL"]),
        ("test/sampling.comp", "test_sampling", &[]),
        ("test/light.comp", "test_light", &["FULL"]),
        ("test/intersection.comp", "test_intersection", &[]),
        ("test/texture.comp", "test_texture", &[]),
    ];

    pub(super) fn compile() {
        let root = Path::new("shaders");
        let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
        for (file, name, macros) in ENTRIES {
            let path = root.join(file);
            let words = translate(root, &path, macros).unwrap_or_else(|log| {
                for line in log.lines().filter(|l| !l.trim().is_empty()) {
                    println!("cargo:warning={line}");
                }
                panic!("{} does not compile (see above)", path.display());
            });
            let words = strict(words);
            let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
            std::fs::write(out.join(format!("{name}.spv")), bytes).expect("OUT_DIR can be written");
        }
    }

    /// Includes are relative to shaders/.
    struct Includes<'a>(&'a Path);

    impl IncludeHandler for Includes<'_> {
        fn include(&mut self, _: IncludeType, name: &str, _: &str, _: usize) -> Option<IncludeResult> {
            let data = std::fs::read_to_string(self.0.join(name)).ok()?;
            Some(IncludeResult { name: self.0.join(name).display().to_string(), data })
        }
    }

    fn translate(root: &Path, path: &Path, macros: &[&str]) -> Result<Vec<u32>, String> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let compiler = Compiler::acquire().ok_or("glslang does not start")?;
        let options = CompilerOptions {
            target: Target::Vulkan {
                version: glslang::VulkanVersion::Vulkan1_2,
                spirv_version: glslang::SpirvVersion::SPIRV1_5,
            },
            ..CompilerOptions::default()
        };
        let stage = match path.extension().and_then(|e| e.to_str()) {
            Some("comp") => ShaderStage::Compute,
            Some("rgen") => ShaderStage::RayGeneration,
            Some("rmiss") => ShaderStage::Miss,
            Some("rahit") => ShaderStage::AnyHit,
            Some("rchit") => ShaderStage::ClosestHit,
            Some("rint") => ShaderStage::Intersect,
            other => return Err(format!("{}: extension {other:?} names no shader stage", path.display())),
        };
        let source = ShaderSource::from(text);
        let mut includes = Includes(root);
        // glslang calls the file itself "0".
        let place = |e: glslang::error::GlslangError| {
            e.to_string().replace("ERROR: 0:", &format!("ERROR: {}:", path.display()))
        };
        let macros: Vec<(&str, Option<&str>)> = macros.iter().map(|name| (*name, None)).collect();
        let input = ShaderInput::new(&source, stage, &options, Some(&macros), Some(&mut includes)).map_err(place)?;
        compiler.create_shader(input).map_err(place)?.compile().map_err(place)
    }

    /// Forbids the driver to reassociate or contract any floating-point operation and to assume that there is no ∞, NaN or −0:
    /// by default Vulkan allows both (notes of the specification's appendix "Precision and Operation of SPIR-V Instructions"),
    /// and a watertight intersection or a compensated sum would silently be none.
    fn strict(words: Vec<u32>) -> Vec<u32> {
        const CAPABILITY: u32 = 17;
        const ENTRY_POINT: u32 = 15;
        const EXECUTION_MODE: u32 = 16;
        const DECORATE: u32 = 71;
        const NO_CONTRACTION: u32 = 42;
        const SIGNED_ZERO_INF_NAN_PRESERVE: [u32; 2] = [4466, 4461];
        const TYPE_FLOAT: u32 = 22;
        let is_arithmetic = |op: u32| matches!(op, 127 | 129 | 131 | 133 | 136 | 140..=148);
        let is_type = |op: u32| (19..=39).contains(&op);
        let header = 5;
        let mut instructions = Vec::new();
        let mut at = header;
        while at < words.len() {
            let length = (words[at] >> 16) as usize;
            instructions.push(&words[at..at + length]);
            at += length;
        }
        let op = |i: &[u32]| i[0] & 0xFFFF;
        let instruction = |op: u32, operands: &[u32]| {
            let mut i = vec![(operands.len() as u32 + 1) << 16 | op];
            i.extend(operands);
            i
        };
        let decorated: std::collections::HashSet<u32> =
            instructions.iter().filter(|i| op(i) == DECORATE && i[2] == NO_CONTRACTION).map(|i| i[1]).collect();
        let widths: Vec<u32> = instructions.iter().filter(|i| op(i) == TYPE_FLOAT).map(|i| i[2]).collect();
        let last_entry = instructions.iter().rposition(|i| op(i) == ENTRY_POINT).expect("an entry point");
        let first_type = instructions.iter().position(|i| is_type(op(i))).expect("a type");
        let mut out = words[..header].to_vec();
        out.extend(instruction(CAPABILITY, &[SIGNED_ZERO_INF_NAN_PRESERVE[0]]));
        for (n, i) in instructions.iter().enumerate() {
            if n == first_type {
                for i in instructions.iter().filter(|i| is_arithmetic(op(i)) && !decorated.contains(&i[2])) {
                    out.extend(instruction(DECORATE, &[i[2], NO_CONTRACTION]));
                }
            }
            out.extend(*i);
            if n == last_entry {
                for width in &widths {
                    out.extend(instruction(EXECUTION_MODE, &[i[2], SIGNED_ZERO_INF_NAN_PRESERVE[1], *width]));
                }
            }
        }
        out
    }
}
