//! Compiles every entry file by `glslc`, in parallel, and only those that changed.
//!
//! A module goes with a stamp: a hash of the flags and of all sources, and the names of those that the compiler really used. Where the hash
//! fits the sources, the module is used as it is. That holds for the modules of an earlier build and for those that a packaged crate
//! carries in its folder `spirv/`, so that building a package needs no compiler.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::reflect::fnv1a;

/// Vulkan 1.1 is the environment whose SPIR-V is 1.3: the newest version that every tool here reads.
const COMMON_FLAGS: [&str; 3] = ["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3"];

/// Unoptimized, so that unused bindings and all names stay. Names are kept without `-g`, which would add the sources, cut in the middle of
/// multi-byte characters.
const REFLECTED_FLAGS: [&str; 1] = ["-O0"];

/// What the embedded modules are compiled with; those of debug builds get line numbers, too.
const EMBEDDED_FLAGS: [&str; 1] = ["-O"];
const EMBEDDED_DEBUG_FLAGS: [&str; 2] = ["-O", "-g"];

/// File extensions of entry files; everything else is included by them.
const STAGES: [&str; 4] = ["comp", "vert", "frag", "geom"];

/// Modules that an entry file can have beside its own, by a line `// variant: NAME` among its first: their names, and what is defined for them.
const VARIANTS: [(&str, &str); 1] = [("driver", "CLERESTORY_INDEX_DRIVER")];
const VARIANT_MARK: &str = "// variant: ";

/// How to compile.
pub struct Compiler {
    /// `glslc`, or where it is.
    pub program: OsString,
    /// The folder that `#include` searches after the includer's own.
    pub include: PathBuf,
    /// Line numbers in the embedded modules.
    pub debug_info: bool,
    /// A folder with modules and stamps that were made elsewhere.
    pub prebuilt: PathBuf,
}

/// A module of an entry file.
struct Entry {
    file: PathBuf,
    /// One of [`VARIANTS`].
    variant: Option<(&'static str, &'static str)>,
}

impl Entry {
    /// The compiler's flag for the variant.
    fn definition(&self) -> Option<String> {
        self.variant.map(|(_, word)| format!("-D{word}"))
    }
}

/// One compiled entry file.
pub struct Shader {
    /// Path below the folder of shaders, with forward slashes, `accel/trace_rays.comp`, and the variant, if it is one: `accel/trace_rays.comp (driver)`.
    pub name: String,
    /// That path alone.
    pub file: String,
    /// The variant.
    pub variant: Option<&'static str>,
    /// First comment block of the file, one string per line.
    pub head: Vec<String>,
    /// The module that goes into the library.
    pub embedded: PathBuf,
    /// The same module unoptimized with all names, for the reflection of names and layouts.
    pub reflected: PathBuf,
    /// Text of the entry file and of everything that it used, by path: below the folder of shaders, or, of the engine's
    /// includes in another crate, `engine/…`.
    pub sources: BTreeMap<String, String>,
}

impl Compiler {
    /// Compiles every entry file below `root` into `out`, and takes modules of shaders that are gone out of `out`.
    pub fn compile_all(&self, root: &Path, out: &Path) -> Result<Vec<Shader>, String> {
        let mut files = Vec::new();
        find(root, &mut files)?;
        files.sort();
        let mut entries = Vec::new();
        for file in files {
            let variants = variants(&file)?;
            entries.push(Entry {
                file: file.clone(),
                variant: None,
            });
            entries.extend(variants.into_iter().map(|variant| Entry {
                file: file.clone(),
                variant: Some(variant),
            }));
        }
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::new());
        let workers = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    while let Some(entry) = entries.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = self.compile(root, entry, out);
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
        remove_others(out, &shaders)?;
        Ok(shaders)
    }

    fn compile(&self, root: &Path, entry: &Entry, out: &Path) -> Result<Shader, String> {
        let file = below(root, &entry.file)?;
        let variant = entry.variant.map(|(variant, _)| variant);
        let name = variant.map_or(file.clone(), |variant| format!("{file} ({variant})"));
        let places = self.sources(root, &entry.file, &file)?;
        let mut sources = BTreeMap::new();
        for (name, path) in &places {
            let text = std::fs::read_to_string(path).map_err(|error| failed(path, &error))?;
            sources.insert(name.clone(), text);
        }
        let head = head_of(&sources[&file])
            .filter(|line| !line.starts_with(VARIANT_MARK))
            .map(|line| line.trim_start_matches('/').trim().to_owned())
            .collect();
        let definition = entry.definition().unwrap_or_default();
        let mut flags = EMBEDDED_FLAGS.as_slice();
        let mut folder = self.prebuilt.as_path();
        let mut used = used_if_fresh(folder, &name, &fingerprint(&sources, flags, &definition));
        if used.is_none() {
            folder = out;
            if self.debug_info {
                flags = &EMBEDDED_DEBUG_FLAGS;
            }
            let print = fingerprint(&sources, flags, &definition);
            used = used_if_fresh(folder, &name, &print);
            if used.is_none() {
                let [embedded, reflected, stamp] = products(out, &name);
                let list = stamp.with_extension("d");
                self.glslc(entry, &reflected, &REFLECTED_FLAGS, Some(&list))?;
                self.glslc(entry, &embedded, flags, None)?;
                let list = std::fs::read_to_string(&list).map_err(|error| failed(&list, &error))?;
                let names = named_in(&list, &places);
                let text = std::iter::once(&print).chain(&names).map(|line| format!("{line}\n"));
                std::fs::write(&stamp, text.collect::<String>()).map_err(|error| failed(&stamp, &error))?;
                used = Some(names);
            }
        }
        sources.retain(|name, _| used.as_ref().is_none_or(|used| used.contains(name)));
        let [embedded, reflected, _] = products(folder, &name);
        Ok(Shader {
            name,
            file,
            variant,
            head,
            embedded,
            reflected,
            sources,
        })
    }

    /// Where the entry file and everything it includes are. Includes count whatever `#if` they stand in, so there may be more than are used.
    fn sources(&self, root: &Path, file: &Path, name: &str) -> Result<BTreeMap<String, PathBuf>, String> {
        let mut sources = BTreeMap::new();
        let mut open = vec![(name.to_owned(), file.to_owned())];
        while let Some((name, path)) = open.pop() {
            let text = std::fs::read_to_string(&path).map_err(|error| failed(&path, &error))?;
            for included in text.lines().filter_map(included_file) {
                let beside = path.parent().unwrap_or(root).join(included);
                let found = if beside.exists() {
                    beside
                } else {
                    self.include.join(included)
                };
                let name = below(root, &found);
                let name = name.or_else(|_| Ok::<_, String>(format!("engine/{}", below(&self.include, &found)?)))?;
                if !sources.contains_key(&name) && open.iter().all(|(other, _)| *other != name) {
                    open.push((name, found));
                }
            }
            sources.insert(name, path);
        }
        Ok(sources)
    }

    fn glslc(&self, entry: &Entry, target: &Path, flags: &[&str], list: Option<&Path>) -> Result<(), String> {
        let mut command = Command::new(&self.program);
        command.args(COMMON_FLAGS).args(flags).args(entry.definition());
        command.arg("-I").arg(&self.include);
        command.arg(&entry.file).arg("-o").arg(target);
        if let Some(list) = list {
            command.arg("-MD").arg("-MF").arg(list);
        }
        let output = command
            .output()
            .map_err(|error| {
                format!(
                    "cannot run {}: {error}\nThe GLSL compiler glslc is needed (Debian and Ubuntu: apt-get install glslc; elsewhere: the \
                     Vulkan SDK), or set GLSLC to its path. Only a packaged crate with its own shaders unchanged does without.",
                    self.program.to_string_lossy()
                )
            })?;
        if output.status.success() {
            Ok(())
        } else {
            Err(String::from_utf8_lossy(&output.stderr).into_owned())
        }
    }
}

/// The comments that a file begins with.
fn head_of(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .skip_while(|line| line.starts_with("#version"))
        .take_while(|line| line.starts_with("//"))
}

/// The variants that an entry file asks for.
fn variants(file: &Path) -> Result<Vec<(&'static str, &'static str)>, String> {
    let text = std::fs::read_to_string(file).map_err(|error| failed(file, &error))?;
    let asked = head_of(&text).filter_map(|line| line.strip_prefix(VARIANT_MARK));
    let known = |asked: &str| VARIANTS.into_iter().find(|(variant, _)| *variant == asked);
    asked
        .map(|asked| known(asked).ok_or_else(|| format!("{}: there is no variant {asked}", file.display())))
        .collect()
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    for entry in std::fs::read_dir(folder).map_err(|error| failed(folder, &error))? {
        let path = entry.map_err(|error| failed(folder, &error))?.path();
        let extension = path.extension().and_then(|e| e.to_str());
        if path.is_dir() {
            find(&path, files)?;
        } else if extension.is_some_and(|e| STAGES.contains(&e)) {
            files.push(path);
        }
    }
    Ok(())
}

/// `x.glsl` of `#include "x.glsl"`.
fn included_file(line: &str) -> Option<&str> {
    let quoted = line.trim().strip_prefix("#include")?.trim();
    Some(quoted.strip_prefix('"')?.split_once('"')?.0)
}

/// A path below a folder, with forward slashes.
fn below(folder: &Path, path: &Path) -> Result<String, String> {
    let rest = path
        .strip_prefix(folder)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(rest.to_string_lossy().replace('\\', "/"))
}

/// The embedded module, the reflected module and the stamp of a shader.
fn products(folder: &Path, name: &str) -> [PathBuf; 3] {
    let flat = name.replace('/', "__").replace(" (", ".").replace(')', "");
    ["spv", "reflect.spv", "stamp"].map(|end| folder.join(format!("{flat}.{end}")))
}

/// The names of the sources used, when the folder holds modules of that fingerprint.
fn used_if_fresh(folder: &Path, name: &str, fingerprint: &str) -> Option<Vec<String>> {
    let [embedded, reflected, stamp] = products(folder, name);
    let text = std::fs::read_to_string(stamp).ok()?;
    let mut lines = text.lines().map(str::to_owned);
    (embedded.exists() && reflected.exists() && lines.next()? == fingerprint).then(|| lines.collect())
}

/// The names whose files stand in a make-style dependency list. Paths are looked for as they are, since the list does not mark spaces.
fn named_in(list: &str, places: &BTreeMap<String, PathBuf>) -> Vec<String> {
    let stands_in_list = |path: &Path| {
        let path = path.to_string_lossy();
        list.match_indices(&*path).any(|(at, _)| {
            let after = &list[at + path.len()..];
            list[..at].ends_with(' ') && (after.is_empty() || after.starts_with(char::is_whitespace))
        })
    };
    let named = places.iter().filter(|(_, path)| stands_in_list(path));
    named.map(|(name, _)| name.clone()).collect()
}

/// A hash of flags, paths and texts, the same on every machine.
fn fingerprint(sources: &BTreeMap<String, String>, flags: &[&str], definition: &str) -> String {
    let flags = [&COMMON_FLAGS, REFLECTED_FLAGS.as_slice(), flags];
    let text: String = sources
        .iter()
        .flat_map(|(path, text)| [path.as_str(), "\0", text, "\0"])
        .collect();
    format!("{:016x}", fnv1a(format!("{flags:?}{definition}{text}").bytes()))
}

fn remove_others(out: &Path, shaders: &[Shader]) -> Result<(), String> {
    let kept: Vec<_> = shaders.iter().flat_map(|shader| products(out, &shader.name)).collect();
    for entry in std::fs::read_dir(out).map_err(|error| failed(out, &error))? {
        let path = entry.map_err(|error| failed(out, &error))?.path();
        let product = path.extension().is_some_and(|end| end == "spv" || end == "stamp");
        if product && !kept.contains(&path) {
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(&path, &error)),
                _ => {}
            }
        }
    }
    Ok(())
}

fn failed(path: &Path, error: &std::io::Error) -> String {
    format!("{}: {error}", path.display())
}
