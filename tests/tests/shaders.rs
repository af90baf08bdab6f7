//! Second and third opinions on every embedded SPIR-V module: `spirv-val` must accept all of them, naga all that it can read.

use std::io::Write;
use std::process::{Command, Stdio};

use clerestory::gpu::interface::{ShaderInfo, Stage};
use clerestory::gpu::shaders;
use clerestory_tests::shaders as test_shaders;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// The modules that naga cannot read or does not accept, each with words of its reason. One that it starts to accept must leave the list.
const REFUSED_BY_NAGA: &[(&str, &str)] = &[
    // Matrix columns of three rows without padding: naga knows the standard layouts only, not the scalar one.
    ("layout_probe.comp", "UnsupportedMatrixStride"),
    // Texel buffers.
    ("twin_texture.comp", "SampledBuffer"),
    ("scene/records.comp", "SampledBuffer"),
    ("transport/path_camera.comp", "SampledBuffer"),
    ("transport/path_shade.comp", "SampledBuffer"),
    ("transport/path_compact_count.comp", "SampledBuffer"),
    ("transport/path_compact_scan.comp", "SampledBuffer"),
    ("transport/path_compact_scatter.comp", "SampledBuffer"),
    ("transport/path_resolve.comp", "SampledBuffer"),
    ("accel/trace_any.comp", "SampledBuffer"),
    ("accel/trace_closest.comp", "SampledBuffer"),
    ("transport/path_extend.comp", "SampledBuffer"),
    ("transport/path_extend_alpha.comp", "SampledBuffer"),
    ("transport/path_shadow.comp", "SampledBuffer"),
    ("transport/path_shadow_alpha.comp", "SampledBuffer"),
    // Comparisons of specialization constants.
    ("twin_random.comp", "SpecConstantOp"),
];

/// The module without its line numbers, which naga takes only inside functions.
fn without_lines(spirv: &[u8]) -> Vec<u8> {
    const HEADER_BYTES: usize = 20;
    const OP_LINE: u16 = 8;
    const OP_NO_LINE: u16 = 317;
    let (header, mut rest) = spirv.split_at(HEADER_BYTES);
    let mut kept = header.to_vec();
    while let [low, high, size_low, size_high, ..] = rest {
        let words = usize::from(u16::from_le_bytes([*size_low, *size_high]));
        let (instruction, after) = rest.split_at(4 * words.max(1));
        if ![OP_LINE, OP_NO_LINE].contains(&u16::from_le_bytes([*low, *high])) {
            kept.extend_from_slice(instruction);
        }
        rest = after;
    }
    kept
}

/// The shaders of the engine, and those of the tests.
fn all() -> impl Iterator<Item = &'static ShaderInfo> {
    shaders::ALL.iter().chain(test_shaders::ALL).copied()
}

fn naga_says(shader: &ShaderInfo) -> Result<(), String> {
    let options = naga::front::spv::Options::default();
    let module = naga::front::spv::parse_u8_slice(&without_lines(shader.spirv), &options)
        .map_err(|error| format!("{error:?}"))?;
    Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map(drop)
        .map_err(|error| format!("{:?}", error.into_inner()))
}

#[test]
fn naga_accepts_every_compute_module_that_it_can_read() {
    let mut wrong = Vec::new();
    for shader in all().filter(|shader| shader.stage == Stage::Compute) {
        let known = REFUSED_BY_NAGA.iter().find(|(name, _)| *name == shader.name);
        match (naga_says(shader), known) {
            (Ok(()), None) => {}
            (Ok(()), Some(_)) => wrong.push(format!("{}: naga accepts it now; take it off the list", shader.name)),
            (Err(reason), Some((_, words))) if reason.contains(words) => {}
            (Err(reason), _) => wrong.push(format!("{}: {reason}", shader.name)),
        }
    }
    for (name, _) in REFUSED_BY_NAGA {
        if !all().any(|shader| shader.name == *name) {
            wrong.push(format!("{name}: there is no such shader"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn spirv_val_accepts_every_module() {
    for shader in all() {
        // Scalar layout is enabled on every device; the version is the one that the build compiles for.
        let mut child = Command::new("spirv-val")
            .args(["--target-env", "vulkan1.1", "--scalar-block-layout", "-"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| {
                panic!("cannot run spirv-val ({error}): install it (Debian: apt-get install spirv-tools)")
            });
        child.stdin.take().unwrap().write_all(shader.spirv).unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(
            output.status.success(),
            "{}: {}{}",
            shader.name,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

#[test]
fn spirv_val_would_find_a_fault() {
    let mut broken = shaders::ALL[0].spirv.to_vec();
    // The bound of ids, word 3 of the header: too low for the module.
    broken[12..16].copy_from_slice(&1u32.to_le_bytes());
    let mut child = Command::new("spirv-val")
        .arg("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // The tool may close its input before it has read all of it.
    let _ = child.stdin.take().unwrap().write_all(&broken);
    assert!(!child.wait().unwrap().success());
}
