//! kd-trees kept on disk: built once for triangles and settings, read after that.
//!
//! A file is named by the fingerprint of what the tree was built of: triangles, settings, and the version of builder and format. It holds, lowest
//! bytes first: eight letters, the version, the fingerprint, the numbers of nodes and references, these, and the fingerprint of all
//! that stands before. Length, version and fingerprints find what is damaged or of other triangles. They do not find what somebody has
//! written on purpose, since anybody can compute them: what is read is a tree over the triangles at hand ([`KdTree::from_nodes`]) that has each of them where
//! construction would put it, and no leaf much longer than construction would leave it. Whatever else stands there is built and written anew.
//! So a file is trusted with how long rays take, within those bounds, and with no hit.

use super::replay::is_of_its_triangles;
use super::tree::KdKind;
use super::{KdNode, KdSettings, KdTree};
use crate::atomic;
use crate::fingerprint::Fingerprint;
use crate::{Error, Result, kept_file};
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

/// Most bytes of a file over so many triangles, more than ten times what construction needs.
fn most_bytes(triangles: usize) -> u64 {
    (1 << 20) + (1 << 10) * triangles as u64
}

/// A tree and where it came from.
#[derive(Debug)]
pub struct KeptTree {
    /// The tree.
    pub tree: KdTree,
    /// Its file.
    pub path: PathBuf,
    /// Whether it was read, not built.
    pub was_read: bool,
    /// Why a file that was there could not be read as this tree, which was built instead. That is also logged as a warning, once for each file
    /// in a process.
    pub refused: Option<String>,
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

/// The nodes and references of a file.
///
/// # Errors
/// Why it is not whole, or of other triangles, settings or another version, or why its leaves cannot be those of a tree.
fn decode(bytes: &[u8], print: Fingerprint) -> Result<(Vec<KdNode>, Vec<u32>), &'static str> {
    const SHORT: &str = "it is not as long as it says";
    let body = bytes.len().checked_sub(PRINT).ok_or(SHORT)?;
    let (body, ending) = bytes.split_at(body);
    let (header, body_after) = body.split_at_checked(HEADER).ok_or(SHORT)?;
    let rest = header.strip_prefix(&LETTERS[..]).ok_or("it is no kd-tree")?;
    let rest = rest
        .strip_prefix(&VERSION.to_le_bytes()[..])
        .ok_or("it is of another version")?;
    let of_others = "it is of other triangles or settings";
    let counts = rest.strip_prefix(&print.bytes()[..]).ok_or(of_others)?;
    let words = |bytes: &[u8]| -> Vec<u32> {
        let (words, _) = bytes.as_chunks();
        words.iter().map(|word| u32::from_le_bytes(*word)).collect()
    };
    let [nodes, references]: [u32; 2] = words(counts).try_into().map_err(|_| SHORT)?;
    if 8 * u64::from(nodes) + 4 * u64::from(references) != body_after.len() as u64 {
        return Err(SHORT);
    }
    let mut all = Fingerprint::default();
    all.add(body);
    if all.bytes() != ending {
        return Err("it is damaged");
    }
    let (nodes, references) = body_after.split_at(8 * nodes as usize);
    let node = |pair: &[u32; 2]| KdNode {
        value: pair[0],
        word: pair[1],
    };
    let nodes: Vec<KdNode> = words(nodes).as_chunks().0.iter().map(node).collect();
    let references = words(references);
    let in_leaves = |node: &KdNode| match node.kind() {
        KdKind::Leaf { count, .. } => u64::from(count),
        KdKind::Inner { .. } => 0,
    };
    // Leaves that share references could name more of them than memory can hold.
    if nodes.iter().map(in_leaves).sum::<u64>() != references.len() as u64 {
        return Err("its leaves share references");
    }
    Ok((nodes, references))
}

impl KdTree {
    /// As [`KdTree::build`], but read from `folder` where the same tree was kept before, and kept there otherwise; the folder is made. Processes may
    /// share it: a file takes its name whole.
    ///
    /// A file is trusted with how long rays take, not with what they hit: it has a tree whose planes may be anybody's, but whose triangles are where
    /// construction would put them. A file that is damaged, too long, of another version, or no such tree, is replaced ([`KeptTree::refused`]).
    ///
    /// # Errors
    /// As [`KdTree::build`]. A file that cannot be read is not an error: the tree is built; nor is one that cannot be
    /// written, see [`KeptTree::not_kept`].
    pub fn kept(triangles: &[[Vec3; 3]], settings: &KdSettings, folder: &Path) -> Result<KeptTree> {
        settings.check()?;
        let print = print_of(triangles, settings);
        let path = folder.join(format!("kd-{}.bin", print.text()));
        let most = most_bytes(triangles.len());
        let refused = match kept_file::read(&path, most) {
            Ok(None) => None,
            Ok(Some(bytes)) => match Self::decoded(triangles, settings, &bytes, print) {
                Ok(tree) => {
                    return Ok(KeptTree {
                        tree,
                        path,
                        was_read: true,
                        refused: None,
                        not_kept: None,
                    });
                }
                Err(why) => Some(why.to_owned()),
            },
            Err(why) => Some(why),
        };
        if let Some(why) = &refused {
            kept_file::complain(&path, why);
        }
        let tree = Self::build(triangles, settings)?;
        let bytes = encode(&tree, print);
        let written = if bytes.len() as u64 > most {
            Err(Error::LimitExceeded {
                name: "kept kd-tree".into(),
                value: bytes.len() as u64,
                limit_name: "bytes of a kept kd-tree",
                limit: most,
            })
        } else {
            let made = std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error));
            made.and_then(|()| atomic::write_unlinked(&path, &bytes))
        };
        Ok(KeptTree {
            tree,
            path,
            was_read: false,
            refused,
            not_kept: written.err(),
        })
    }

    /// The tree of a file, if it may stand for the one that would be built.
    fn decoded(
        triangles: &[[Vec3; 3]],
        settings: &KdSettings,
        bytes: &[u8],
        print: Fingerprint,
    ) -> Result<Self, &'static str> {
        let (nodes, references) = decode(bytes, print)?;
        let tree = Self::from_nodes(triangles, nodes, references).map_err(|_| "it is not a tree of these triangles")?;
        if is_of_its_triangles(&tree, settings) {
            Ok(tree)
        } else {
            Err("its leaves are not those of construction")
        }
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

    /// Every broken file: the reason, that the tree is the one that is built, and that the file is whole again.
    #[test]
    fn broken_files_are_written_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let (triangles, settings) = (soup(60), KdSettings::default());
        let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        assert!(first.refused.is_none());
        let whole = std::fs::read(&first.path).expect("the file");
        let with = |place: usize, byte: u8| {
            let mut bytes = whole.clone();
            bytes[place] ^= byte;
            bytes
        };
        let print = print_of(&triangles, &settings);
        // Of nodes and references that are not those of a tree, with everything before and after as it has to be.
        let forged = |nodes: Vec<KdNode>, references: Vec<u32>| {
            let tree = KdTree {
                nodes,
                references,
                ..first.tree.clone()
            };
            encode(&tree, print)
        };
        let count = triangles.len() as u32;
        let all: Vec<u32> = (0..count).collect();
        let one_leaf = vec![KdNode::leaf(0, count), KdNode::leaf(0, 0)];
        let cut = |places: [[u32; 2]; 2]| {
            let mut nodes = vec![KdNode::inner(0, first.tree.bounds.lower.x, 2), KdNode::leaf(0, 0)];
            nodes.extend(places.map(|[first, count]| KdNode::leaf(first, count)));
            nodes
        };
        let many = [all.clone(), vec![0; 200_000]].concat();
        let cases: [(&str, Vec<u8>); 14] = [
            ("not as long", Vec::new()),
            ("not as long", whole[..HEADER].to_vec()),
            ("not as long", whole[..whole.len() - 1].to_vec()),
            ("not as long", [&whole[..], &[0]].concat()),
            ("at most", vec![0; most_bytes(triangles.len()) as usize + 1]),
            ("no kd-tree", with(0, 1)),
            ("another version", with(LETTERS.len(), 3)),
            ("other triangles", with(LETTERS.len() + 4, 1)),
            ("damaged", with(HEADER + 5, 1)),
            ("damaged", with(whole.len() - 1, 128)),
            (
                "not a tree",
                forged(vec![KdNode::leaf(0, 1), KdNode::leaf(0, 0)], vec![count]),
            ),
            ("share references", forged(cut([[0, count], [0, count]]), all.clone())),
            // All in one leaf, as many as a scene has; and all on the side of the box that is flat.
            ("those of construction", forged(one_leaf, all.clone())),
            ("those of construction", forged(cut([[0, count], [count, 0]]), all)),
        ];
        let check = |why: &str, bytes: &[u8], said: &str| {
            std::fs::write(&first.path, bytes).expect("written");
            let again = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
            let refused = again.refused.unwrap_or_default();
            assert!(!again.was_read && refused.contains(why), "{said}: {refused:?}");
            assert!(again.not_kept.is_none());
            assert_eq!(again.tree.texels(), first.tree.texels());
            assert_eq!(std::fs::read(&first.path).expect("the file"), whole);
        };
        for (case, (why, bytes)) in cases.iter().enumerate() {
            check(why, bytes, &format!("case {case}, {why}"));
        }
        // One triangle, over and over, in a leaf that is longer than devices can trace.
        let long = KdNode::leaf(0, many.len() as u32);
        let long = forged(vec![long, KdNode::leaf(0, 0)], many);
        check("those of construction", &long, "one triangle");
        std::fs::remove_file(&first.path).expect("removed");
        std::fs::create_dir(&first.path).expect("a folder in its place");
        let beside = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        assert!(beside.refused.is_some_and(|why| why.contains("not a file")) && beside.not_kept.is_some());
        assert_eq!(beside.tree.texels(), first.tree.texels());
    }

    /// One leaf of all triangles is well formed and whole; software devices refuse to trace it.
    #[test]
    fn a_leaf_as_long_as_the_scene_is_built_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = KdSettings::default();
        let at = |i: u16| Vec3::from([i % 20, i / 20 % 20, i / 400].map(f32::from));
        let triangles: Vec<[Vec3; 3]> = (0..8000)
            .map(|i| [at(i), at(i) + 0.5 * Vec3::X, at(i) + 0.5 * Vec3::Y])
            .collect();
        let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        let count = triangles.len() as u32;
        let nodes = vec![KdNode::leaf(0, count), KdNode::leaf(0, 0)];
        let wrong = KdTree::from_nodes(&triangles, nodes, (0..count).collect()).expect("a tree");
        std::fs::write(&first.path, encode(&wrong, print_of(&triangles, &settings))).expect("written");
        let again = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        assert!(!again.was_read && again.refused.is_some());
        assert_eq!(again.tree.longest_leaf(), first.tree.longest_leaf());
        assert!(first.tree.longest_leaf() < 100);
    }

    /// A tree with every triangle in some leaf, but not in every leaf that it reaches: rays would miss it.
    #[test]
    fn a_well_formed_tree_with_triangles_elsewhere_is_built_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let (triangles, settings) = (soup(300), KdSettings::default());
        let first = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        let mut references = first.tree.references.clone();
        let leaves: Vec<[usize; 2]> = first
            .tree
            .nodes
            .iter()
            .filter_map(|node| match node.kind() {
                KdKind::Leaf { first, count } if count > 0 => Some([first as usize, (first + count) as usize]),
                _ => None,
            })
            .collect();
        // The first two leaves of equal length change their triangles.
        let (a, b) = (0..leaves.len())
            .flat_map(|a| (0..a).map(move |b| (a, b)))
            .find(|(a, b)| {
                let [a, b] = [a, b].map(|leaf| &references[leaves[*leaf][0]..leaves[*leaf][1]]);
                a.len() == b.len() && a != b
            })
            .map(|(a, b)| (leaves[a], leaves[b]))
            .expect("two leaves of equal length");
        for i in 0..a[1] - a[0] {
            references.swap(a[0] + i, b[0] + i);
        }
        let wrong =
            KdTree::from_nodes(&triangles, first.tree.nodes.clone(), references).expect("every triangle is in a leaf");
        std::fs::write(&first.path, encode(&wrong, print_of(&triangles, &settings))).expect("written");
        let again = KdTree::kept(&triangles, &settings, folder.path()).expect("built");
        assert!(!again.was_read && again.refused.is_some());
        assert_eq!(again.tree.texels(), first.tree.texels());
    }

    #[test]
    fn threads_that_keep_one_tree_lose_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let (triangles, settings) = (soup(400), KdSettings::default());
        let texels = KdTree::build(&triangles, &settings).expect("built").texels().to_vec();
        std::thread::scope(|scope| {
            for _ in 0..6 {
                scope.spawn(|| {
                    let kept = KdTree::kept(&triangles, &settings, folder.path()).expect("a tree");
                    assert!(kept.refused.is_none() && kept.not_kept.is_none() && kept.tree.texels() == texels);
                });
            }
        });
        let read = KdTree::kept(&triangles, &settings, folder.path()).expect("a tree");
        assert!(read.was_read && read.tree.texels() == texels);
        assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 1);
    }
}
