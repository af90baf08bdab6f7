//! Readers: everything of the engine that takes bytes which it did not write, each with its seeds and the words of its formats.

use std::io::Cursor;
use std::path::Path;

use clerestory::accel::kd::{KdSettings, KdTree};
use clerestory::accel::{Ray, RayIndex};
use clerestory::film::{exr, hdr};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::transport::PathSet;
use clerestory::{Error, Result, scene, techniques};

use super::case::Case;
use super::seeds;

/// Pixels of a picture across and down: enough for several workgroups' edges.
const SIZE: [u32; 2] = [12, 8];

/// What becomes of a case.
#[derive(Debug)]
pub enum Takes {
    /// It is a scene, which a step of a render goes on with.
    Scene,
    /// It is a value of its own.
    Value(fn(&Case, &Path) -> Result<()>),
    /// It is something that only a device reads.
    OnDevice(fn(&Case, &Path) -> Result<()>),
}

/// A reader.
#[derive(Debug)]
pub struct Reader {
    /// Its name, in tables and on command lines.
    pub name: &'static str,
    /// How many of all files are its own, in proportion to those of the others.
    pub share: u32,
    /// Sound files; the folder is for what has to be written in order to make them.
    pub seeds: fn(&Path) -> Result<Vec<Case>>,
    /// Words of its formats.
    pub words: &'static [&'static str],
    /// What becomes of a case.
    pub takes: Takes,
}

const OF_GLTF: &[&str] = &[
    "\"sparse\"",
    "\"byteStride\"",
    "\"extensionsRequired\"",
    "\"children\"",
    "\"indices\"",
    "\"TANGENT\"",
    "\"COLOR_0\"",
    "\"TEXCOORD_1\"",
    "\"orthographic\"",
    "\"skin\"",
    "\"weights\"",
    "\"KHR_materials_transmission\"",
    "\"KHR_materials_volume\"",
    "\"KHR_mesh_quantization\"",
    "\"KHR_draco_mesh_compression\"",
    "data:;base64,",
    "\"BLEND\"",
    "5120",
    "5122",
    "5123",
    "5125",
    "\"MAT4\"",
    "\"count\": ",
];
const OF_OBJ: &[&str] = &[
    "\nf ",
    "\nv ",
    "\nvt ",
    "\nvn ",
    "\nusemtl ",
    "\nmtllib a.mtl",
    "\no ",
    "\ng ",
    "\ns 1",
    "\nl 1 2",
    "\np 1",
    "\ncurv 0 1 1",
    "//",
    "/",
    "1/2/3",
    "-1",
    "\\\n",
    "\nnewmtl ",
    "\nKe ",
    "\nKd ",
    "\nillum 4",
    "\nTr 0.5",
];
const OF_PLY: &[&str] = &[
    "\nelement face ",
    "\nelement vertex ",
    "\nelement tristrips ",
    "\nproperty list uchar int vertex_indices",
    "\nproperty float x",
    "\nproperty list double float vertex_index",
    "\nproperty int64 x",
    "\nend_header\n",
    "\ncomment ",
    "\nobj_info ",
    "binary_little_endian",
    "ascii",
    "1.#IND",
    "\r\n",
    "uchar",
    "char",
    "float64",
];
const OF_SIDECARS: &[&str] = &[
    "[[medium]]\n",
    "[medium]\n",
    "[environment]\n",
    "[[cameras]]\n",
    "[metals]\n",
    "reflectance = [0.9, 0.7, 1]",
    "edge_tint = [1, 0.6, 0]",
    "fresnel = \"table\"",
    "[phong]\n",
    "material = \"red\"\n",
    "boundary = true\n",
    "density = { generate = \"gradient\", size = 3 }\n",
    "phase = \"rayleigh\"\n",
    "emission = 1\n",
    "name = \"main\"\n",
    "nan",
    "inf",
    "1e38",
    "[[[",
    "\"\"\"",
    "{ a = 1 }",
    "2020-01-01",
    "0x10",
];
const OF_PICTURES: &[&str] = &[
    "channels\0",
    "chlist\0",
    "dataWindow\0",
    "box2i\0",
    "compression\0",
    "tiles\0",
    "tiledesc\0",
    "chunkCount\0",
    "type\0string\0",
    "deepscanline",
    "scanlineimage",
    "tiledimage",
    "#?RADIANCE\n",
    "FORMAT=32-bit_rle_rgbe\n",
    "-Y ",
    "+X ",
    "EXPOSURE=",
    "\n\n",
    "R\0",
    "B\0",
];
const OF_IMAGES: &[&str] = &[
    "IHDR", "IDAT", "IEND", "PLTE", "tRNS", "iCCP", "acTL", "\u{1}", "\u{10}",
];
const OF_SETTINGS: &[&str] = &[
    "\"path_set\": \"direct\"",
    "\"sampler\": \"pcg\"",
    "1e400",
    "-1",
    "null",
    "[]",
    "{}",
    ",",
    "\"seed\": 1",
];
const OF_PATH_SETS: &[&str] = &[
    "L",
    "E",
    "D",
    "S",
    "G",
    "V",
    ".",
    "*",
    "+",
    "?",
    "{",
    "}",
    "{64}",
    "{1,64}",
    "(",
    ")",
    "((((((((",
    "[",
    "]",
    "[^",
    "|",
    "!",
    ",",
    "lobes=",
    "bounces=",
    "..",
    "4294967295",
    "diffuse",
    "all",
    "none",
];

const fn of(
    name: &'static str,
    share: u32,
    seeds: fn(&Path) -> Result<Vec<Case>>,
    words: &'static [&'static str],
    takes: Takes,
) -> Reader {
    Reader {
        name,
        share,
        seeds,
        words,
        takes,
    }
}

/// All of them.
pub const READERS: &[Reader] = &[
    of("glTF", 20, seeds::gltf, OF_GLTF, Takes::Scene),
    of("GLB", 10, seeds::glb, OF_GLTF, Takes::Scene),
    of("textures", 8, seeds::textures, OF_IMAGES, Takes::Scene),
    of("OBJ", 12, seeds::obj, OF_OBJ, Takes::Scene),
    of("PLY", 14, seeds::ply, OF_PLY, Takes::Scene),
    of("sidecars", 14, seeds::sidecars, OF_SIDECARS, Takes::Scene),
    of("environments", 6, seeds::environments, OF_PICTURES, Takes::Scene),
    of("media grids", 8, seeds::grids, OF_SIDECARS, Takes::Scene),
    of(
        "EXR pictures",
        6,
        seeds::exr_pictures,
        OF_PICTURES,
        Takes::Value(exr_picture),
    ),
    of(
        "HDR pictures",
        6,
        seeds::hdr_pictures,
        OF_PICTURES,
        Takes::Value(hdr_picture),
    ),
    of("settings", 8, seeds::settings, OF_SETTINGS, Takes::Value(settings)),
    of("path sets", 8, seeds::path_sets, OF_PATH_SETS, Takes::Value(path_set)),
    of("kd caches", 4, seeds::kd_caches, &[], Takes::Value(kd_cache)),
    of(
        "pipeline caches",
        1,
        seeds::pipeline_caches,
        &[],
        Takes::OnDevice(pipeline_cache),
    ),
];

/// A reader with faults, by which tests see that they are found. It is none of [`READERS`].
const PLANTED: Reader = of(
    "planted faults",
    1,
    planted_seeds,
    &["PANIC", "ABORT"],
    Takes::Value(planted),
);

fn planted_seeds(_: &Path) -> Result<Vec<Case>> {
    Ok(vec![Case::of("main.txt", "words\n")])
}

/// Panics, aborts, asks for more memory than there may be, or does not end, where its file says so.
fn planted(case: &Case, _: &Path) -> Result<()> {
    let has = |word: &[u8]| case.main().windows(word.len()).any(|part| part == word);
    assert!(!has(b"PANIC"), "a planted panic");
    if has(b"ABORT") {
        std::process::abort();
    }
    if has(b"HOARD") {
        // At once, so that none of it is touched.
        std::hint::black_box(vec![1_u8; 1 << 32]);
    }
    if has(b"SLEEP") {
        loop {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    }
    Ok(())
}

/// The reader of that name.
///
/// # Errors
/// [`Error::Setting`] when there is none.
pub fn by_name(name: &str) -> Result<&'static Reader> {
    static ALL: &[&[Reader]] = &[READERS, &[PLANTED]];
    ALL.iter()
        .copied()
        .flatten()
        .find(|reader| reader.name == name)
        .ok_or_else(|| {
            let known: Vec<_> = READERS.iter().map(|reader| reader.name).collect();
            Error::setting("reader", name, format!("is not known; there is: {}", known.join(", ")))
        })
}

impl Reader {
    /// Whether a case of it may go through a step on a device.
    pub fn has_step(&self) -> bool {
        !matches!(self.takes, Takes::Value(_))
    }

    /// Whether nothing but a device reads it.
    pub fn is_on_device(&self) -> bool {
        matches!(self.takes, Takes::OnDevice(_))
    }

    /// Reads a case, whose files are written into a folder. It is accepted, or refused with the reason.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn read(&self, case: &Case, folder: &Path) -> Result<()> {
        match self.takes {
            Takes::Scene => load(case, folder).map(drop),
            Takes::Value(read) | Takes::OnDevice(read) => read(case, folder),
        }
    }
}

fn load(case: &Case, folder: &Path) -> Result<scene::Scene> {
    let path = case.write(folder)?;
    // What is accepted has passed its check, whatever the reader.
    let scene = scene::load(&path.display().to_string())?;
    scene.check()?;
    Ok(scene)
}

fn text(case: &Case) -> Result<&str> {
    std::str::from_utf8(case.main()).map_err(|error| Error::setting("text", case.name(), error.to_string()))
}

fn exr_picture(case: &Case, _: &Path) -> Result<()> {
    let picture = exr::read_from(Cursor::new(case.main()), case.name())?;
    picture.count_non_finite();
    picture.main_layer().map(drop)
}

fn hdr_picture(case: &Case, _: &Path) -> Result<()> {
    let picture = hdr::read_from(Cursor::new(case.main()), case.name())?;
    picture.main_layer().map(drop)
}

fn settings(case: &Case, _: &Path) -> Result<()> {
    let id = case.name().trim_end_matches(".json");
    let json: serde_json::Value =
        serde_json::from_str(text(case)?).map_err(|error| Error::setting("settings", id, error.to_string()))?;
    techniques::by_id(id)?.settings.check(&json)
}

fn path_set(case: &Case, _: &Path) -> Result<()> {
    let set: PathSet = text(case)?.trim_end().parse()?;
    let again = set.to_string().parse::<PathSet>();
    assert!(
        again.is_ok_and(|again| again == set),
        "{set} does not read back as the same"
    );
    Ok(())
}

fn kd_cache(case: &Case, folder: &Path) -> Result<()> {
    case.write(folder)?;
    let kept = KdTree::kept(&seeds::kd_triangles(), &KdSettings::default(), folder)?;
    for along in 0..8 {
        let ray = Ray {
            origin: [0.25 * along as f32, 0.3, -5.0],
            t_min: 0.0,
            direction: [0.05, 0.02 * along as f32, 1.0],
            t_max: f32::INFINITY,
        };
        kept.tree.closest_hit(&ray);
    }
    if kept.was_read {
        Ok(())
    } else {
        Err(Error::setting("kd cache", case.name(), "was made anew"))
    }
}

fn pipeline_cache(case: &Case, folder: &Path) -> Result<()> {
    // A device may leave files of its own there.
    let folder = folder.join("pipelines");
    let wrong = |error| Error::io(&folder, error);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(wrong)?;
    }
    std::fs::create_dir_all(&folder).map_err(wrong)?;
    case.write(&folder)?;
    let options = GpuOptions {
        cache_folder: Some(folder),
        ..GpuOptions::default()
    };
    Gpu::headless(&options).map(drop)
}

/// A device that renders what was accepted.
pub struct Stage {
    gpu: Gpu,
}

impl Stage {
    /// Opens the device.
    ///
    /// # Errors
    /// As [`Gpu::headless`].
    pub fn open() -> Result<Self> {
        let gpu = Gpu::headless(&GpuOptions::default())?;
        Ok(Self { gpu })
    }

    /// Loads a scene and does one step of a render of it. `Ok(false)` where the file was refused; what is accepted and then cannot be rendered
    /// (a technique that refuses the scene, a limit of the device) counts as accepted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], which no file may cause.
    pub fn step(&mut self, case: &Case, folder: &Path) -> Result<bool> {
        let Ok(scene) = load(case, folder) else {
            return Ok(false);
        };
        match self.render(&scene) {
            Err(error @ Error::DeviceLost { .. }) => Err(error),
            _ => Ok(true),
        }
    }

    fn render(&self, scene: &scene::Scene) -> Result<()> {
        let options = RenderOptions {
            size: SIZE,
            spp: 1,
            ..RenderOptions::default()
        };
        let mut rendering = Renderer::new(&self.gpu, scene)?.start(&options)?;
        rendering.step()?;
        let picture = rendering.picture()?;
        let radiance = picture.main_layer()?.count_non_finite();
        assert_eq!(
            (radiance.nan, radiance.infinite),
            (0, 0),
            "the picture has values that are no numbers"
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzzing::case::Stream;
    use crate::fuzzing::mutation::mutated;

    #[test]
    fn every_seed_is_small_and_accepted() {
        for reader in READERS.iter().filter(|reader| !reader.is_on_device()) {
            let (scratch, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
            let seeds = (reader.seeds)(scratch.path()).unwrap();
            assert!(!seeds.is_empty(), "{}", reader.name);
            for (index, seed) in seeds.iter().enumerate() {
                let folder = folder.path().join(index.to_string());
                std::fs::create_dir(&folder).unwrap();
                assert!(
                    (1..16 << 10).contains(&seed.size()),
                    "{} {index}: {}",
                    reader.name,
                    seed.size()
                );
                let read = reader.read(seed, &folder);
                assert!(read.is_ok(), "{} {index}: {}", reader.name, read.unwrap_err());
            }
        }
    }

    /// Mutations must not leave everything as it was, nor break everything: both would test nothing.
    #[test]
    fn some_files_are_refused_and_some_accepted() {
        for reader in READERS.iter().filter(|reader| !reader.is_on_device()) {
            let (scratch, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
            let seeds = (reader.seeds)(scratch.path()).unwrap();
            let is_accepted = |number: &u32| {
                let case = mutated(&seeds, reader.words, Stream::new(3, reader.name, *number));
                reader.read(&case, folder.path()).is_ok()
            };
            let accepted = (0..150).filter(is_accepted).count();
            // Of kept trees nearly every change is seen.
            let fewest = usize::from(reader.name != "kd caches");
            assert!((fewest..150).contains(&accepted), "{}: {accepted} of 150", reader.name);
        }
    }

    #[test]
    fn readers_have_names_of_their_own() {
        for reader in READERS {
            assert!(reader.share > 0 && by_name(reader.name).unwrap().name == reader.name);
        }
        assert!(by_name("no such").is_err());
        assert_eq!(by_name(PLANTED.name).unwrap().share, PLANTED.share);
    }
}
