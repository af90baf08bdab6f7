//! Carries the constants of the shaders' include files (`const uint NAME = VALUE;`, likewise `int` and `float`) to Rust as `u32`, `i32`
//! and `f32`, so that no flag, size, bound or code is written down twice.
//!
//! A value may be an expression of literals and earlier constants of its type: Rust reads it as GLSL does once the suffixes are gone.
//! Names are unique, as they must be where includes meet.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The module `constants` of `shaders.rs`.
pub fn generate(root: &Path) -> Result<String, String> {
    let mut files = Vec::new();
    find(root, &mut files)?;
    files.sort();
    let mut from: BTreeMap<String, String> = BTreeMap::new();
    let mut text = String::from("/// Constants of the include files.\npub mod constants {\n");
    for file in &files {
        let place = file.strip_prefix(root).unwrap_or(file);
        let place = place.display().to_string();
        let source = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        for (kind, name, value, comment) in source.lines().filter_map(constant) {
            if let Some(other) = from.insert(name.to_owned(), place.clone()) {
                return Err(format!("constant {name} of {place} is also in {other}"));
            }
            let remark = if comment.is_empty() {
                String::new()
            } else {
                format!(": {comment}")
            };
            let _ = writeln!(
                text,
                "    /// In `{place}`{remark}.\n    pub const {name}: {kind} = {};",
                match kind {
                    "f32" => float(name, value),
                    _ => unsuffixed(value),
                }
            );
        }
    }
    text += "}\n";
    Ok(text)
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for entry in entries {
        let path = entry.map_err(|error| error.to_string())?.path();
        if path.is_dir() {
            find(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "glsl") {
            files.push(path);
        }
    }
    Ok(())
}

/// Rust type, name, value and comment of a line that defines a constant.
fn constant(line: &str) -> Option<(&'static str, &str, &str, &str)> {
    const KINDS: [(&str, &str); 3] = [("const uint ", "u32"), ("const int ", "i32"), ("const float ", "f32")];
    let (kind, definition) = KINDS
        .iter()
        .find_map(|(prefix, kind)| Some((*kind, line.strip_prefix(prefix)?)))?;
    let (name, rest) = definition.split_once('=')?;
    let (value, rest) = rest.split_once(';')?;
    let comment = rest.trim().trim_start_matches('/').trim().trim_end_matches('.');
    Some((kind, name.trim(), value.trim(), comment))
}

/// The expression with its literals as short as f32 tells them apart; Rust's own constants where it has them.
fn float(name: &str, value: &str) -> String {
    const RUSTS_OWN: [(&str, &str); 2] = [
        ("PI", "std::f32::consts::PI"),
        ("INV_PI", "std::f32::consts::FRAC_1_PI"),
    ];
    if let Some((_, own)) = RUSTS_OWN.iter().find(|(known, _)| *known == name) {
        return (*own).to_owned();
    }
    let words = value.split_whitespace();
    words
        .map(|word| {
            word.parse::<f32>()
                .map_or_else(|_| word.to_owned(), |number| format!("{number:?}"))
        })
        .collect::<Vec<_>>()
        .join(" ")
}

/// The expression without the `u` of its literals.
fn unsuffixed(value: &str) -> String {
    let characters: Vec<char> = value.chars().collect();
    let mut in_number = false;
    let mut text = String::new();
    for (at, &c) in characters.iter().enumerate() {
        let in_word = at > 0 && (characters[at - 1].is_alphanumeric() || characters[at - 1] == '_');
        in_number = if in_word { in_number } else { c.is_ascii_digit() };
        if !(in_number && matches!(c, 'u' | 'U')) {
            text.push(c);
        }
    }
    text
}
