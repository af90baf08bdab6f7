//! kd-trees kept on disk: built once for triangles and settings, read after that.
//!
//! A file is named by the fingerprint of what the tree was built of: triangles, settings, and the version of builder and format. It holds, lowest
//! bytes first: eight letters, the version, the fingerprint, the numbers of nodes and references, these, and the fingerprint of all
//! that stands before. What is read is checked as a tree over the triangles at hand ([`KdTree::from_nodes`]); whatever is not
//! sound is built and written anew.

use super::{KdNode, KdSettings, KdTree};
use crate::atomic;
use crate::fingerprint::Fingerprint;
use crate::{Error, Result};
use glam::Vec3;
use std::path::{Path, PathBuf};

/// What files begin with.
const LETTERS: [u8; 8] = *b"CLKDTREE";

/// Counts changes of the format, and of the builder where it would build another tree of the same triangles and settings.
const VERSION: u32 = 1;

/// Bytes of a fingerprint.
const PRINT: usize = 16;

/// Letters, version, fingerprint and two numbers.
const HEADER: usize = LETTERS.len() + 4 + PRINT + 2 * 4;

/// A tree and where it came from.
#[derive(Debug)]
pub struct KeptTree {
    /// The tree.
    pub tree: KdTree,
    /// Its file.
    pub path: PathBuf,
    /// Whether it was read, not built.
    pub was_read: bool,
    /// Why a tree that was built could not be kept.
    pub not_kept: Option<Error>,
}

fn print_of(triangles: &[[Vec3; 3]], settings: &KdSettings) -> Fingerprint {
    let mut print = Fingerprint::default();
    print.add(&VERSION.to_le_bytes());
    // `Debug` prints the shortest decimals that read back to the same bits, of every field.
    print.add(format!("{settings:?}").as_bytes());
    print.add(&(triangles.len() as u64).to_le_bytes());
    for coordinate in triangles.iter().flatten().flat_map(Vec3::to_array) {
        print.add(&coordinate.to_bits().to_le_bytes());
    }
    print
}

fn encode(tree: &KdTree, print: Fingerprint) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + 8 * tree.nodes.len() + 4 * tree.references.len() + PRINT);
    bytes.extend(LETTERS);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(print.bytes());
    bytes.extend((tree.nodes.len() as u32).to_le_bytes());
    bytes.extend((tree.references.len() as u32).to_le_bytes());
    for node in &tree.nodes {
        bytes.extend(node.value.to_le_bytes());
        bytes.extend(node.word.to_le_bytes());
    }
    for reference in &tree.references {
        bytes.extend(reference.to_le_bytes());
    }
    let mut all = Fingerprint::default();
    all.add(&bytes);
    bytes.extend(all.bytes());
    bytes
}

/// The nodes and references of a file; `None` for one that is not whole, or of other triangles or settings.
fn decode(bytes: &[u8], print: Fingerprint) -> Option<(Vec<KdNode>, Vec<u32>)> {
    let (body, ending) = bytes.split_at_checked(bytes.len().checked_sub(PRINT)?)?;
    let (header, body_after) = body.split_at_checked(HEADER)?;
    let expected = [&LETTERS[..], &VERSION.to_le_bytes(), &print.bytes()].concat();
    let mut all = Fingerprint::default();
    all.add(body);
    let counts = header.strip_prefix(expected.as_slice())?;
    if all.bytes() != ending {
        return None;
    }
    let words = |bytes: &[u8]| -> Vec<u32> {
        let (words, _) = bytes.as_chunks();
        words.iter().map(|word| u32::from_le_bytes(*word)).collect()
    };
    let [nodes, references] = words(counts).try_into().ok()?;
    let all = words(body_after);
    let (nodes, rest) = all.split_at_checked(2 * nodes as usize)?;
    if rest.len() != references as usize || body_after.len() % 4 != 0 {
        return None;
    }
    let node = |pair: &[u32; 2]| KdNode {
        value: pair[0],
        word: pair[1],
    };
    Some((nodes.as_chunks().0.iter().map(node).collect(), rest.to_vec()))
}

impl KdTree {
    /// As [`KdTree::build`], but read from `folder` where the same tree was kept before, and kept there otherwise; the folder is made.
    ///
    /// # Errors
    /// As [`KdTree::build`]. A file that cannot be read, or that is damaged, is not an error: the tree is built; nor is one that cannot be
    /// written, see [`KeptTree::not_kept`].
    pub fn kept(triangles: &[[Vec3; 3]], settings: &KdSettings, folder: &Path) -> Result<KeptTree> {
        settings.check()?;
        let print = print_of(triangles, settings);
        let path = folder.join(format!("kd-{}.bin", print.text()));
        let read = std::fs::read(&path).ok();
        if let Some((nodes, references)) = read.and_then(|bytes| decode(&bytes, print))
            && let Ok(tree) = Self::from_nodes(triangles, nodes, references)
        {
            return Ok(KeptTree {
                tree,
                path,
                was_read: true,
                not_kept: None,
            });
        }
        let tree = Self::build(triangles, settings)?;
        let made = std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error));
        let written = made.and_then(|()| atomic::write_unlinked(&path, &encode(&tree, print)));
        Ok(KeptTree {
            tree,
            path,
            was_read: false,
            not_kept: written.err(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::RayIndex;
    use crate::accel::test_support::Random;

    fn soup(count: usize) -> Vec<[Vec3; 3]> {
        let mut random = Random(93);
        (0..count)
            .map(|_| {
                let corner = random.vector();
                [corner, corner + 0.1 * random.vector(), corner + 0.1 * random.vector()]
            })
            .collect()
    }

    #[test]
    fn kept_trees_are_those_that_were_built() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = KdSettings::default();
        for count in [0, 1, 700] {
            let triangles = soup(count);
            let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
            let again = KdTree::kept(&triangles, &settings, folder.path()).expect("read");
            assert!(!first.was_read && again.was_read && first.path == again.path, "{count}");
            assert_eq!(first.tree.texels(), again.tree.texels());
            assert_eq!(first.tree.statistics(), again.tree.statistics());
        }
    }

    #[test]
    fn a_builder_that_builds_another_tree_has_another_version() {
        let kept = KdTree::build(&soup(700), &KdSettings::default()).expect("built");
        let print = Fingerprint::of(&encode(&kept, Fingerprint::default()));
        // Where this differs, files of the old tree must no longer be read: raise VERSION, then put the new fingerprint here.
        assert_eq!((VERSION, print.as_str()), (1, "2f2077a276954fb156c7c8ff8f4021dc"));
    }

    #[test]
    fn a_tree_that_cannot_be_kept_is_built_all_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a file");
        std::fs::write(&file, b"").expect("written");
        let built = KdTree::kept(&soup(20), &KdSettings::default(), &file.join("below")).expect("built");
        assert!(!built.was_read && matches!(built.not_kept, Some(Error::Io { .. })));
    }

    #[test]
    fn other_triangles_and_settings_have_other_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut triangles = soup(50);
        let settings = KdSettings::default();
        let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        let other = KdSettings {
            empty_bonus: settings.empty_bonus.next_up(),
            ..settings
        };
        let with_other = KdTree::kept(&triangles, &other, folder.path()).expect("built");
        triangles[49][2].z = triangles[49][2].z.next_up();
        let moved = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        assert!(!with_other.was_read && !moved.was_read);
        assert!(first.path != with_other.path && first.path != moved.path);
    }

    #[test]
    fn damaged_files_are_written_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let (triangles, settings) = (soup(60), KdSettings::default());
        let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        let whole = std::fs::read(&first.path).expect("the file");
        let mut flipped = whole.clone();
        flipped[HEADER + 5] ^= 1;
        for damaged in [&[][..], &whole[..HEADER], &whole[..whole.len() - 1], &flipped] {
            std::fs::write(&first.path, damaged).expect("written");
            let again = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
            assert!(!again.was_read);
            assert_eq!(again.tree.texels(), first.tree.texels());
            assert_eq!(std::fs::read(&first.path).expect("the file"), whole);
        }
    }
}
