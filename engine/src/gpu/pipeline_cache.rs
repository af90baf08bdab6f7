//! The on-disk pipeline cache, for each device and driver version.
//!
//! A file holds, lowest bytes first: eight letters, the version, the fingerprint of the device's key, the number of bytes of the driver's
//! data, these, and the fingerprint of all that stands before. The driver sees data only where all of that and the data's own header fit, since drivers look at
//! little more than the header. Fingerprints find what is damaged, not what somebody has written on purpose.
//!
//! Guarantee: processes that share a folder lose nothing. Files are named by what they hold and never change; who has read some writes one that
//! holds all of them beside them before it removes them, and what others have written meanwhile stays for the next to read.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use ash::vk;

use crate::fingerprint::Fingerprint;
use crate::kept_file;

/// What files begin with.
const LETTERS: [u8; 8] = *b"CLPIPELN";

/// Counts changes of the format.
const VERSION: u32 = 1;

/// Bytes of a fingerprint.
const PRINT: usize = 16;

/// Letters, version, fingerprint of the key, and number of bytes.
const HEADER: usize = LETTERS.len() + 4 + PRINT + 8;

/// Bytes of the header that Vulkan prescribes for data (`VkPipelineCacheHeaderVersionOne`).
const DATA_HEADER: usize = 32;

/// Longer files are neither read nor written, and once so much has been read the others wait for the next time: 256 MiB.
const MOST_BYTES: u64 = 1 << 28;

/// More files than so many processes leave wait for the next time.
const MOST_FILES: usize = 32;

/// A `VkPipelineCache` and where it is kept. A cache that cannot be read or written is not an error: pipelines are then compiled again.
pub(super) struct PipelineCache {
    pub raw: vk::PipelineCache,
    files: Option<Files>,
}

impl PipelineCache {
    /// Opens the cache of the device with this key.
    pub fn open(device: &ash::Device, folder: Option<&Path>, key: &str) -> Self {
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the data is empty, or as long as a driver of this device and version has made it, with its header and its fingerprint. Against
            // somebody who forges all of these, hosts keep the folder to themselves (`GpuOptions::cache_folder`).
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        let files = folder.map(|folder| Files::new(folder, key));
        let mut raw = vk::PipelineCache::null();
        for (path, data) in files.as_ref().map(Files::read).unwrap_or_default() {
            let Ok(one) = create(&data) else { continue };
            if raw == vk::PipelineCache::null() {
                raw = one;
            } else {
                // SAFETY: both caches are alive and used here alone; the second is destroyed once and not used again.
                let merged = unsafe {
                    let merged = device.merge_pipeline_caches(raw, &[one]);
                    device.destroy_pipeline_cache(one, None);
                    merged
                };
                if merged.is_err() {
                    continue;
                }
            }
            if let Some(files) = &files {
                files.held().push(path);
            }
        }
        if raw == vk::PipelineCache::null() {
            raw = create(&[]).unwrap_or(vk::PipelineCache::null());
        }
        Self { raw, files }
    }

    /// Writes what the cache holds where the files do not yet hold it.
    pub fn save(&self, device: &ash::Device) {
        let Some(files) = self.files.as_ref().filter(|_| self.raw != vk::PipelineCache::null()) else {
            return;
        };
        // SAFETY: the cache is alive.
        if let Ok(data) = unsafe { device.get_pipeline_cache_data(self.raw) } {
            files.write(&data);
        }
    }

    /// # Safety
    /// No pipeline may be under construction.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: see above; a null handle is allowed.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// The files of one device and driver version in a folder.
struct Files {
    folder: PathBuf,
    key: String,
    /// Files of which this process holds everything.
    held: Mutex<Vec<PathBuf>>,
}

impl Files {
    fn new(folder: &Path, key: &str) -> Self {
        Self {
            folder: folder.to_owned(),
            key: key.to_owned(),
            held: Mutex::default(),
        }
    }

    fn held(&self) -> std::sync::MutexGuard<'_, Vec<PathBuf>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The data of all files that are sound. Others are complained about and removed.
    fn read(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let beginning = format!("pipelines-{}-", self.key);
        let Ok(entries) = std::fs::read_dir(&self.folder) else {
            return Vec::new();
        };
        let mut names: Vec<String> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| name.starts_with(&beginning) && name.ends_with(".bin"))
            .collect();
        names.sort_unstable();
        names.truncate(MOST_FILES);
        let (mut sound, mut total) = (Vec::new(), 0);
        for name in names {
            if total >= MOST_BYTES {
                break;
            }
            let path = self.folder.join(&name);
            match self.read_one(&path) {
                Ok(Some(data)) => {
                    total += data.len() as u64;
                    sound.push((path, data));
                }
                // Somebody else has merged it into another since the folder was listed.
                Ok(None) => {}
                Err(why) => {
                    kept_file::complain(&path, &why);
                    self.discard(&path);
                }
            }
        }
        sound
    }

    fn read_one(&self, path: &Path) -> Result<Option<Vec<u8>>, String> {
        let Some(bytes) = kept_file::read(path, MOST_BYTES)? else {
            return Ok(None);
        };
        Ok(Some(decode(&bytes, &self.key)?.to_vec()))
    }

    /// Removes a file that is not sound. Somebody else may have written a sound one in its place since it was read, so it is set aside first,
    /// looked at again, and put back if it is one.
    fn discard(&self, path: &Path) {
        static TURNS: AtomicU32 = AtomicU32::new(0);
        let turn = TURNS.fetch_add(1, Ordering::Relaxed);
        let aside = path.with_extension(format!("{}-{turn}.old", std::process::id()));
        if std::fs::rename(path, &aside).is_err() {
            return;
        }
        if matches!(self.read_one(&aside), Ok(Some(_))) || std::fs::remove_file(&aside).is_err() {
            // Where that fails, one that is sound is compiled again.
            let _ = std::fs::rename(&aside, path);
        }
    }

    /// Writes data that holds all of what was read, and removes what it holds.
    fn write(&self, data: &[u8]) {
        if !is_of_device(data, &self.key) || data.len() as u64 > MOST_BYTES - (HEADER + PRINT) as u64 {
            tracing::debug!("the driver's pipeline cache is not kept: {} bytes", data.len());
            return;
        }
        let (bytes, print) = encode(data, &self.key);
        let path = self.folder.join(format!("pipelines-{}-{}.bin", self.key, print.text()));
        let mut held = self.held();
        if !held.contains(&path) {
            let made = std::fs::create_dir_all(&self.folder).map_err(|error| error.to_string());
            if let Err(why) = made.and_then(|()| kept_file::write(&path, &bytes)) {
                tracing::debug!("pipeline cache {}: {why}", path.display());
                return;
            }
        }
        for other in held.drain(..).filter(|other| *other != path) {
            // Somebody else may have removed it before.
            let _ = std::fs::remove_file(other);
        }
        held.push(path);
    }
}

/// A file of data, and the fingerprint that it ends with.
fn encode(data: &[u8], key: &str) -> (Vec<u8>, Fingerprint) {
    let mut of_key = Fingerprint::default();
    of_key.add(key.as_bytes());
    let mut bytes = Vec::with_capacity(HEADER + data.len() + PRINT);
    bytes.extend(LETTERS);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(of_key.bytes());
    bytes.extend((data.len() as u64).to_le_bytes());
    bytes.extend(data);
    let mut all = Fingerprint::default();
    all.add(&bytes);
    bytes.extend(all.bytes());
    (bytes, all)
}

/// The data of a file.
///
/// # Errors
/// Why it is not whole, or not of the device with this key.
fn decode<'a>(bytes: &'a [u8], key: &str) -> Result<&'a [u8], &'static str> {
    const SHORT: &str = "it is not as long as it says";
    const OF_ANOTHER: &str = "it is of another device or driver";
    let body = bytes.len().checked_sub(PRINT).ok_or(SHORT)?;
    let (body, ending) = bytes.split_at(body);
    let (header, data) = body.split_at_checked(HEADER).ok_or(SHORT)?;
    let rest = header.strip_prefix(&LETTERS[..]).ok_or("it is no pipeline cache")?;
    let version = VERSION.to_le_bytes();
    let rest = rest.strip_prefix(&version[..]).ok_or("it is of another version")?;
    let mut of_key = Fingerprint::default();
    of_key.add(key.as_bytes());
    let length = rest.strip_prefix(&of_key.bytes()[..]).ok_or(OF_ANOTHER)?;
    if length != (data.len() as u64).to_le_bytes() {
        return Err(SHORT);
    }
    let mut all = Fingerprint::default();
    all.add(body);
    if all.bytes() != ending {
        return Err("it is damaged");
    }
    if !is_of_device(data, key) {
        return Err(OF_ANOTHER);
    }
    Ok(data)
}

/// Whether data begins with the header that Vulkan prescribes, with vendor, device and UUID of a key ([`Caps::cache_key`](super::Caps)).
fn is_of_device(data: &[u8], key: &str) -> bool {
    let Some(header) = data.first_chunk::<DATA_HEADER>() else {
        return false;
    };
    let (words, uuid) = header.split_at(16);
    let words: Vec<u32> = words
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
        .collect();
    let [length, version, vendor, device] = words[..] else {
        return false;
    };
    let uuid: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
    (DATA_HEADER..=data.len()).contains(&(length as usize))
        && version == vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32
        && key.starts_with(&format!("{vendor:04x}-{device:04x}-"))
        && key.ends_with(&uuid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const KEY: &str = "10de-2330-0000002a-000102030405060708090a0b0c0d0e0f";

    /// What a driver could say for the device of the key, with pipelines of a byte each.
    fn data(pipelines: &BTreeSet<u8>) -> Vec<u8> {
        let words = [32u32, 1, 0x10de, 0x2330].map(u32::to_le_bytes);
        let uuid: Vec<u8> = (0..16).collect();
        let pipelines: Vec<u8> = pipelines.iter().copied().collect();
        [words.concat(), uuid, pipelines].concat()
    }

    /// A process: it holds the pipelines of all files.
    struct Process {
        files: Files,
        pipelines: BTreeSet<u8>,
    }

    impl Process {
        fn begin(folder: &Path) -> Self {
            let files = Files::new(folder, KEY);
            let mut pipelines = BTreeSet::new();
            for (path, data) in files.read() {
                pipelines.extend(&data[DATA_HEADER..]);
                files.held().push(path);
            }
            Self { files, pipelines }
        }

        fn save_with(&mut self, more: &[u8]) {
            self.pipelines.extend(more);
            self.files.write(&data(&self.pipelines));
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect()
    }

    fn set(pipelines: &[u8]) -> BTreeSet<u8> {
        pipelines.iter().copied().collect()
    }

    #[test]
    fn processes_that_share_a_folder_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("new");
        let [mut a, mut b] = [0, 1].map(|_| Process::begin(&folder));
        a.save_with(&[1]);
        b.save_with(&[2]);
        let mut early = Process::begin(&folder);
        let mut late = Process::begin(&folder);
        assert_eq!(early.pipelines, set(&[1, 2]));
        late.save_with(&[3]);
        // What it has read is gone, and it writes all of that anew.
        early.save_with(&[4]);
        a.save_with(&[5]);
        let mut last = Process::begin(&folder);
        assert_eq!(last.pipelines, set(&[1, 2, 3, 4, 5]));
        last.save_with(&[]);
        assert_eq!(names(&folder).len(), 1);
        let same = names(&folder);
        Process::begin(&folder).save_with(&[]);
        assert_eq!(names(&folder), same);
    }

    #[test]
    fn many_at_once_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let folder = folder.path();
                scope.spawn(move || {
                    for turn in 0..8 {
                        Process::begin(folder).save_with(&[8 * thread + turn]);
                    }
                });
            }
        });
        assert_eq!(
            Process::begin(folder.path()).pipelines,
            (0..32).collect::<BTreeSet<u8>>()
        );
    }

    #[test]
    fn broken_files_are_not_used_and_removed() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files::new(folder.path(), KEY);
        let good = data(&set(&[7]));
        let (whole, _) = encode(&good, KEY);
        let with = |place: usize| {
            let mut bytes = whole.clone();
            bytes[place] ^= 1;
            bytes
        };
        let changed = |place: usize| {
            let mut data = good.clone();
            data[place] ^= 1;
            encode(&data, KEY).0
        };
        let cases = [
            ("not as long", Vec::new()),
            ("not as long", whole[..HEADER].to_vec()),
            ("not as long", whole[..whole.len() - 1].to_vec()),
            ("not as long", [&whole[..], &[0]].concat()),
            (
                "no pipeline cache",
                b"not a pipeline cache, but long enough for all of its numbers".to_vec(),
            ),
            // As the driver wrote it, without letters and fingerprint.
            ("no pipeline cache", [&good[..], &[0; 64]].concat()),
            ("another version", with(LETTERS.len())),
            ("another device", with(LETTERS.len() + 4)),
            ("another device", encode(&good, &KEY.replace("2a", "2b")).0),
            ("damaged", with(HEADER + DATA_HEADER)),
            ("damaged", with(whole.len() - 1)),
            // Whole, of data that another device, or none, has written.
            ("another device", changed(4)),
            ("another device", changed(8)),
            ("another device", changed(12)),
            ("another device", changed(31)),
            ("another device", encode(&good[..DATA_HEADER - 1], KEY).0),
        ];
        for (case, (why, bytes)) in cases.iter().enumerate() {
            let path = folder.path().join(format!("pipelines-{KEY}-{case}.bin"));
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(
                decode(bytes, KEY).map_err(|said| said.contains(why)),
                Err(true),
                "{case}"
            );
        }
        files.write(&good);
        let sound: Vec<Vec<u8>> = files.read().into_iter().map(|(_, data)| data).collect();
        assert_eq!(sound, [good]);
        assert_eq!(names(folder.path()).len(), 1, "{:?}", names(folder.path()));
        // Data without the device's header is not written.
        files.write(b"not what a driver writes");
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn a_sound_file_in_place_of_a_broken_one_stays() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files::new(folder.path(), KEY);
        files.write(&data(&set(&[1])));
        let before = names(folder.path());
        files.discard(&folder.path().join(&before[0]));
        assert_eq!(names(folder.path()), before);
        // Nor does what is no file stand in the way of anything.
        std::fs::create_dir(folder.path().join(format!("pipelines-{KEY}-folder.bin"))).unwrap();
        assert_eq!(Process::begin(folder.path()).pipelines, set(&[1]));
    }

    #[test]
    fn other_devices_and_drivers_have_other_files() {
        let folder = tempfile::tempdir().unwrap();
        Process::begin(folder.path()).save_with(&[1]);
        let other = Files::new(folder.path(), &KEY.replace("0000002a", "0000002b"));
        assert!(other.read().is_empty());
        other.write(&data(&set(&[2])));
        assert_eq!(names(folder.path()).len(), 2);
        assert_eq!(Process::begin(folder.path()).pipelines, set(&[1]));
    }
}
