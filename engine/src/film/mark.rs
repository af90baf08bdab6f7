//! The mark by which the pictures of this engine are known again, so that nobody else's are overwritten in silence.
//!
//! It is the name of the engine where each format keeps the name of the program that wrote the file: the attribute `software` of OpenEXR, the text
//! chunk `Software` of PNG, the line `SOFTWARE=` of Radiance HDR. Programs that change a picture put their own name there, or none.

use std::io::Read;
use std::path::Path;

use crate::input::open_regular;
use crate::{Error, Result};

/// What files say of the program that wrote them.
pub const SOFTWARE: &str = concat!("Clerestory ", env!("CARGO_PKG_VERSION"));

/// What the mark of every version begins with.
const NAME: &[u8] = b"Clerestory ";

/// Bytes of a file's beginning among which the mark must stand.
const HEAD: u64 = 1 << 20;

/// Whether a picture bears the mark. A file that is no EXR, PNG or Radiance HDR picture, or a damaged one, bears none.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read or is not a regular one.
pub fn is_marked(path: &Path) -> Result<bool> {
    let mut head = Vec::new();
    // Its length does not matter: the mark stands at its beginning.
    let read = open_regular(path, u64::MAX).and_then(|(file, _)| file.take(HEAD).read_to_end(&mut head));
    read.map_err(|cause| Error::io(path, cause))?;
    Ok(says_so(&head))
}

fn says_so(head: &[u8]) -> bool {
    let software = match head {
        [0x76, 0x2f, 0x31, 0x01, ..] => of_exr(head),
        [0x89, b'P', b'N', b'G', ..] => of_png(head),
        [b'#', b'?', ..] => of_hdr(head),
        _ => None,
    };
    software.is_some_and(|software| software.starts_with(NAME))
}

/// The attribute of a file's first header (OpenEXR file layout, "header").
fn of_exr(head: &[u8]) -> Option<&[u8]> {
    const MAGIC_AND_VERSION: usize = 8;
    let mut rest = head.get(MAGIC_AND_VERSION..)?;
    loop {
        let name = terminated(&mut rest)?;
        if name.is_empty() {
            return None;
        }
        terminated(&mut rest)?;
        let (size, after) = rest.split_first_chunk::<4>()?;
        let (value, after) = after.split_at_checked(u32::from_le_bytes(*size) as usize)?;
        if name == b"software" {
            return Some(value);
        }
        rest = after;
    }
}

/// The bytes before the next zero, which are taken away with it.
fn terminated<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = rest.iter().position(|byte| *byte == 0)?;
    let (text, after) = rest.split_at_checked(end)?;
    *rest = after.get(1..)?;
    Some(text)
}

/// The text of the chunk among those before the pixels.
fn of_png(head: &[u8]) -> Option<&[u8]> {
    const SIGNATURE: usize = 8;
    const CHECK: usize = 4;
    let mut rest = head.get(SIGNATURE..)?;
    loop {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (kind, after) = after.split_first_chunk::<4>()?;
        let (content, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        match kind {
            b"tEXt" if content.starts_with(b"Software\0") => return content.get(b"Software\0".len()..),
            b"IDAT" => return None,
            _ => rest = after.get(CHECK..)?,
        }
    }
}

/// The value of the line in the header, which ends with an empty line.
fn of_hdr(head: &[u8]) -> Option<&[u8]> {
    head.split(|byte| *byte == b'\n')
        .take_while(|line| !line.is_empty())
        .find_map(|line| line.strip_prefix(b"SOFTWARE="))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::png::Rgb8;
    use crate::film::{Picture, exr, hdr, png};

    fn files() -> Result<[Vec<u8>; 3]> {
        let mut picture = Picture::from_radiance(3, 2, vec![0.5; 18])?;
        // Attributes before and after the mark in the order of names.
        picture.metadata.other.insert("author".into(), "a".repeat(300));
        picture.metadata.other.insert("title".into(), "t".into());
        let shown = Rgb8 {
            width: 3,
            height: 2,
            bytes: vec![128; 18],
        };
        Ok([
            exr::to_bytes(&picture, "a.exr")?,
            png::to_bytes(&shown, "a.png")?,
            hdr::to_bytes(&picture, "a.hdr")?,
        ])
    }

    #[test]
    fn every_format_bears_the_mark() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|e| Error::io("temporary folder", e))?;
        for bytes in files()? {
            assert!(says_so(&bytes));
            // A file that is cut in its header bears none, and is no fault.
            for end in 0..31 {
                assert!(!says_so(&bytes[..end]), "{end}");
            }
            let path = folder.path().join("file");
            std::fs::write(&path, &bytes).map_err(|e| Error::io(&path, e))?;
            assert!(is_marked(&path)?);
        }
        for wrong in [folder.path().join("absent"), folder.path().to_owned()] {
            assert!(
                matches!(is_marked(&wrong), Err(Error::Io { .. })),
                "{}",
                wrong.display()
            );
        }
        Ok(())
    }

    #[test]
    fn files_of_others_do_not() -> Result<()> {
        for mut bytes in files()? {
            let at = bytes.windows(NAME.len()).position(|part| part == NAME);
            let at = at.expect("the name stands in the file");
            bytes[at] = b'X';
            assert!(!says_so(&bytes));
        }
        for other in [
            &b""[..],
            b"{}",
            b"Clerestory 1.0",
            b"#?RADIANCE\n\nSOFTWARE=Clerestory 1\n",
        ] {
            assert!(!says_so(other), "{other:?}");
        }
        // The crate's own encoder names nobody.
        let mut plain = std::io::Cursor::new(Vec::new());
        let written = image::RgbImage::new(2, 2).write_to(&mut plain, image::ImageFormat::Png);
        assert!(written.is_ok() && !says_so(plain.get_ref()));
        Ok(())
    }
}
