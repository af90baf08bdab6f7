//! What mutations know of binary files: where lengths and counts stand, which parts are chunks, and which sums guard them.

use std::ops::Range;

use clerestory::fingerprint::Fingerprint;

/// A number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Its first byte; it has four.
    pub at: usize,
    /// Whether its highest byte comes first.
    pub big_endian: bool,
}

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const GLB: &[u8] = b"glTF";
const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
const VOL: &[u8] = b"VOL";
const KD: &[u8] = b"CLKDTREE";
/// Bytes of the fingerprint at the end of a kd-tree's file.
const PRINT: usize = 16;

fn word(bytes: &[u8], at: usize, big_endian: bool) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    Some(if big_endian {
        u32::from_be_bytes(word)
    } else {
        u32::from_le_bytes(word)
    })
}

/// Chunks of PNG and GLB, heads included: as many as are whole.
pub fn chunks(bytes: &[u8]) -> Vec<Range<usize>> {
    // Where the first begins, bytes of a head and of what stands behind the data, and the order of bytes.
    let (mut at, around, big_endian) = if bytes.starts_with(PNG) {
        (PNG.len(), 12, true)
    } else if bytes.starts_with(GLB) {
        (12, 8, false)
    } else {
        return Vec::new();
    };
    let mut chunks = Vec::new();
    while let Some(length) = word(bytes, at, big_endian) {
        let end = at.saturating_add(around).saturating_add(length as usize);
        if end > bytes.len() {
            break;
        }
        chunks.push(at..end);
        at = end;
    }
    chunks
}

/// Lengths, counts and sides in the heads of files that are known; of others none.
pub fn fields(bytes: &[u8]) -> Vec<Field> {
    let little = |at: usize| Field { at, big_endian: false };
    let big = |at: usize| Field { at, big_endian: true };
    let mut fields = Vec::new();
    if bytes.starts_with(PNG) {
        fields.extend([16, 20].map(big));
        fields.extend(chunks(bytes).iter().map(|chunk| big(chunk.start)));
    } else if bytes.starts_with(GLB) {
        fields.extend([4, 8].map(little));
        fields.extend(chunks(bytes).iter().map(|chunk| little(chunk.start)));
    } else if bytes.starts_with(EXR) {
        fields.push(little(4));
        let mut at = 8;
        // An attribute is a name, a type, both ended by 0, the length of its value, and the value.
        while bytes.get(at).is_some_and(|first| *first != 0) {
            let end_of = |at: usize| Some(at + bytes.get(at..)?.iter().position(|byte| *byte == 0)? + 1);
            let Some(length_at) = end_of(at).and_then(end_of) else {
                break;
            };
            let Some(length) = word(bytes, length_at, false) else {
                break;
            };
            let value = length_at + 4;
            fields.push(little(length_at));
            let words = (length as usize).min(64) / 4;
            fields.extend((0..words).map(|i| little(value + 4 * i)));
            at = value.saturating_add(length as usize);
        }
        // The offsets of blocks.
        fields.extend([1, 5, 9].map(|behind| little(at.saturating_add(behind))));
    } else if bytes.starts_with(VOL) {
        fields.extend((4..48).step_by(4).map(little));
    } else if bytes.starts_with(KD) {
        fields.extend([8, 28, 32].map(little));
    }
    fields.retain(|field| field.at.checked_add(4).is_some_and(|end| end <= bytes.len()));
    fields
}

/// Puts a number into a file.
pub fn put(bytes: &mut [u8], field: Field, value: u32) {
    let word = if field.big_endian {
        value.to_be_bytes()
    } else {
        value.to_le_bytes()
    };
    if let Some(place) = bytes.get_mut(field.at..field.at + 4) {
        place.copy_from_slice(&word);
    }
}

/// Makes sums and the length of the whole fit again, where the file has them: a reader that looks at them first then goes on.
pub fn mend(bytes: &mut [u8]) {
    if bytes.starts_with(PNG) {
        for chunk in chunks(bytes) {
            let sum = crc32(&bytes[chunk.start + 4..chunk.end - 4]);
            bytes[chunk.end - 4..chunk.end].copy_from_slice(&sum.to_be_bytes());
        }
    } else if bytes.starts_with(GLB) && bytes.len() >= 12 {
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
    } else if bytes.starts_with(KD) && bytes.len() > PRINT {
        let (body, ending) = bytes.split_at_mut(bytes.len() - PRINT);
        let mut print = Fingerprint::default();
        print.add(body);
        ending.copy_from_slice(&print.bytes());
    }
}

/// The sum of PNG's chunks: "PNG Specification", third edition, W3C 2025, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0xedb8_8320;
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            if sum & 1 == 1 {
                (sum >> 1) ^ POLYNOMIAL
            } else {
                sum >> 1
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_the_published_ones() {
        // The check value of this sum in all lists of such, and the end chunk that closes every PNG.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b"IEND"), 0xae42_6082);
    }

    #[test]
    fn png_has_its_chunks_fields_and_sums() {
        let mut bytes = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        image::ImageEncoder::write_image(encoder, &[1, 2, 3], 1, 1, image::ExtendedColorType::Rgb8).unwrap();
        let chunks = chunks(&bytes);
        assert!(chunks.len() >= 3 && chunks.last().unwrap().end == bytes.len());
        assert!(fields(&bytes).contains(&Field {
            at: 16,
            big_endian: true
        }));
        let sound = bytes.clone();
        mend(&mut bytes);
        assert_eq!(bytes, sound, "the encoder's sums are these");
        let wide = fields(&bytes)[0];
        put(&mut bytes, wide, 2);
        assert!(
            image::load_from_memory(&bytes)
                .unwrap_err()
                .to_string()
                .to_lowercase()
                .contains("crc")
        );
        mend(&mut bytes);
        let error = image::load_from_memory(&bytes)
            .map(|_| ())
            .map_err(|error| error.to_string());
        assert!(error.is_ok() || !error.unwrap_err().to_lowercase().contains("crc"));
    }

    #[test]
    fn exr_has_its_windows_and_lengths() {
        let picture = clerestory::film::Picture::from_radiance(2, 1, vec![0.5; 6]).unwrap();
        let bytes = clerestory::film::exr::to_bytes(&picture, "a").unwrap();
        let values: Vec<u32> = fields(&bytes)
            .iter()
            .map(|field| word(&bytes, field.at, field.big_endian).unwrap())
            .collect();
        // The data window ends at pixel 1.
        assert!(values.contains(&1) && values.contains(&16), "{values:?}");
    }

    #[test]
    fn cut_files_have_no_fields_beyond_their_end() {
        for head in [PNG, GLB, EXR, VOL, KD] {
            for length in 0..64 {
                let mut bytes = head.to_vec();
                bytes.resize(head.len() + length, 0xff);
                assert!(fields(&bytes).iter().all(|field| field.at + 4 <= bytes.len()));
                mend(&mut bytes);
                assert_eq!(bytes.len(), head.len() + length);
            }
        }
    }
}
