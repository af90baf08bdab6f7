//! The kernels of floor 2 against their twins and against the standard library, in every form, under the validation layers.

mod blocks;
mod device_model;
mod many_sorts;
mod sort;

use clerestory::Error;
use clerestory::gpu::{
    Buffer, BufferDesc, Caps, Category, DeviceKind, Gpu, GpuOptions, Lesser, OptionalFeatures, Pass, SubgroupOperations,
};
use clerestory::kernels::{Form, KeyWidth, RadixSort, RadixSortOptions};
use clerestory_tests::random::Random;
use clerestory_tests::{assert_no_messages, gpu_with};

/// All forms that teams can have.
const FORMS: [Form; 3] = [Form::Serial, Form::Shared, Form::Subgroup];

/// Numbers of elements about which something changes: none, groups and tiles of any form, subgroups, several blocks.
const SIZES: [u32; 22] = [
    0, 1, 2, 3, 4, 5, 7, 8, 9, 31, 32, 33, 63, 64, 65, 255, 256, 257, 1023, 1025, 4097, 100_003,
];

/// What keys and values look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pattern {
    Random,
    AllEqual,
    Sorted,
    Reversed,
    FewBits,
    /// Bit patterns of floats: numbers of either sign, infinities, zeros, subnormals and NaNs.
    Floats,
}

const PATTERNS: [Pattern; 6] = [
    Pattern::Random,
    Pattern::AllEqual,
    Pattern::Sorted,
    Pattern::Reversed,
    Pattern::FewBits,
    Pattern::Floats,
];

impl Pattern {
    fn words(self, random: &mut Random, count: u32) -> Vec<u32> {
        let constant = random.word();
        let mask = 1 << random.below(32) | 1 << random.below(32);
        (0..count)
            .map(|i| match self {
                Self::Random => random.word(),
                Self::AllEqual => constant,
                Self::Sorted => i * 3,
                Self::Reversed => u32::MAX - i * 3,
                Self::FewBits => random.word() & mask,
                Self::Floats => {
                    let sign = random.word() & 0x8000_0000;
                    let tail = random.word() & 0x007F_FFFF;
                    sign | random.choose(&[
                        0,
                        1,
                        tail,
                        0x7F80_0000,
                        0x7FC0_0000,
                        0x7F80_0000 | tail,
                        0x3F80_0000 ^ tail,
                    ])
                }
            })
            .collect()
    }
}

/// A storage buffer with contents.
fn words(gpu: &Gpu, name: &str, data: &[u32]) -> Buffer {
    gpu.buffer_with(name, Category::Work, data).expect("buffer")
}

/// A storage buffer of so many bytes.
fn empty(gpu: &Gpu, name: &str, bytes: u64) -> Buffer {
    gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        .expect("buffer")
}

fn read(gpu: &Gpu, buffer: &Buffer, count: usize) -> Vec<u32> {
    gpu.read(buffer.view(), count).expect("read")
}

/// Records one pass, submits it and waits.
fn run(gpu: &Gpu, record: impl FnOnce(&mut Pass<'_>) -> clerestory::Result<()>) {
    let mut recorder = gpu.recorder("kernels").expect("recorder");
    recorder.pass("kernel", record).expect("recorded");
    recorder.submit().and_then(|submission| submission.wait()).expect("ran");
}

#[test]
fn the_subgroup_form_wants_full_subgroups_that_are_not_too_small() {
    let options = GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    };
    let gpu = gpu_with(&options);
    assert!(!gpu.caps().full_subgroups);
    let sort = |form| {
        let options = RadixSortOptions {
            form,
            ..RadixSortOptions::new(KeyWidth::Bits32, true)
        };
        RadixSort::new(&gpu, options)
    };
    assert!(matches!(sort(Form::Subgroup), Err(Error::MissingFeature { .. })));
    assert!(sort(Form::Auto).is_ok() && sort(Form::Shared).is_ok());
    let operations = SubgroupOperations {
        basic: true,
        vote: true,
        arithmetic: true,
        ballot: true,
        shuffle: true,
    };
    for (size, least, full, expected) in [
        (32, 32, true, Form::Subgroup),
        (32, 8, true, Form::Subgroup),
        (4, 4, true, Form::Subgroup),
        (32, 32, false, Form::Shared),
        (32, 4, true, Form::Shared),
        (32, 0, true, Form::Shared),
        (2, 2, true, Form::Shared),
    ] {
        let caps = Caps {
            kind: DeviceKind::Discrete,
            subgroup: operations,
            subgroup_size: size,
            min_subgroup_size: least,
            full_subgroups: full,
            ..gpu.caps().clone()
        };
        assert_eq!(Form::Auto.on(&caps, "test").unwrap(), expected, "{size} {least} {full}");
        assert_eq!(Form::Subgroup.on(&caps, "test").is_ok(), expected == Form::Subgroup);
    }
    assert_no_messages(&gpu);
}
