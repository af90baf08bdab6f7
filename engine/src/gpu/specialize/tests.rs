//! Against small modules by hand, and over all kernels: what is left is smaller, and sound by the word of `spirv-val`.

use std::io::Write;
use std::process::{Command, Stdio};

use rayon::prelude::*;

use super::words::first_word;
use super::*;
use crate::gpu::interface::{ShaderInfo, SpecInfo};
use crate::gpu::shaders::{self, constants as c};
use crate::test_random::Random;

// Ids of the module below.
const BOOL: u32 = 2;
const UINT: u32 = 3;
const FLAG: u32 = 4;
const COUNT: u32 = 5;
const IS_THREE: u32 = 6;
const THREE: u32 = 7;
const FUNCTION: u32 = 8;
const BOUND: u32 = 40;

fn instruction(op: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![first_word(op, 1 + operands.len())];
    words.extend(operands);
    words
}

fn module(parts: &[Vec<u32>]) -> Vec<u32> {
    let header = [MAGIC, 0x0001_0300, 0, BOUND, 0];
    header.into_iter().chain(parts.iter().flatten().copied()).collect()
}

/// A flag with the interface id 1, a count with 2, an expression that says whether the count is 3, and a function of these blocks.
fn with_function(names: &[Vec<u32>], blocks: &[Vec<u32>]) -> Vec<u32> {
    with_functions(names, &[(FUNCTION, blocks)])
}

/// The same of several functions, each by its id.
fn with_functions(names: &[Vec<u32>], functions: &[(u32, &[Vec<u32>])]) -> Vec<u32> {
    let mut parts = names.to_vec();
    parts.extend([
        instruction(op::DECORATE, &[FLAG, op::DECORATION_SPEC_ID, 1]),
        instruction(op::DECORATE, &[COUNT, op::DECORATION_SPEC_ID, 2]),
        instruction(op::TYPE_VOID, &[1]),
        instruction(op::TYPE_BOOL, &[BOOL]),
        instruction(op::TYPE_INT, &[UINT, 32, 0]),
        instruction(op::SPEC_TRUE, &[BOOL, FLAG]),
        instruction(op::SPEC, &[UINT, COUNT, 3]),
        instruction(op::CONSTANT, &[UINT, THREE, 3]),
        instruction(op::SPEC_OP, &[BOOL, IS_THREE, op::I_EQUAL, COUNT, THREE]),
    ]);
    for (id, blocks) in functions {
        parts.push(instruction(op::FUNCTION, &[1, *id, 0, 9]));
        parts.extend(blocks.iter().cloned());
        parts.push(instruction(op::FUNCTION_END, &[]));
    }
    module(&parts)
}

/// A choice of what `condition` says, whose sides are blocks 11 and 12, and which the phi instruction 15 ends.
fn choice(condition: u32) -> Vec<Vec<u32>> {
    vec![
        instruction(op::LABEL, &[10]),
        instruction(op::SELECTION_MERGE, &[13, 0]),
        instruction(op::BRANCH_CONDITIONAL, &[condition, 11, 12]),
        instruction(op::LABEL, &[11]),
        instruction(op::I_ADD, &[UINT, 20, THREE, THREE]),
        instruction(op::BRANCH, &[13]),
        instruction(op::LABEL, &[12]),
        instruction(op::I_MUL, &[UINT, 21, THREE, THREE]),
        instruction(op::BRANCH, &[13]),
        instruction(op::LABEL, &[13]),
        instruction(op::PHI, &[UINT, 15, 20, 11, 21, 12]),
        instruction(op::RETURN, &[]),
    ]
}

/// What is written of a module none of whose functions stays whole.
fn specialized(module: &[u32], values: &[(u32, u32)]) -> Result<Vec<u32>, String> {
    let mut whole = Vec::new();
    let written = write(module, values, &mut whole)?;
    if whole.is_empty() {
        Ok(written)
    } else {
        Err(format!("{whole:?}"))
    }
}

fn of(words: &[u32]) -> Vec<Vec<u32>> {
    let instructions = split(&words[HEADER..]).expect("well formed");
    instructions.into_iter().map(<[u32]>::to_vec).collect()
}

#[test]
fn one_side_of_a_known_choice_is_left() {
    // Without contraction, which names of what is left keep.
    let names = [20, 21].map(|id| instruction(op::DECORATE, &[id, 42]));
    let source = with_function(&names, &choice(FLAG));
    for (value, block, gone, sum) in [(1, 11, 12, 20), (0, 12, 11, 21)] {
        let left = of(&specialized(&source, &[(1, value)]).expect("sound"));
        let truth = if value == 1 {
            op::CONSTANT_TRUE
        } else {
            op::CONSTANT_FALSE
        };
        assert!(left.contains(&instruction(truth, &[BOOL, FLAG])));
        assert!(left.contains(&instruction(op::BRANCH, &[block])) && !left.contains(&instruction(op::LABEL, &[gone])));
        assert!(left.contains(&instruction(op::PHI, &[UINT, 15, sum, block])));
        assert!(left.contains(&instruction(op::DECORATE, &[sum, 42])));
        assert!(!left.contains(&instruction(op::DECORATE, &[41 - sum, 42])));
        assert!(
            left.iter().all(|words| {
                opcode(words) != op::SELECTION_MERGE && !words.ends_with(&[op::DECORATION_SPEC_ID, 1])
            })
        );
    }
}

#[test]
fn values_and_expressions_are_written_in() {
    let source = with_function(&[], &choice(IS_THREE));
    for (values, count, truth) in [(&[][..], 3, op::CONSTANT_TRUE), (&[(2, 4)][..], 4, op::CONSTANT_FALSE)] {
        let left = of(&specialized(&source, values).expect("sound"));
        assert!(left.contains(&instruction(op::CONSTANT, &[UINT, COUNT, count])));
        assert!(left.contains(&instruction(truth, &[BOOL, IS_THREE])));
        let sides = [11, 12].map(|label| left.contains(&instruction(op::LABEL, &[label])));
        assert_eq!(sides, [truth == op::CONSTANT_TRUE, truth == op::CONSTANT_FALSE]);
    }
}

#[test]
fn a_selection_that_others_leave_stays() {
    // The side that is left goes to the end of the choice by what only the run knows.
    let mut blocks = choice(FLAG);
    blocks[4] = instruction(op::I_EQUAL, &[BOOL, 20, 30, THREE]);
    blocks[5] = instruction(op::BRANCH_CONDITIONAL, &[20, 13, 16]);
    blocks.splice(6..6, [instruction(op::LABEL, &[16]), instruction(op::BRANCH, &[13])]);
    let left = of(&specialized(&with_function(&[], &blocks), &[(1, 1)]).expect("sound"));
    assert!(left.contains(&instruction(op::SELECTION_MERGE, &[13, 0])));
    assert!(left.contains(&instruction(op::LABEL, &[12])));
}

#[test]
fn loops_keep_their_way_back() {
    let blocks = [
        instruction(op::LABEL, &[10]),
        instruction(op::BRANCH, &[11]),
        instruction(op::LABEL, &[11]),
        instruction(op::PHI, &[UINT, 15, THREE, 10, 20, 12]),
        instruction(op::LOOP_MERGE, &[13, 12, 0]),
        instruction(op::BRANCH, &[12]),
        instruction(op::LABEL, &[12]),
        instruction(op::I_ADD, &[UINT, 20, 15, THREE]),
        instruction(op::BRANCH_CONDITIONAL, &[FLAG, 11, 13]),
        instruction(op::LABEL, &[13]),
        instruction(op::RETURN, &[]),
    ];
    for value in [0, 1] {
        let left = of(&specialized(&with_function(&[], &blocks), &[(1, value)]).expect("sound"));
        assert!(blocks.iter().all(|words| left.contains(words)));
    }
}

#[test]
fn what_is_no_module_stays_as_it_is() {
    let cut = module(&[vec![first_word(op::LABEL, 3), 1]]);
    let endless = module(&[vec![0]]);
    let by_groups = module(&[instruction(op::DECORATION_GROUP, &[1])]);
    for module in [&[][..], &[MAGIC], &cut, &endless, &by_groups] {
        assert_eq!(specialize("test", module, &[]), None);
    }
}

#[test]
fn a_function_that_would_lose_its_structure_stays_whole_alone() {
    // The flag leaves the loop at once, and nothing is left to lead back.
    let left_at_once = [
        instruction(op::LABEL, &[24]),
        instruction(op::BRANCH, &[25]),
        instruction(op::LABEL, &[25]),
        instruction(op::LOOP_MERGE, &[28, 27, 0]),
        instruction(op::BRANCH_CONDITIONAL, &[FLAG, 28, 26]),
        instruction(op::LABEL, &[26]),
        instruction(op::I_MUL, &[UINT, 22, THREE, COUNT]),
        instruction(op::BRANCH, &[27]),
        instruction(op::LABEL, &[27]),
        instruction(op::BRANCH, &[25]),
        instruction(op::LABEL, &[28]),
        instruction(op::RETURN, &[]),
    ];
    const OTHER: u32 = 9;
    let names = [20, 21, 22].map(|id| instruction(op::DECORATE, &[id, 42]));
    let source = with_functions(&names, &[(OTHER, &left_at_once), (FUNCTION, &choice(FLAG))]);
    let mut whole = Vec::new();
    let left = of(&write(&source, &[(1, 1), (2, 5)], &mut whole).expect("sound"));
    assert_eq!(whole, [(OTHER, "a loop of it would have no way back")]);
    let begin = left
        .iter()
        .position(|words| *words == left_at_once[0])
        .expect("its first block");
    assert_eq!(left[begin..begin + left_at_once.len()], left_at_once);
    // It has the values of constants, and the other function is specialized.
    assert!(left.contains(&instruction(op::CONSTANT_TRUE, &[BOOL, FLAG])));
    assert!(left.contains(&instruction(op::CONSTANT, &[UINT, COUNT, 5])));
    assert!(!left.contains(&instruction(op::LABEL, &[12])));
    let decorated = names.map(|words| left.contains(&words));
    assert_eq!(decorated, [true, false, true]);
    // With the flag off it goes round, and all is specialized.
    let left = of(&specialized(&source, &[(1, 0)]).expect("sound"));
    assert!(left.contains(&instruction(op::LABEL, &[12])) && !left.contains(&instruction(op::LABEL, &[11])));
}

#[test]
fn switches_stay_where_their_literals_may_be_long() {
    let switch = [
        instruction(op::LABEL, &[10]),
        instruction(op::SELECTION_MERGE, &[13, 0]),
        instruction(op::SWITCH, &[COUNT, 13, 1, 11]),
        instruction(op::LABEL, &[11]),
        instruction(op::BRANCH, &[13]),
        instruction(op::LABEL, &[13]),
        instruction(op::RETURN, &[]),
    ];
    for (width, stays_whole) in [(16, false), (64, true)] {
        let other = [instruction(op::TYPE_INT, &[30, width, 0])];
        let source = with_function(&other, &switch);
        let mut whole = Vec::new();
        let left = of(&write(&source, &[], &mut whole).expect("sound"));
        assert_eq!(whole.len(), usize::from(stays_whole));
        assert!(switch.iter().all(|words| left.contains(words)));
    }
}

fn words_of(shader: &ShaderInfo) -> Vec<u32> {
    let words = shader.spirv.chunks_exact(4);
    words
        .map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        .collect()
}

#[test]
fn all_kernels_can_be_specialized_and_shrink() {
    let (mut before, mut without) = (0, 0);
    for shader in shaders::ALL {
        let words = words_of(shader);
        for value in [0, 1] {
            let switches: Vec<(u32, u32)> = shader
                .spec_constants
                .iter()
                .filter(|constant| constant.default <= 1)
                .map(|constant| (constant.id, value))
                .collect();
            let left = specialized(&words, &switches).unwrap_or_else(|why| panic!("{}: {why}", shader.name));
            assert!(left.len() <= words.len(), "{}", shader.name);
            if value == 0 {
                before += words.len();
                without += left.len();
            }
        }
    }
    assert!(without < before / 2, "{without} of {before} words");
}

/// Numbers in the interface of the constants that are truth values.
fn truth_values(words: &[u32]) -> Vec<u32> {
    let instructions = split(&words[HEADER..]).expect("well formed");
    let of = |ops: &[u32]| {
        let some = instructions.iter().filter(|words| ops.contains(&opcode(words)));
        some.copied().collect::<Vec<_>>()
    };
    let truths: HashSet<u32> = of(&[op::SPEC_TRUE, op::SPEC_FALSE])
        .iter()
        .map(|words| words[2])
        .collect();
    of(&[op::DECORATE])
        .iter()
        .filter(|words| words[2] == op::DECORATION_SPEC_ID && truths.contains(&words[1]))
        .map(|words| words[3])
        .collect()
}

/// Constants that choose among kinds and methods, and all their values.
const KINDS: [(&str, &[u32]); 17] = [
    (
        "curve_form",
        &[
            c::CURVE_NOTHING,
            c::CURVE_EXACT,
            c::CURVE_SCHLICK,
            c::CURVE_RESCALED,
            c::CURVE_COMPENSATED,
            c::CURVE_RESCALED_F0,
            c::CURVE_COMPENSATED_F0,
            c::CURVE_TINTED,
            c::CURVE_SIMPLIFIED,
            c::CURVE_TABLE,
        ],
    ),
    (
        "directional_kind",
        &[
            c::DIRECTIONAL_OCTAHEDRON,
            c::DIRECTIONAL_OCTAHEDRON_RECTANGULAR,
            c::DIRECTIONAL_EQUAL_AREA,
            c::DIRECTIONAL_LAT_LONG,
            c::DIRECTIONAL_CUBE,
            c::DIRECTIONAL_PARABOLOID,
            c::DIRECTIONAL_SPHERE,
            c::DIRECTIONAL_NUSSELT,
        ],
    ),
    ("edge_bound", &[c::EDGE_UNBOUNDED, c::EDGE_GEOMETRY, c::EDGE_DISTANCE]),
    ("gather_form", &[c::GATHER_RATIO, c::GATHER_DISC, c::GATHER_NORMALS]),
    (
        "impostor_method",
        &[
            c::IMPOSTOR_CLASSICAL,
            c::IMPOSTOR_PERPENDICULAR,
            c::IMPOSTOR_FIXED_POINT,
            c::IMPOSTOR_SECANT_FROM_POINT,
            c::IMPOSTOR_SECANT_FROM_GUESS,
            c::IMPOSTOR_FALSE_POSITION,
            c::IMPOSTOR_MIXED,
            c::IMPOSTOR_HYBRID,
            c::IMPOSTOR_MARCH,
        ],
    ),
    (
        "index_kind",
        &[c::INDEX_BVH2, c::INDEX_KD, c::INDEX_WIDE, c::INDEX_TWO_LEVEL],
    ),
    (
        "kd_stack_cache",
        &[c::KD_STACK_CACHE_NONE, c::KD_STACK_CACHE_HEAD, c::KD_STACK_CACHE_BYTES],
    ),
    ("operation", &[c::OPERATION_SUM, c::OPERATION_MIN, c::OPERATION_MAX]),
    ("profile", &[c::KERNEL_UNIFORM, c::KERNEL_CONE, c::KERNEL_EPANECHNIKOV]),
    ("queue", &[c::QUEUE_SLOTS, c::QUEUE_COMPACTED, c::QUEUE_BLOCKS]),
    ("rsm_sequence", &[c::RSM_HALTON, c::RSM_HAMMERSLEY, c::RSM_RANDOM]),
    (
        "sampler_kind",
        &[c::SAMPLER_SOBOL, c::SAMPLER_PCG, c::SAMPLER_JOINT_SOBOL],
    ),
    ("sat_numbers", &[c::SAT_FLOAT, c::SAT_TWO_FLOAT, c::SAT_FIXED]),
    ("selection", &[c::SELECT_ALL, c::SELECT_POTENTIAL, c::SELECT_CUTS]),
    ("shadow_kind", &[c::SHADOW_CUBE, c::SHADOW_OCTAHEDRON]),
    (
        "strategy",
        &[
            c::STRATEGY_COMBINED,
            c::STRATEGY_EMISSION,
            c::STRATEGY_LIGHT_SAMPLES,
            c::STRATEGY_CONNECTIONS,
            c::STRATEGY_SPLATS,
        ],
    ),
    (
        "visibility",
        &[c::VISIBILITY_NONE, c::VISIBILITY_RAYS, c::VISIBILITY_MAPS],
    ),
];

/// Values for the constants of a shader: its truth values all off, and as many mixtures of them as let each kind that a number chooses have its turn. Other numbers stay, since not every one is a size that an array can have.
fn choices(shader: &ShaderInfo, words: &[u32], random: &mut Random) -> Vec<Vec<(u32, u32)>> {
    let mut truths = truth_values(words);
    truths.sort_unstable();
    let kinds: Vec<(u32, &[u32])> = shader.spec_constants.iter().filter_map(kind).collect();
    let turns = kinds.iter().map(|(_, values)| values.len()).max().unwrap_or(1);
    let mut all = vec![truths.iter().map(|id| (*id, 0)).collect()];
    all.extend((0..turns).map(|turn| {
        let mixture = truths.iter().map(|id| (*id, random.below(2) as u32));
        let of_turn = kinds.iter().map(|(id, values)| (*id, values[turn % values.len()]));
        mixture.chain(of_turn).collect()
    }));
    all
}

/// Number in the interface of a constant that chooses among kinds, and their values.
fn kind(constant: &SpecInfo) -> Option<(u32, &'static [u32])> {
    let (_, values) = KINDS.iter().find(|(name, _)| *name == constant.name)?;
    Some((constant.id, values))
}

#[test]
fn kinds_are_those_of_kernels() {
    for (name, values) in KINDS {
        let constants = shaders::ALL.iter().flat_map(|shader| shader.spec_constants);
        let defaults: Vec<u32> = constants
            .filter(|constant| constant.name == name)
            .map(|constant| constant.default)
            .collect();
        assert!(!defaults.is_empty(), "{name}");
        assert!(
            defaults.iter().all(|value| values.contains(value)),
            "{name}: {defaults:?}"
        );
    }
}

/// What `spirv-val` says of a module, with the options of `tests/tests/code/shaders.rs`; an error where it cannot be run.
fn validate(module: &[u32]) -> std::io::Result<Result<(), String>> {
    let mut child = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.1", "--scalar-block-layout", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    // It may close its input before it has read all of it.
    if let Some(mut input) = child.stdin.take() {
        let _ = input.write_all(bytemuck::cast_slice(module));
    }
    let output = child.wait_with_output()?;
    if output.status.success() {
        return Ok(Ok(()));
    }
    let said = [output.stdout, output.stderr].concat();
    Ok(Err(String::from_utf8_lossy(&said).into_owned()))
}

#[test]
fn spirv_val_accepts_specialized_kernels() {
    if let Err(error) = Command::new("spirv-val").arg("--version").output() {
        println!("not supported: spirv-val cannot be run ({error}); it comes with spirv-tools");
        return;
    }
    let mut random = Random(83);
    let mut made = HashSet::new();
    let mut modules = Vec::new();
    for shader in shaders::ALL {
        let words = words_of(shader);
        made.insert(words.clone());
        for values in choices(shader, &words, &mut random) {
            let left = write(&words, &values, &mut Vec::new()).unwrap_or_else(|why| panic!("{}: {why}", shader.name));
            // What constants change nothing of is read as it is by the tests' crate.
            if made.insert(left.clone()) {
                modules.push((shader.name, values, left));
            }
        }
    }
    assert!(2 * modules.len() > shaders::ALL.len(), "{} modules", modules.len());
    let wrong: Vec<String> = modules
        .par_iter()
        .filter_map(|(name, values, module)| {
            let said = validate(module).expect("spirv-val").err()?;
            Some(format!("{name} with {values:?}: {said}"))
        })
        .collect();
    assert!(
        wrong.is_empty(),
        "{} of {}:\n{}",
        wrong.len(),
        modules.len(),
        wrong.join("\n")
    );
}
