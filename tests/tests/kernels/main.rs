//! The kernels of floor 2 against their twins and against the standard library, in every form, under the validation layers.

mod blocks;
mod device_model;
mod many_sorts;
mod sort;

use clerestory::gpu::{Buffer, BufferDesc, Category, Gpu, Pass};
use clerestory::kernels::Form;
use clerestory_tests::random::Random;

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
