//! Second and third opinions on every embedded SPIR-V module: `spirv-val` must accept all of them, naga all that it can read. And what the
//! interfaces promise: which bindings are used, and that no kernel reads by texels what it writes.

use std::collections::BTreeSet;
use std::io::Write;
use std::process::{Command, Stdio};

use clerestory::gpu::interface::{BindingInfo, BindingKind, ShaderInfo};
use clerestory::gpu::shaders;
use clerestory_samples::shaders as sample_shaders;
use clerestory_tests::shaders as test_shaders;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// What naga says of modules with texel buffers, which it does not know.
const NO_TEXELS: &str = "SampledBuffer";

/// The other modules that naga cannot read or does not accept, each with words of its reason. One that it starts to accept must leave the list.
const REFUSED_BY_NAGA: &[(&str, &str)] = &[
    // Matrix columns of three rows without padding: naga knows the standard layouts only, not the scalar one.
    ("layout_probe.comp", "UnsupportedMatrixStride"),
    // A colour of three numbers right behind a position of two: the scalar layout again.
    ("triangle.vert", "MemberOffset"),
    ("accel/lbvh_grid.comp", "MemberOffset"),
    ("accel/lbvh_climb.comp", "MemberOffset"),
    ("accel/lbvh_refit.comp", "MemberOffset"),
    ("accel/lbvh_refit_triangles.comp", "MemberOffset"),
    // Vectors of three numbers one behind the other.
    ("accel/lbvh_boxes.comp", "ArrayStride"),
    ("techniques/preview/preview_display.comp", "ArrayStride"),
    ("accel/ray_engine.comp", "MemberOffset"),
    // Infinity as a constant.
    ("raster/atlas_splat.comp", "Literal(Infinity)"),
    ("twin_reflective.comp", "Literal(Infinity)"),
    ("raster/splat_points.comp", "SpecConstantOp"),
    // Two numbers right behind one, of three words in all.
    ("raster/splat_pull.comp", "MemberOverlap"),
    ("raster/splat_push.comp", "MemberOverlap"),
    // Graphics beyond WebGPU's: geometry shaders, layers by vertex shaders, signed numbers of views.
    ("layer.geom", "UnsupportedExecutionModel"),
    ("layer.vert", "ShaderViewportIndexLayerEXT"),
    ("view.vert", "ViewIndex"),
    // Vectors of three numbers without a gap behind them.
    ("accel/lbvh_retry.comp", "MemberOffset"),
    ("film/add_frame.comp", "ArrayStride"),
    ("raster/view_shadow_look_up.comp", "ArrayStride"),
    ("host_frame.comp", "ArrayStride"),
    // A reference that naga does not follow.
    ("cube_probe.comp", "InvalidId"),
    ("raster/upsample.comp", "InvalidId"),
    ("techniques/instant_radiosity/deferred_history.comp", "InvalidId"),
    ("techniques/instant_radiosity/deferred_merge.comp", "InvalidId"),
    ("techniques/instant_radiosity/deferred_split.comp", "InvalidId"),
    // A local variable of a type that naga lets none have.
    ("twin_light_tree.comp", "InvalidType"),
    // Comparisons of specialization constants.
    ("twin_random.comp", "SpecConstantOp"),
    ("twin_search.comp", "SpecConstantOp"),
    ("raster/omni_shadow_look_up.comp", "SpecConstantOp"),
    ("maps/gather.comp", "SpecConstantOp"),
    ("maps/directional_border.comp", "SpecConstantOp"),
    ("maps/directional_coarser.comp", "SpecConstantOp"),
    ("maps/directional_look_up.comp", "SpecConstantOp"),
    ("maps/lat_long_of_map.comp", "SpecConstantOp"),
    ("maps/prefilter_ggx.comp", "SpecConstantOp"),
    ("maps/sat_columns.comp", "SpecConstantOp"),
    ("maps/sat_lobe.comp", "SpecConstantOp"),
    ("maps/sat_look_up.comp", "SpecConstantOp"),
    ("maps/sat_rows.comp", "SpecConstantOp"),
    ("kernels/partition.comp", "SpecConstantOp"),
    ("kernels/partition_subgroup.comp", "SpecConstantOp"),
    ("kernels/permute.comp", "SpecConstantOp"),
    ("kernels/radix_count_subgroup.comp", "SpecConstantOp"),
    ("kernels/radix_one_group.comp", "SpecConstantOp"),
    ("kernels/radix_scan.comp", "SpecConstantOp"),
    ("kernels/radix_small.comp", "SpecConstantOp"),
    ("kernels/radix_scatter_subgroup.comp", "SpecConstantOp"),
    ("kernels/reduce_box.comp", "SpecConstantOp"),
    ("kernels/reduce_words.comp", "SpecConstantOp"),
    ("kernels/scan_apply.comp", "SpecConstantOp"),
    ("kernels/scan_apply_subgroup.comp", "SpecConstantOp"),
    ("kernels/scan_reduce.comp", "SpecConstantOp"),
    ("kernels/scan_reduce_subgroup.comp", "SpecConstantOp"),
    ("kernels/scan_totals.comp", "SpecConstantOp"),
    // The choice of one lane of a subgroup.
    ("kernels/model_queue.comp", "GroupNonUniformElect"),
    // Numbers of 64 bits from two words.
    ("techniques/photon_mapping/photon_leaf_size.comp", "UnsupportedExtInst"),
    // Arrays of a specialized size.
    ("kernels/histogram.comp", "InvalidArraySize"),
];

/// The whole workgroup reaches each of these operations: divergent branches end before it, and the loops and early returns around it are uniform. SPIR-V 1.3
/// (its definition of uniform control flow) promises that lanes have reconverged there.
const BY_WHOLE_WORKGROUPS: &str = "the whole workgroup comes to it";
/// By these votes lanes wait for each other, or go where another lane must go; what each lane finds is its own, whichever other lanes vote with it, but for queries that a quota
/// stops: the order of their sums is another.
const WITH_ANY_COMPANY: &str = "no result depends on who votes, but for the last bits of queries that a quota stops";

/// Modules with subgroup operations, each with why its results do not depend on lanes coming together again where SPIR-V does not promise it.
const WITH_SUBGROUP_OPERATIONS: &[(&str, &str)] = &[
    ("accel/trace_queue_vote.comp", WITH_ANY_COMPANY),
    ("kernels/model_queue.comp", BY_WHOLE_WORKGROUPS),
    ("kernels/partition_subgroup.comp", BY_WHOLE_WORKGROUPS),
    ("kernels/radix_scatter_subgroup.comp", BY_WHOLE_WORKGROUPS),
    ("kernels/scan_apply_subgroup.comp", BY_WHOLE_WORKGROUPS),
    ("kernels/scan_reduce_subgroup.comp", BY_WHOLE_WORKGROUPS),
    ("techniques/photon_mapping/photon_beam_packet.comp", WITH_ANY_COMPANY),
    ("techniques/photon_mapping/photon_gather_packet.comp", WITH_ANY_COMPANY),
];

#[test]
fn every_module_with_subgroup_operations_is_known_not_to_depend_on_reconvergence() {
    let found: BTreeSet<_> = all()
        .filter(|shader| shader.subgroups)
        .map(|shader| shader.name)
        .collect();
    let known: BTreeSet<_> = WITH_SUBGROUP_OPERATIONS.iter().map(|(name, _)| *name).collect();
    assert_eq!(found, known, "read it, and say why it is sound");
}

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

/// The shaders of the engine, and those of the tests and the samples.
fn all() -> impl Iterator<Item = &'static ShaderInfo> {
    let others = test_shaders::ALL.iter().chain(sample_shaders::ALL);
    shaders::ALL.iter().chain(others).copied()
}

fn has_texels(shader: &ShaderInfo) -> bool {
    shader
        .bindings
        .iter()
        .any(|binding| binding.kind == BindingKind::TexelBuffer)
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
fn naga_accepts_every_module_that_it_can_read() {
    let mut wrong = Vec::new();
    for shader in all() {
        let known = REFUSED_BY_NAGA.iter().find(|(name, _)| *name == shader.name);
        match (naga_says(shader), known) {
            (Ok(()), None) => {}
            (Ok(()), Some(_)) => wrong.push(format!("{}: naga accepts it now; take it off the list", shader.name)),
            (Err(reason), Some((_, words))) if reason.contains(words) => {}
            (Err(reason), None) if has_texels(shader) && reason.contains(NO_TEXELS) => {}
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

#[test]
fn unused_bindings_are_told_from_used_ones() {
    let shade = shaders::techniques::path::path_shade::INFO.bindings;
    let used = |name: &str| {
        shade
            .iter()
            .find(|binding| binding.name == name)
            .map(|binding| binding.used)
    };
    assert_eq!(used("walk_states_in"), Some(true));
    assert_eq!(used("walk_states_out"), Some(true));
    // It chooses its shadow rays itself, and leaves their queue to the compaction.
    assert_eq!(used("walk_waiting_queue_in"), Some(false));
    assert_eq!(used("walk_waiting_queue_out"), Some(false));
    assert_eq!(used("walk_chunks"), Some(false));
}

/// Buffers that are two, one read and one written, and change places: those of walks with every bounce, those of the radix sort with
/// every digit. What both would be for one dispatch is checked when it is recorded.
const IN_TURNS: [&str; 4] = ["walk_queue", "walk_states", "radix_keys", "radix_values"];

#[test]
fn no_kernel_reads_by_texels_what_it_writes() {
    let mut stems = BTreeSet::new();
    let mut wrong = Vec::new();
    for shader in all() {
        let stem = |binding: &'static BindingInfo| {
            let texels = binding.kind == BindingKind::TexelBuffer;
            binding.name.strip_suffix("_in").filter(|_| texels)
        };
        stems.extend(shader.bindings.iter().filter_map(stem));
        for stem in shader.used_bindings().filter_map(stem) {
            let output = format!("{stem}_out");
            let written = shader.used_bindings().any(|other| other.writes && other.name == output);
            if written && !IN_TURNS.contains(&stem) {
                wrong.push(format!("{} reads {stem}_in and writes {output}", shader.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let of_walks = [
        "flags",
        "hits",
        "numbers",
        "queue",
        "states",
        "waiting",
        "waiting_queue",
    ]
    .map(|name| format!("walk_{name}"));
    let of_sorts = ["keys", "values"].map(|name| format!("radix_{name}"));
    let of_photons = ["event_records", "photon_records"].map(str::to_owned);
    let known = of_photons.iter().chain(&of_sorts).chain(&of_walks);
    assert!(stems.iter().eq(known), "{stems:?}");
}

/// `maxBoundDescriptorSets` of every device.
const BOUND_SETS: u32 = 4;

#[test]
fn no_module_has_more_descriptor_sets_than_every_device_binds() {
    for shader in all() {
        for binding in shader.bindings {
            assert!(
                binding.set < BOUND_SETS,
                "{}: {} is in set {}",
                shader.name,
                binding.name,
                binding.set
            );
        }
    }
}

/// `maxPushConstantsSize` of every device.
const PUSH_BYTES: u32 = 128;

#[test]
fn no_module_has_more_push_constants_than_every_device_takes() {
    for shader in all() {
        let bytes = shader.push_constant_bytes;
        assert!(bytes <= PUSH_BYTES, "{}: {bytes} bytes", shader.name);
    }
}
