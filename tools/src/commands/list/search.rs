//! Finds systems by words: all of them have to occur in what a row says or names, whatever the case.

use clerestory::catalogue::{self, Row};
use clerestory::techniques::Card;

/// Where a word stands in a row: in its id and name, in the files and paths that it names, or elsewhere.
const PLACES: usize = 3;

/// Rows with all of the words, those first whose ids and names have them, in the order of the catalogue; with the place of the word that is
/// farthest from the name, 0 for the name.
pub fn rows(words: &[String], card_of: impl Fn(&Row) -> Option<&'static Card>) -> Vec<(usize, &'static Row)> {
    let words: Vec<String> = words.iter().map(|word| singular(word)).collect();
    let found = catalogue::all().iter().filter_map(|row| {
        let texts = texts(row, card_of(row));
        let place = |word: &String| texts.iter().position(|text| text.contains(word.as_str()));
        let places: Option<Vec<usize>> = words.iter().map(place).collect();
        Some((places?.into_iter().max()?, row))
    });
    let mut found: Vec<_> = found.collect();
    found.sort_by_key(|(place, _)| *place);
    found
}

/// What a row says, by how much it is about it, in lower case.
fn texts(row: &Row, card: Option<&Card>) -> [String; PLACES] {
    let (id, summary) = card.map_or(("", ""), |card| (card.id, card.summary));
    let sources = row.sources.iter().map(|cite| cite.source.to_string());
    [
        [row.id, row.name, id, summary].join(" "),
        [&[row.module][..], row.shaders, row.api].concat().join(" "),
        [&[row.limits][..], row.settings].concat().join(" ") + " " + &sources.collect::<Vec<_>>().join(" "),
    ]
    .map(|text| text.to_lowercase())
}

/// A word in lower case, without the ending of a plural.
fn singular(word: &str) -> String {
    let word = word.to_lowercase();
    match word.strip_suffix('s') {
        Some(stem) if stem.len() > 2 => stem.to_owned(),
        _ => word,
    }
}

/// The ids nearest to what was looked for: those of rows one of whose words is a slip of the pen away.
pub fn nearest(words: &[String]) -> Vec<&'static str> {
    let words: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
    let slips = |row: &Row| {
        let text = format!("{} {}", row.id, row.name).to_lowercase();
        let known = text.split(|c: char| !(c.is_alphanumeric() || c == '-'));
        let pairs = known.flat_map(|known| words.iter().map(move |word| (known, word)));
        let distances = pairs.map(|(known, word)| (distance(known, word), word.chars().count()));
        // None in three letters, one in five.
        distances.filter(|(slips, letters)| 3 * slips < *letters).min()
    };
    let mut found: Vec<_> = catalogue::all()
        .iter()
        .filter_map(|row| Some((slips(row)?.0, row.id)))
        .collect();
    found.sort_by_key(|(slips, _)| *slips);
    found.into_iter().take(3).map(|(_, id)| id).collect()
}

/// Letters to add, to drop or to change between two words, or to swap with the next.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    // Of the first i and j letters.
    let mut least = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            if i == 0 || j == 0 {
                least[i][j] = i + j;
                continue;
            }
            let changed = least[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            least[i][j] = changed.min(least[i - 1][j] + 1).min(least[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least[i][j] = least[i][j].min(least[i - 2][j - 2] + 1);
            }
        }
    }
    least[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(words: &str) -> Vec<(usize, &'static str)> {
        let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
        let rows = rows(&words, |row| {
            let mut cards = clerestory::techniques::all().iter();
            cards.find(|card| catalogue::row_of(card).is_some_and(|own| own.id == row.id))
        });
        rows.into_iter().map(|(place, row)| (place, row.id)).collect()
    }

    #[test]
    fn words_find_what_they_name() {
        for (words, id) in [
            ("lbvh", "CL-LBVH"),
            ("LBVH", "CL-LBVH"),
            ("octahedron", "OEM-1"),
            ("octahedron maps", "OEM-1"),
            ("photon mapping", "PM-SYS-1"),
            ("kd", "PM-KD-1"),
            ("radix sort", "PM-B-4"),
            ("path tracing", "BG-3"),
            ("shadow maps", "BG-10"),
        ] {
            let found = found(words);
            assert!(found.contains(&(0, id)), "{words}: {found:?}");
            assert!(found.is_sorted_by_key(|(place, _)| *place), "{words}: {found:?}");
        }
        // By a file, by a public path, by an author.
        assert_eq!(found("lbvh_retry"), [(1, "CL-LBVH")]);
        assert_eq!(found("RadixSort"), [(1, "PM-B-4")]);
        assert!(found("karras").contains(&(2, "CL-LBVH")));
        assert_eq!(found("octahedron xylophone"), []);
    }

    #[test]
    fn slips_of_the_pen_find_the_nearest() {
        let near = |word: &str| nearest(&[word.to_owned()]);
        assert_eq!(near("lbhv")[0], "CL-LBVH");
        assert!(near("octohedron").contains(&"OEM-1"));
        assert!(near("xylophone").is_empty() && near("hard").is_empty());
        assert_eq!(
            (distance("", "abc"), distance("abc", "abd"), distance("abc", "ac")),
            (3, 1, 1)
        );
    }
}
