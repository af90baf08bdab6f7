//! Drives `glslc` over every entry file, in parallel, and only over what changed.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Vulkan 1.1 is the environment whose SPIR-V is 1.3: the newest version that every tool here reads.
const COMMON_FLAGS: [&str; 3] = ["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3"];

/// Unoptimized, so that unused bindings and all names stay. Names are kept without `-g`, which would add the sources, cut in the middle of
/// multi-byte characters.
const REFLECTED_FLAGS: [&str; 1] = ["-O0"];

/// File extensions of entry files; everything else under `shaders/` is included by them.
const STAGES: [&str; 4] = ["comp", "vert", "frag", "geom"];

/// One compiled entry file.
pub struct Shader {
    /// Path below `shaders/`, with forward slashes: `accel/trace_closest.comp`.
    pub name: String,
    /// First comment block of the file, one string a line.
    pub head: Vec<String>,
    /// The module that goes into the library.
    pub embedded: PathBuf,
    /// The same module unoptimized with all names, for reflection.
    pub reflected: PathBuf,
    /// The entry file and everything it includes.
    pub sources: Vec<PathBuf>,
}

/// Compiles every entry file below `root` into `out`.
pub fn compile_all(root: &Path, out: &Path, debug_info: bool) -> Result<Vec<Shader>, String> {
    let mut files = Vec::new();
    find(root, &mut files)?;
    files.sort();
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let result = compile(root, file, out, debug_info);
                    results.lock().expect("no worker panics").push(result);
                }
            });
        }
    });
    let mut shaders = results
        .into_inner()
        .expect("no worker panics")
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    shaders.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(shaders)
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for entry in entries {
        let path = entry.map_err(|error| error.to_string())?.path();
        if path.is_dir() {
            find(&path, files)?;
        } else if path
            .extension()
            .and_then(|e| e.to_str())
            .is_some_and(|e| STAGES.contains(&e))
        {
            files.push(path);
        }
    }
    Ok(())
}

fn compile(root: &Path, file: &Path, out: &Path, debug_info: bool) -> Result<Shader, String> {
    let name = file
        .strip_prefix(root)
        .map_err(|e| e.to_string())?
        .to_string_lossy()
        .replace('\\', "/");
    let flat = name.replace('/', "__");
    let embedded = out.join(format!("{flat}.spv"));
    let reflected = out.join(format!("{flat}.reflect.spv"));
    let depfile = out.join(format!("{flat}.d"));
    let stamp = out.join(format!("{flat}.stamp"));
    let mut embedded_flags = vec!["-O"];
    if debug_info {
        embedded_flags.push("-g");
    }
    let fresh = embedded.exists()
        && reflected.exists()
        && std::fs::read_to_string(&stamp).is_ok_and(|old| {
            sources(&depfile)
                .and_then(|list| fingerprint(file, &list, &embedded_flags))
                .is_ok_and(|new| old == new)
        });
    if !fresh {
        glslc(root, file, &reflected, &REFLECTED_FLAGS, Some(&depfile))?;
        glslc(root, file, &embedded, &embedded_flags, None)?;
        let print = fingerprint(file, &sources(&depfile)?, &embedded_flags)?;
        std::fs::write(&stamp, print).map_err(|error| format!("{}: {error}", stamp.display()))?;
    }
    let text = std::fs::read_to_string(file).map_err(|error| format!("{name}: {error}"))?;
    let head = text
        .lines()
        .skip_while(|line| line.starts_with("#version"))
        .take_while(|line| line.starts_with("//"))
        .map(|line| line.trim_start_matches('/').trim().to_owned())
        .collect();
    Ok(Shader {
        name,
        head,
        embedded,
        reflected,
        sources: sources(&depfile)?,
    })
}

fn glslc(root: &Path, file: &Path, target: &Path, flags: &[&str], depfile: Option<&Path>) -> Result<(), String> {
    let program = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
    let mut command = Command::new(&program);
    // Vulkan 1.1 is the environment whose SPIR-V is 1.3: the newest version that every tool here reads.
    command
        .args(["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3"])
        .args(flags);
    command
        .arg("-I")
        .arg(root.join("include"))
        .arg(file)
        .arg("-o")
        .arg(target);
    if let Some(depfile) = depfile {
        command.arg("-MD").arg("-MF").arg(depfile);
    }
    let output = command.output().map_err(|error| {
        format!(
            "cannot run {}: {error}\nThe GLSL compiler glslc is needed (Debian and Ubuntu: apt-get install glslc; elsewhere: the Vulkan \
             SDK), or set GLSLC to its path.",
            program.to_string_lossy()
        )
    })?;
    if output.status.success() {
        Ok(())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// The files named by a make-style dependency file.
fn sources(depfile: &Path) -> Result<Vec<PathBuf>, String> {
    let text = std::fs::read_to_string(depfile).map_err(|error| format!("{}: {error}", depfile.display()))?;
    let list = text.split_once(": ").map_or("", |(_, list)| list);
    Ok(list
        .split_whitespace()
        .filter(|word| *word != "\\")
        .map(PathBuf::from)
        .collect())
}

/// A hash of the sources' contents, the flags and the entry file's place (a build folder may have been copied from another tree, whose
/// files its dependency lists name): what decides whether a module is still fresh.
fn fingerprint(file: &Path, sources: &[PathBuf], flags: &[&str]) -> Result<String, String> {
    let mut hasher = DefaultHasher::new();
    (file, COMMON_FLAGS, REFLECTED_FLAGS, flags).hash(&mut hasher);
    for path in sources {
        std::fs::read(path)
            .map_err(|error| format!("{}: {error}", path.display()))?
            .hash(&mut hasher);
    }
    Ok(format!("{:016x}", hasher.finish()))
}
