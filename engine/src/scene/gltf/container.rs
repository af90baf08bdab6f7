//! The outside of a glTF file: the GLB chunks ("glTF 2.0 Specification", §4) and the JSON.

use ::gltf::json::Root;
use serde_json::Value;

use crate::{Error, Result};

/// The JSON and the binary chunk.
pub struct Container {
    pub root: Root,
    pub blob: Option<Vec<u8>>,
}

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const VERSION: u32 = 2;

/// Takes a file apart; `source` names it in errors.
pub fn open(bytes: &[u8], source: &str) -> Result<Container> {
    let (json, blob) = if bytes.starts_with(MAGIC) {
        split_glb(bytes).map_err(|(at, cause)| Error::scene(source, at, cause))?
    } else {
        // A byte order mark is not allowed, but common.
        (bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), None)
    };
    if !json.trim_ascii_start().starts_with(b"{") {
        return Err(Error::scene(
            source,
            "first bytes",
            "neither GLB (no magic `glTF`) nor JSON (no object)",
        ));
    }
    let bad_json = |error: serde_json::Error| {
        let place = format!("line {} column {}", error.line(), error.column());
        let text = error.to_string();
        let cause = text.strip_suffix(&place).and_then(|text| text.strip_suffix(" at "));
        Error::scene(source, format!("JSON {place}"), cause.unwrap_or(&text))
    };
    let mut value: Value = serde_json::from_slice(json).map_err(bad_json)?;
    check_version(&value, source)?;
    // A scene without nodes is allowed, but the crate's type wants the field.
    let mut completed = false;
    if let Some(scenes) = value.get_mut("scenes").and_then(Value::as_array_mut) {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            completed |= !scene.contains_key("nodes");
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    let root = if completed {
        Root::from_slice(&serde_json::to_vec(&value).map_err(bad_json)?)
    } else {
        Root::from_slice(json)
    };
    let root = root.map_err(bad_json)?;
    Ok(Container {
        root,
        blob: blob.map(<[u8]>::to_vec),
    })
}

fn check_version(value: &Value, source: &str) -> Result<()> {
    let asset = value.get("asset");
    let text = |key: &str| asset.and_then(|a| a.get(key)).and_then(Value::as_str);
    let major = |version: &str| version.split('.').next().and_then(|major| major.parse::<u32>().ok());
    match (text("minVersion").or(text("version")), text("version")) {
        (Some(least), Some(_)) if major(least) == Some(VERSION) => Ok(()),
        (Some(least), Some(_)) => Err(Error::scene(
            source,
            "asset.version",
            format!("{least} is not supported; supported: 2.0"),
        )),
        _ => Err(Error::scene(
            source,
            "asset.version",
            "is missing; this is not a glTF 2.0 file",
        )),
    }
}

type Parts<'a> = (&'a [u8], Option<&'a [u8]>);

fn split_glb(bytes: &[u8]) -> Result<Parts<'_>, (String, String)> {
    let fail = |at: &str, cause: String| Err((at.to_string(), cause));
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return fail("GLB header", format!("needs {HEADER_BYTES} bytes, has {}", bytes.len()));
    };
    if version != VERSION {
        return fail(
            "GLB header",
            format!("version {version} is not supported; supported: 2"),
        );
    }
    let Some(bytes) = bytes.get(..length as usize).filter(|b| b.len() >= HEADER_BYTES) else {
        return fail(
            "GLB header",
            format!("promises {length} bytes, the file has {}", bytes.len()),
        );
    };
    let mut json = None;
    let mut blob = None;
    let mut offset = HEADER_BYTES;
    let mut index = 0;
    while offset < bytes.len() {
        let at = format!("GLB chunk {index}");
        let (Some(length), Some(kind)) = (word(bytes, offset), bytes.get(offset + 4..offset + CHUNK_HEADER_BYTES))
        else {
            return fail(&at, "its header is cut off".into());
        };
        let start = offset + CHUNK_HEADER_BYTES;
        let Some(data) = start.checked_add(length as usize).and_then(|end| bytes.get(start..end)) else {
            return fail(
                &at,
                format!("promises {length} bytes, {} are left", bytes.len() - start),
            );
        };
        match (index, kind) {
            (0, b"JSON") => json = Some(data),
            (0, _) => return fail(&at, "is not the JSON chunk".into()),
            (1, b"BIN\0") => blob = Some(data),
            // Later chunks are extensions, to be skipped.
            _ => {}
        }
        offset = start + data.len().next_multiple_of(4);
        index += 1;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => fail("GLB", "has no JSON chunk".into()),
    }
}

fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let bytes = bytes.get(offset..offset.checked_add(4)?)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}
