//! The catalogue and its sources as pages of Markdown.

use std::collections::BTreeSet;

use clerestory::catalogue::{self, Cite, PREFIXES, Row};

use super::{results, settings_of};

/// The page of the catalogue, from the repository's root.
const FROM_ROOT: &str = "../";

/// The catalogue as a page of Markdown.
pub fn catalogue() -> String {
    let mut page = String::from(
        "# Catalogue\n\nEvery system of the engine: what it is and cannot do, and where its code, kernels, settings, tests and results are. \
         Written by `clerestory list --markdown`; `clerestory list WORD…` finds systems by words, and `clerestory list ID` shows one \
         whole. Roles: a *technique* makes pictures (`clerestory render --technique`), a *kernel* is a building block for hosts, a *service* \
         is what the engine does around both, a *yardstick* is only measured. Keys of sources are those of \
         [`third_party_notes/sources.md`](../third_party_notes/sources.md).\n\n\
         Ids begin with what they follow:\n\n",
    );
    for (prefix, follows) in PREFIXES {
        page += &format!("- `{prefix}`: {follows}\n");
    }
    page += "\n## Systems\n\n| id | system | role | limits | code | bias | path set | needs | sources |\n|---|---|---|---|---|---|---|---|---|\n";
    for row in catalogue::all() {
        let bias = row.bias.map_or("–".to_owned(), |bias| bias.to_string());
        let needs = if row.needs.is_empty() {
            "baseline".to_owned()
        } else {
            row.needs.join(", ")
        };
        page += &format!(
            "| {} | {} | {} | {} | {} | {bias} | {} | {needs} | {} |\n",
            row.id,
            row.name,
            row.role,
            row.limits,
            link("engine/src/", row.module),
            row.path_set.unwrap_or("–"),
            keys(row),
        );
    }
    let folders: BTreeSet<&str> = catalogue::all().iter().map(folder).collect();
    for name in folders {
        page += &format!(
            "\n## Kernels, settings, tests and results: `{name}`\n\n\
             | id | to call | settings | kernels | tests | measured by | results |\n|---|---|---|---|---|---|---|\n"
        );
        for row in catalogue::all().iter().filter(|row| folder(row) == name) {
            page += &details(row);
        }
    }
    page
}

/// The folder of a row's module by which the second tables are ordered: a floor's, or a technique's.
fn folder(row: &Row) -> &str {
    let path = row.module.trim_start_matches("engine/src/");
    let depth = if path.starts_with("techniques/") { 2 } else { 1 };
    let end = path
        .match_indices('/')
        .nth(depth - 1)
        .map_or(path.len(), |(end, _)| end);
    &path[..end]
}

/// A line of the second tables: where everything of a row is.
fn details(row: &'static Row) -> String {
    let code = |text: &&str| {
        let short = text.trim_start_matches("clerestory::");
        format!("`{}`", short.replace('|', "\\|"))
    };
    let commands = results::commands(row);
    let pages = results::pages(&commands);
    let pages = pages
        .iter()
        .map(|page| format!("[{}]({FROM_ROOT}{})", page.name, page.path));
    format!(
        "| {} | {} | {} | {} | {} | {} | {} |\n",
        row.id,
        cell(row.api.iter().map(code)),
        settings_of(row),
        cell(row.shaders.iter().map(|shaders| link("shaders/", shaders))),
        cell(test_files(row.tests).map(|file| link("tests/tests/", file))),
        cell(commands.iter().map(|command| format!("`{command}`"))),
        cell(pages),
    )
}

/// The files of tests, each once.
pub fn test_files<'a>(tests: &'a [&'a str]) -> impl Iterator<Item = &'a str> {
    let file = |test: &'a str| test.split("::").next().unwrap_or_default();
    let first = move |i: &usize| tests[..*i].iter().all(|test| file(test) != file(tests[*i]));
    (0..tests.len()).filter(first).map(move |i| file(tests[i]))
}

/// What stands in a cell.
fn cell(texts: impl IntoIterator<Item = String>) -> String {
    let texts: Vec<String> = texts.into_iter().collect();
    if texts.is_empty() {
        "–".into()
    } else {
        texts.join(", ")
    }
}

/// A link to a file or folder of the repository, without the part of its path that goes without saying.
fn link(known: &str, path: &str) -> String {
    let short = path.strip_prefix(known).unwrap_or(path);
    format!("[{short}]({FROM_ROOT}{path})")
}

/// The keys of a row's sources with their places.
fn keys(row: &Row) -> String {
    let cite = |cite: &Cite| match cite.place {
        "" => cite.source.key.to_owned(),
        place => format!("{} ({place})", cite.source.key),
    };
    if row.sources.is_empty() {
        "the engine's own".into()
    } else {
        row.sources.iter().map(cite).collect::<Vec<_>>().join("; ")
    }
}

/// The sources that rows cite, each with those rows, as a page of Markdown.
pub fn sources() -> String {
    let mut page = String::from(
        "# Sources of the catalogue\n\nPublications that rows of the [catalogue](../docs/catalogue.md) cite, with the rows that do. Written by \
         `clerestory list --sources`. What was taken from each, in which file, stands in the page of its floor; publications carry no licence \
         that code written from them would have to repeat.\n\n\
         | key | source | rows |\n|---|---|---|\n",
    );
    for (source, rows) in catalogue::citations() {
        let rows = rows.iter().map(|(id, place)| match *place {
            "" => (*id).to_owned(),
            place => format!("{id} ({place})"),
        });
        let rows: Vec<String> = rows.collect();
        page += &format!("| {} | {source} | {} |\n", source.key, rows.join("; "));
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn repository(path: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
    }

    #[test]
    fn the_pages_are_up_to_date() {
        for (page, text, option) in [
            ("docs/catalogue.md", catalogue(), "--markdown"),
            ("third_party_notes/sources.md", sources(), "--sources"),
        ] {
            let there = std::fs::read_to_string(repository(page)).unwrap_or_default();
            assert!(
                there == text,
                "write it anew: cargo run -p clerestory-tools --bin clerestory -- list {option} > {page}"
            );
        }
    }

    #[test]
    fn every_row_stands_in_both_tables_with_links_to_what_is_there() {
        let page = catalogue();
        for row in catalogue::all() {
            assert_eq!(page.matches(&format!("\n| {} |", row.id)).count(), 2, "{}", row.id);
        }
        for target in page.split("](../").skip(1) {
            let target = target.split(')').next().unwrap();
            assert!(repository(target).exists(), "{target}");
        }
        assert!(page.contains("](../results/error-against-time/README.md)"));
    }
}
