//! Mutations: one to eight of them damage a case, fewer more often.

use std::ops::Range;

use super::case::{Case, File, Stream};
use super::layout;

/// Longest file that a mutation makes, bytes.
pub const LONGEST: usize = 1 << 16;
/// Longest part that a mutation moves, bytes.
const PART: usize = 256;
/// Most mutations of a case.
const MOST: usize = 8;

/// Numbers that stand at edges of types, of limits and of sense. Few lie between 100 and 512, so that grids that the engine makes itself are
/// seldom large ones, which take it seconds.
const NUMBERS: [&str; 30] = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "4",
    "7",
    "16",
    "64",
    "-0.0",
    "0.5",
    "1.5",
    "255",
    "256",
    "32767",
    "65535",
    "65536",
    "2147483647",
    "-2147483648",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e-30",
    "1e30",
    "3.4e38",
    "1e39",
    "1e308",
    "1e999",
    "nan",
];

/// Words that are there to be put at numbers' places.
const WORDS: [&str; 24] = [
    "null",
    "true",
    "\"\"",
    "[]",
    "{}",
    "[",
    "{",
    "[[[[[[[[[[[[[[[[",
    "]",
    "}",
    "\"",
    "\\u0000",
    "\n",
    "\r",
    "\0",
    "#",
    "=",
    ",",
    ":",
    "..",
    "/",
    "%00",
    "inf",
    "\u{FEFF}",
];

/// Words of 32 bits at edges.
const BITS: [u32; 19] = [
    0,
    1,
    2,
    3,
    4,
    8,
    255,
    256,
    65_535,
    65_536,
    1 << 24,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    // Infinities, a NaN and the largest number of f32.
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0x7f7f_ffff,
];

/// What a mutation is given beside the bytes.
struct Given<'a> {
    /// All seeds of the reader.
    seeds: &'a [Case],
    /// Words of the reader's formats.
    words: &'a [&'a str],
}

type Mutation = fn(&mut File, &mut Stream, &Given<'_>);

/// What is done to bytes of any kind.
const OF_ANY: [Mutation; 8] = [flip, set, cut_out, repeat, put_word, splice, truncate, exchange];
/// What is done to text.
const OF_TEXT: [Mutation; 7] = [number, number, number, digit, lines, put_word, exchange_numbers];
/// What is done to binary files.
const OF_BINARY: [Mutation; 5] = [field, field, any_field, exchange_chunks, flip];

/// The case of that number: a seed, damaged.
pub fn mutated(seeds: &[Case], words: &[&str], mut stream: Stream) -> Case {
    let Some(seed) = stream.pick(seeds) else {
        return Case::default();
    };
    let mut case = seed.clone();
    let given = Given { seeds, words };
    let free: Vec<usize> = (0..case.files.len()).filter(|file| !case.files[*file].fixed).collect();
    let times = 1 + stream.below(MOST).min(stream.below(MOST));
    for _ in 0..times {
        // The first file has half of the damage.
        let place = if stream.once_in(2) { 0 } else { stream.below(free.len()) };
        let Some(file) = free.get(place).and_then(|file| case.files.get_mut(*file)) else {
            break;
        };
        mutate(file, &mut stream, &given);
    }
    if stream.once_in(2) {
        for file in &free {
            layout::mend(&mut case.files[*file].bytes);
        }
    }
    case
}

fn mutate(file: &mut File, stream: &mut Stream, given: &Given<'_>) {
    let special: &[Mutation] = if is_text(&file.bytes) { &OF_TEXT } else { &OF_BINARY };
    let all = if stream.once_in(3) { &OF_ANY[..] } else { special };
    if let Some(mutation) = stream.pick(all) {
        mutation(file, stream, given);
    }
    file.bytes.truncate(LONGEST);
}

fn is_text(bytes: &[u8]) -> bool {
    !bytes.contains(&0) && std::str::from_utf8(bytes).is_ok()
}

fn flip(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let at = stream.below(bytes.len());
    let bit = stream.below(8);
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << bit;
    }
}

fn set(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let at = stream.below(bytes.len());
    let value = if stream.once_in(2) {
        stream.word() as u8
    } else {
        [0, 1, 0x7f, 0x80, 0xfe, 0xff][stream.below(6)]
    };
    if let Some(byte) = bytes.get_mut(at) {
        *byte = value;
    }
}

fn cut_out(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let part = stream.part(bytes.len(), PART);
    bytes.drain(part);
}

fn repeat(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let part = bytes[stream.part(bytes.len(), PART)].to_vec();
    let at = stream.below(bytes.len() + 1);
    let times = 1 + if stream.once_in(4) { stream.below(64) } else { 0 };
    bytes.splice(at..at, part.repeat(times));
}

fn put_word(file: &mut File, stream: &mut Stream, given: &Given<'_>) {
    let bytes = &mut file.bytes;
    let own = !given.words.is_empty() && !stream.once_in(3);
    let Some(word) = stream.pick(if own { given.words } else { &WORDS[..] }) else {
        return;
    };
    let at = stream.below(bytes.len() + 1);
    let over = if stream.once_in(2) { word.len() } else { 0 };
    let end = (at + over).min(bytes.len());
    bytes.splice(at..end, word.bytes());
}

/// The beginning of this file and the end of another.
fn splice(file: &mut File, stream: &mut Stream, given: &Given<'_>) {
    let bytes = &mut file.bytes;
    let Some(other) = stream.pick(given.seeds).and_then(|case| stream.pick(&case.files)) else {
        return;
    };
    let (kept, from) = (stream.below(bytes.len() + 1), stream.below(other.bytes.len() + 1));
    bytes.truncate(kept);
    bytes.extend(&other.bytes[from..]);
}

fn truncate(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    bytes.truncate(stream.below(bytes.len() + 1));
}

/// Two parts change places.
fn exchange(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let parts = [stream.part(bytes.len(), PART), stream.part(bytes.len(), PART)];
    exchange_parts(bytes, parts);
}

/// Changes the places of two parts that do not overlap; leaves those alone that do.
fn exchange_parts(bytes: &mut Vec<u8>, [a, b]: [Range<usize>; 2]) {
    let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
    if first.end > second.start {
        return;
    }
    let [early, late] = [&first, &second].map(|part| bytes[part.clone()].to_vec());
    bytes.splice(second, early);
    bytes.splice(first, late);
}

/// Where numbers stand in text.
fn numbers(bytes: &[u8]) -> Vec<Range<usize>> {
    let part_of = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+' | b'e' | b'E');
    let mut all = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = at + bytes[at..].iter().take_while(|byte| part_of(**byte)).count();
        if bytes[at..end].iter().any(u8::is_ascii_digit) {
            all.push(at..end);
        }
        at = end + 1;
    }
    all
}

fn number(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let all = numbers(bytes);
    let (Some(place), Some(value)) = (stream.pick(&all), stream.pick(&NUMBERS)) else {
        return;
    };
    let value = if stream.once_in(8) {
        stream.pick(&WORDS).unwrap_or(value)
    } else {
        value
    };
    bytes.splice(place.clone(), value.bytes());
}

fn digit(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let places: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at].is_ascii_digit()).collect();
    if let Some(at) = stream.pick(&places) {
        bytes[*at] = b'0' + stream.below(10) as u8;
    }
}

fn exchange_numbers(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let all = numbers(bytes);
    if let (Some(a), Some(b)) = (stream.pick(&all), stream.pick(&all)) {
        exchange_parts(bytes, [a.clone(), b.clone()]);
    }
}

/// A line goes away, comes twice, or changes places with another.
fn lines(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let mut all = Vec::new();
    let mut start = 0;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        all.push(start..start + line.len());
        start += line.len();
    }
    let (Some(a), Some(b)) = (stream.pick(&all), stream.pick(&all)) else {
        return;
    };
    match stream.below(3) {
        0 => drop(bytes.drain(a.clone())),
        1 => {
            let line = bytes[a.clone()].to_vec();
            bytes.splice(b.start..b.start, line);
        }
        _ => exchange_parts(bytes, [a.clone(), b.clone()]),
    }
}

/// A length or a count of the file's head.
fn field(file: &mut File, stream: &mut Stream, given: &Given<'_>) {
    let bytes = &mut file.bytes;
    let all = layout::fields(bytes);
    match stream.pick(&all) {
        Some(field) => {
            let value = edge(bytes.len(), stream);
            layout::put(bytes, *field, value);
        }
        None => any_field(file, stream, given),
    }
}

/// Any four bytes, half of the time of the first 64.
fn any_field(file: &mut File, stream: &mut Stream, _: &Given<'_>) {
    let bytes = &mut file.bytes;
    let end = if stream.once_in(2) {
        bytes.len().min(64)
    } else {
        bytes.len()
    };
    let field = layout::Field {
        at: stream.below(end),
        big_endian: stream.once_in(2),
    };
    let value = edge(bytes.len(), stream);
    layout::put(bytes, field, value);
}

/// A word at an edge, or near the length of the file.
fn edge(length: usize, stream: &mut Stream) -> u32 {
    match stream.below(4) {
        0 => (length as u32).wrapping_add(stream.below(9) as u32).wrapping_sub(4),
        1 => stream.below(length.max(1)) as u32,
        _ => BITS[stream.below(BITS.len())],
    }
}

/// Two chunks change places, one of them goes away, or comes twice.
fn exchange_chunks(file: &mut File, stream: &mut Stream, given: &Given<'_>) {
    let bytes = &mut file.bytes;
    let all = layout::chunks(bytes);
    let (Some(a), Some(b)) = (stream.pick(&all), stream.pick(&all)) else {
        return exchange(file, stream, given);
    };
    match stream.below(3) {
        0 => drop(bytes.drain(a.clone())),
        1 => {
            let chunk = bytes[a.clone()].to_vec();
            bytes.splice(b.start..b.start, chunk);
        }
        _ => exchange_parts(bytes, [a.clone(), b.clone()]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given() -> Given<'static> {
        Given { seeds: &[], words: &[] }
    }

    #[test]
    fn the_same_number_gives_the_same_case_and_others_give_others() {
        let seeds = [
            Case::of("main.ply", "ply\nelement vertex 3\n0 1 2\n").with_fixed("fixed", [0_u8, 1, 2]),
            Case::of("main.bin", [0u8; 80]),
        ];
        let case = |number| mutated(&seeds, &["element"], Stream::new(9, "PLY", number));
        let mut changed = 0;
        for number in 0..500 {
            assert_eq!(case(number), case(number));
            let case = case(number);
            let seed = seeds.iter().find(|seed| seed.name() == case.name()).unwrap();
            changed += usize::from(case != *seed);
            assert!(
                case.files
                    .iter()
                    .filter(|file| file.fixed)
                    .all(|file| file.bytes == [0, 1, 2])
            );
            assert!(case.files.iter().all(|file| file.bytes.len() <= LONGEST));
        }
        // Some mutations put back what stands there.
        assert!(changed > 400, "{changed}");
    }

    #[test]
    fn every_mutation_takes_anything() {
        let mut png = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut png);
        image::ImageEncoder::write_image(encoder, &[7; 12], 2, 2, image::ExtendedColorType::Rgb8).unwrap();
        for bytes in [Vec::new(), b"1".to_vec(), b"a 1.5 -2\nb 3\n".to_vec(), vec![0; 3], png] {
            for mutation in OF_ANY.iter().chain(&OF_TEXT).chain(&OF_BINARY) {
                for number in 0..200 {
                    let mut case = Case::of("main", bytes.clone());
                    mutation(&mut case.files[0], &mut Stream::new(0, "any", number), &given());
                }
            }
        }
    }

    #[test]
    fn numbers_and_parts_are_found() {
        assert_eq!(numbers(b"v 1 -2.5e3,x9"), [2..3, 4..10, 12..13]);
        let mut bytes = b"abcdef".to_vec();
        exchange_parts(&mut bytes, [4..6, 0..1]);
        assert_eq!(bytes, b"efbcda");
        exchange_parts(&mut bytes, [0..3, 2..4]);
        assert_eq!(bytes, b"efbcda");
    }
}
