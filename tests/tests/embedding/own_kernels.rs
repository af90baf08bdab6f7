//! Kernels of a host's own: against twins, and every mistake by its name.

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::interface::BindingKind;
use clerestory::gpu::{BufferDesc, Category, Gpu, OwnKernel, OwnResource, rw_compute_to_compute};
use clerestory_tests::with_gpu;

/// Counts in words, so that twins are exact: values are scaled, shifted by a uniform, and summed over pairs by a workgroup's memory.
const SCALE: &str = "
struct Push { factor: u32, count: u32 }
var<immediate> push: Push;
override BIAS: u32 = 3;
override IS_SUMMED: bool = true;
@group(0) @binding(0) var<storage, read> numbers: array<u32>;
@group(0) @binding(1) var<storage, read_write> results: array<u32>;
@group(1) @binding(2) var<uniform> shift: vec4u;
@group(1) @binding(3) var<storage, read> never: array<vec2u, 4>;
var<workgroup> shared_words: array<u32, 64>;

@compute @workgroup_size(64)
fn scale(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    shared_words[lane] = push.factor * numbers[id.x] + shift.y + BIAS;
    workgroupBarrier();
    if id.x < push.count {
        if IS_SUMMED {
            results[id.x] = shared_words[lane] + shared_words[lane ^ 1u];
        } else {
            results[id.x] = numbers[id.x];
        }
    }
}
";

fn uniform(gpu: &Gpu, words: [u32; 4]) -> clerestory::gpu::Buffer {
    let buffer = gpu.buffer(&BufferDesc::uniform("shift", 16, Category::Work)).unwrap();
    gpu.upload(&buffer, 0, &words).unwrap();
    buffer
}

#[test]
fn a_kernel_in_wgsl_is_its_twin() {
    with_gpu(|gpu| {
        let kernel = OwnKernel::wgsl(gpu, "scale", SCALE).unwrap();
        assert_eq!((kernel.workgroup_size(), kernel.push_bytes()), ([64, 1, 1], 8));
        let found: Vec<_> = kernel
            .bindings()
            .iter()
            .map(|b| {
                (
                    b.name.as_str(),
                    b.set,
                    b.binding,
                    b.kind,
                    b.writes,
                    b.least_bytes,
                    b.used,
                )
            })
            .collect();
        let (storage, uniform_buffer) = (BindingKind::StorageBuffer, BindingKind::UniformBuffer);
        let expected = [
            ("numbers", 0, 0, storage, false, 4, true),
            ("results", 0, 1, storage, true, 4, true),
            ("shift", 1, 2, uniform_buffer, false, 16, true),
            ("never", 1, 3, storage, false, 32, false),
        ];
        assert_eq!(found, expected);
        const COUNT: u32 = 1000;
        let numbers: Vec<u32> = (0..1024).map(|i: u32| i.wrapping_mul(2_654_435_761)).collect();
        let input = gpu.buffer_with("numbers", Category::Work, &numbers).unwrap();
        let output = gpu.buffer_with("results", Category::Work, &[9u32; 1024]).unwrap();
        let shift = uniform(gpu, [0, 40, 0, 0]);
        let never = gpu.buffer_with("never", Category::Work, &[0u32; 8]).unwrap();
        let mut recorder = gpu.recorder("own").unwrap();
        recorder
            .pass("scale", |pass| {
                let given = [
                    ("shift", shift.view().into()),
                    ("results", output.view().into()),
                    ("numbers", OwnResource::ReadOnly(input.view())),
                    ("never", never.view().into()),
                ];
                let push = [7u32, COUNT];
                pass.dispatch_own(
                    &kernel,
                    &given,
                    bytemuck::cast_slice(&push),
                    kernel.groups_for([1024, 1, 1]),
                )
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let one = |i: u32| numbers[i as usize].wrapping_mul(7).wrapping_add(43);
        let twin: Vec<u32> = (0..1024)
            .map(|i| if i < COUNT { one(i).wrapping_add(one(i ^ 1)) } else { 9 })
            .collect();
        assert_eq!(gpu.read::<u32>(output.view(), 1024).unwrap(), twin);
    });
}

#[test]
fn a_wild_index_reads_zero_and_writes_nothing() {
    with_gpu(|gpu| {
        let source = "
            @group(0) @binding(0) var<storage, read_write> words: array<u32>;
            @compute @workgroup_size(1)
            fn main() {
                let wild = words[0];
                words[1] = words[wild] + 5u;
                words[wild] = 1u;
                words[wild / words[2]] = 6u;
                var own = array<u32, 4>(1u, 2u, 3u, 4u);
                own[wild] = 8u;
                words[4] = own[wild] + own[3];
            }";
        let kernel = OwnKernel::wgsl(gpu, "wild", source).unwrap();
        // The view ends before the buffer does, and beyond it nothing is touched either.
        for wild in [8u32, 9, 1 << 20, u32::MAX] {
            let mut words = [7u32; 64];
            words[0] = wild;
            words[2] = 0;
            let buffer = gpu.buffer_with("words", Category::Work, &words).unwrap();
            let mut recorder = gpu.recorder("own").unwrap();
            recorder
                .pass("wild", |pass| {
                    pass.dispatch_own(&kernel, &[("words", buffer.slice(0, 32).into())], &[], [1, 1, 1])
                })
                .unwrap();
            recorder.submit().unwrap().wait().unwrap();
            words[1] = 5;
            words[4] = 4;
            assert_eq!(gpu.read::<u32>(buffer.view(), 64).unwrap(), words, "{wild}");
        }
    });
}

/// The error of a source, as line, column and words.
fn mistake(gpu: &Gpu, source: &str) -> (u32, u32, String) {
    match OwnKernel::wgsl(gpu, "wrong", source) {
        Err(Error::KernelSource {
            kernel,
            line,
            column,
            message,
        }) => {
            assert_eq!(kernel, "wrong");
            (line, column, message)
        }
        other => panic!("expected a mistake in the source, got {other:?}"),
    }
}

#[test]
fn mistakes_in_wgsl_have_their_place() {
    with_gpu(|gpu| {
        let unknown = "@compute @workgroup_size(1)\nfn main() {\n    let a = 1u;\n    let b = a + missing;\n}";
        let (line, column, words) = mistake(gpu, unknown);
        assert!(
            (line, column) == (4, 17) && words.contains("missing"),
            "{line}:{column} {words}"
        );
        let syntax = "@compute @workgroup_size(1)\nfn main() {\n    let a = ;\n}";
        let (line, column, words) = mistake(gpu, syntax);
        assert!((line, column) == (3, 13), "{line}:{column} {words}");
        let kind = "@compute @workgroup_size(1)\nfn main() {\n    var a: u32 = 1u;\n    a = 1.5f;\n}";
        let (line, _, words) = mistake(gpu, kind);
        assert!(line == 4, "{line} {words}");
        // Found by validation: what is declared to be read is written.
        let store = "@group(0) @binding(0) var<storage, read> words: array<u32>;\n@compute @workgroup_size(1)\nfn main() {\n    words[0] = 1u;\n}";
        let (line, _, words) = mistake(gpu, store);
        assert!(line == 4, "{line} {words}");
        let (_, _, words) = mistake(gpu, "fn main() {}");
        assert!(words.contains("one compute entry point"), "{words}");
        let two = "@compute @workgroup_size(1) fn a() {}\n@compute @workgroup_size(1) fn b() {}";
        let (_, _, words) = mistake(gpu, two);
        assert!(words.contains("a, b"), "{words}");
        let half = "enable f16;\n@group(0) @binding(0) var<storage, read_write> h: array<f16>;\n@compute @workgroup_size(1) fn main() { h[0] = 1.0h; }";
        let (.., words) = mistake(gpu, half);
        assert!(
            words.to_lowercase().contains("float16") || words.contains("f16"),
            "{words}"
        );

        let texture = "@group(0) @binding(0) var picture: texture_2d<f32>;\n@compute @workgroup_size(1) fn main() { let a = textureLoad(picture, vec2u(0), 0); }";
        let refused = OwnKernel::wgsl(gpu, "texture", texture);
        assert!(
            matches!(&refused, Err(Error::Binding { binding, .. }) if binding == "picture"),
            "{refused:?}"
        );
        let sets = gpu.caps().descriptors.bound_sets;
        for (set, number) in [(u32::MAX, 0), (sets, 0), (0, u32::MAX), (0, 1000)] {
            let far = format!(
                "@group({set}u) @binding({number}u) var<storage, read_write> far: array<u32>;
                @compute @workgroup_size(1) fn main() {{ far[0] = 1u; }}"
            );
            let refused = OwnKernel::wgsl(gpu, "far", &far);
            assert!(
                matches!(&refused, Err(Error::Binding { binding, .. }) if binding == "far"),
                "{set}, {number}: {refused:?}"
            );
        }
        let last = format!(
            "@group({}) @binding(999) var<storage, read_write> far: array<u32>;
            @compute @workgroup_size(1) fn main() {{ far[0] = 1u; }}",
            sets.min(4) - 1
        );
        OwnKernel::wgsl(gpu, "last", &last).unwrap();
        let large = "@compute @workgroup_size(4096, 4096) fn main() {}";
        let refused = OwnKernel::wgsl(gpu, "large", large);
        assert!(
            matches!(&refused, Err(Error::MissingFeature { .. } | Error::KernelSource { .. })),
            "{refused:?}"
        );
        let memory =
            "var<workgroup> words: array<u32, 1000000>;\n@compute @workgroup_size(1) fn main() { words[0] = 1u; }";
        let refused = OwnKernel::wgsl(gpu, "memory", memory);
        assert!(
            matches!(&refused, Err(Error::MissingFeature { feature, .. }) if feature.contains("SharedMemory")),
            "{refused:?}"
        );
    });
}

/// A binding at fault, words of the error, what is given, and the push constants.
type Mistake<'a> = (&'a str, &'a str, Vec<(&'a str, OwnResource<'a>)>, &'a [u8]);

#[test]
fn what_a_dispatch_is_given_is_checked_by_name() {
    with_gpu(|gpu| {
        let kernel = OwnKernel::wgsl(gpu, "scale", SCALE).unwrap();
        let buffer = |name, words: usize| gpu.buffer_with(name, Category::Work, &vec![0u32; words]).unwrap();
        let (input, output, never) = (buffer("numbers", 128), buffer("results", 128), buffer("never", 8));
        let shift = uniform(gpu, [0; 4]);
        let texels = gpu
            .storage_texels("texels", Category::Work, vk::Format::R32_UINT, 64)
            .unwrap();
        let mut recorder = gpu.recorder("own").unwrap();
        let push = [1u32, 64];
        let push: &[u8] = bytemuck::cast_slice(&push);
        let good: [(&str, OwnResource<'_>); 4] = [
            ("numbers", input.view().into()),
            ("results", output.view().into()),
            ("shift", shift.view().into()),
            ("never", never.view().into()),
        ];
        let mut try_with = |given: &[(&str, OwnResource<'_>)], push: &[u8]| {
            recorder.pass("own", |pass| pass.dispatch_own(&kernel, given, push, [1, 1, 1]))
        };
        let with = |name: &'static str, resource| {
            good.map(|(known, good)| {
                if known == name {
                    (known, resource)
                } else {
                    (known, good)
                }
            })
        };
        let misplaced = input.slice(4, 64);
        let mut cases: Vec<Mistake<'_>> = vec![
            ("never", "was not given", good[..3].to_vec(), push),
            (
                "result",
                "is not declared; the source has numbers, results, shift, never",
                [&good[..], &[("result", output.view().into())]].concat(),
                push,
            ),
            ("numbers", "is given twice", [&good[..], &good[..1]].concat(), push),
            (
                "results",
                "a storage buffer that the kernel writes, and was given to be read only",
                with("results", OwnResource::ReadOnly(output.view())).to_vec(),
                push,
            ),
            (
                "numbers",
                "a storage buffer that the kernel reads, and was given texels",
                with("numbers", (&texels).into()).to_vec(),
                push,
            ),
            (
                "shift",
                "a uniform buffer, and was given texels",
                with("shift", (&texels).into()).to_vec(),
                push,
            ),
            (
                "never",
                "takes at least 32 bytes, and was given 16 of \"never\"",
                with("never", never.slice(0, 16).into()).to_vec(),
                push,
            ),
            (
                "never",
                "cannot be bound",
                with("never", never.slice(0, 64).into()).to_vec(),
                push,
            ),
            (
                "shift",
                "cannot be bound",
                with("shift", input.slice(0, 16).into()).to_vec(),
                push,
            ),
            (
                "results",
                "is written, and lies over what was given as numbers",
                with("results", input.view().into()).to_vec(),
                push,
            ),
            (
                "push constants",
                "are 8 bytes, and 4 were given",
                good.to_vec(),
                &push[..4],
            ),
        ];
        if gpu.caps().storage_buffer_alignment > 4 {
            cases.push((
                "numbers",
                "offset alignment",
                with("numbers", misplaced.into()).to_vec(),
                push,
            ));
        }
        for (name, words, given, push) in cases {
            match try_with(&given, push) {
                Err(Error::Binding { kernel, binding, cause }) => {
                    assert_eq!((kernel.as_str(), binding.as_str()), ("scale", name), "{cause}");
                    assert!(cause.contains(words), "{name}: {cause:?}, not {words:?}");
                }
                other => panic!("{name}, {words}: {other:?}"),
            }
        }
        try_with(&good, push).unwrap();
        if cfg!(debug_assertions) {
            let missed = try_with(&good, push);
            assert!(
                matches!(&missed, Err(Error::MissingBarrier { buffer, .. }) if buffer == "results"),
                "{missed:?}"
            );
        }
        recorder
            .pass("again", |pass| {
                pass.barrier(&[rw_compute_to_compute(&output)]);
                pass.dispatch_own(&kernel, &good, push, [1, 1, 1])?;
                let refused = pass.dispatch_own(&kernel, &good, push, [u32::MAX, 1, 1]);
                assert!(matches!(refused, Err(Error::LimitExceeded { .. })), "{refused:?}");
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        // Both dispatches have run: 0 + 0 + 3 for itself and for its neighbour.
        assert_eq!(gpu.read::<u32>(output.view(), 1).unwrap(), [6]);
    });
}

#[test]
fn a_kernel_in_glsl_goes_by_the_same_rules() {
    with_gpu(|gpu| {
        let source = "#version 460
            layout(local_size_x = 32) in;
            layout(push_constant) uniform Push { uint factor; } push;
            layout(set = 0, binding = 0) uniform utextureBuffer numbers;
            layout(set = 0, binding = 1) writeonly buffer Results { uint results[]; };
            void main() {
                uint i = gl_GlobalInvocationID.x;
                results[i] = push.factor * texelFetch(numbers, int(i)).x;
            }";
        // SAFETY: the kernel has no arrays of its own.
        #[expect(unsafe_code, reason = "GLSL from text")]
        let kernel = unsafe { OwnKernel::glsl(gpu, "texels", source) }.unwrap();
        let numbers = gpu
            .texels_with("numbers", Category::Work, vk::Format::R32_UINT, &[4u32; 32])
            .unwrap();
        let output = gpu.buffer_with("results", Category::Work, &[0u32; 32]).unwrap();
        let mut recorder = gpu.recorder("own").unwrap();
        recorder
            .pass("texels", |pass| {
                let push = 5u32.to_ne_bytes();
                let given = [("numbers", (&numbers).into()), ("results", output.view().into())];
                let swapped = [("numbers", numbers.buffer().view().into()), given[1]];
                let refused = pass.dispatch_own(&kernel, &swapped, &push, [1, 1, 1]);
                assert!(
                    matches!(&refused, Err(Error::Binding { binding, .. }) if binding == "numbers"),
                    "{refused:?}"
                );
                pass.dispatch_own(&kernel, &given, &push, [1, 1, 1])
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(output.view(), 32).unwrap(), [20; 32]);
        let wrong = source.replace("push.factor", "push.missing");
        // SAFETY: as above.
        #[expect(unsafe_code, reason = "GLSL from text")]
        let wrong = unsafe { OwnKernel::glsl(gpu, "wrong", &wrong) };
        assert!(matches!(&wrong, Err(Error::KernelSource { line: 8, .. })), "{wrong:?}");
    });
}
