//! URIs of buffers and images: `data:` (RFC 2397, base64) and relative file references (percent-encoded).

use std::path::Path;
use std::sync::Arc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::input::InputFiles;
use crate::{Error, Result};

/// Padding is often missing in the wild.
const LENIENT: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads what a URI refers to; `at` is its place in the JSON. What one file holds is there once, however many URIs refer to it.
pub fn read(uri: &str, folder: &Path, files: &InputFiles<'_>, source: &str, at: &str) -> Result<Arc<Vec<u8>>> {
    let fail = |cause: String| Err(Error::scene(source, at, cause));
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((head, body)) = data.split_once(',') else {
            return fail("data URI without a comma".into());
        };
        return if head.ends_with(";base64") {
            let decoded = LENIENT.decode(body).map(Arc::new);
            decoded.or_else(|error| fail(format!("base64: {error}")))
        } else {
            Ok(Arc::new(percent_encoding::percent_decode_str(body).collect()))
        };
    }
    if uri
        .split_once(':')
        .is_some_and(|(scheme, _)| scheme.len() > 1 && !scheme.contains('/'))
    {
        return fail(format!(
            "{:?} is not a data URI or a relative reference",
            shortened(uri)
        ));
    }
    let Ok(decoded) = percent_encoding::percent_decode_str(uri).decode_utf8() else {
        return fail("is not UTF-8 after percent-decoding".into());
    };
    let path = folder.join(decoded.as_ref());
    files
        .read(&path)
        .or_else(|error| fail(format!("cannot read {}: {error}", path.display())))
}

fn shortened(text: &str) -> String {
    const SHOWN: usize = 60;
    text.chars().take(SHOWN).collect()
}
