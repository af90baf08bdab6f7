//! Lists the experiments of `experiments/`, so that the program carries them with it.

use std::fmt::Write as _;
use std::path::Path;

fn main() -> std::io::Result<()> {
    println!("cargo::rerun-if-changed=experiments");
    let mut files = Vec::new();
    for entry in std::fs::read_dir("experiments")? {
        let path = entry?.path().canonicalize()?;
        if let (Some(name), Some("toml")) = (path.file_stem(), path.extension().and_then(|e| e.to_str())) {
            files.push((name.to_string_lossy().into_owned(), path.clone()));
        }
    }
    files.sort();
    let mut text = String::from("&[\n");
    for (name, path) in files {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "    ({name:?}, include_str!({path:?})),");
    }
    text.push_str("]\n");
    let out = std::env::var_os("OUT_DIR").unwrap_or_default();
    std::fs::write(Path::new(&out).join("experiments.rs"), text)
}
